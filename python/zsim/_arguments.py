"""Arguments as JSON, for the compiled part."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy

from ._zsim import InputError


def as_json(arguments: dict[str, Any]) -> str:
    """The arguments as JSON; numbers of numpy become those of Python.

    Raises InputError with the name of an argument that is not a finite number, text, True, False or None.
    """
    return json.dumps({name: _plain(name, value) for name, value in arguments.items()})


def _plain(name: str, value: Any) -> Any:
    if isinstance(value, dict):
        return {inner: _plain(inner, part) for inner, part in value.items()}
    if isinstance(value, numpy.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{name}={value}: expected a finite number")
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise InputError(f"{name}={value!r}: expected a number or text")
