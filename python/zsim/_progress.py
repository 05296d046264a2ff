"""Progress of a computation."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TypeAlias

from ._zsim import InputError

Progress: TypeAlias = Callable[[str, float], object] | bool | None


def callback(progress: Progress) -> Callable[[str, float], object] | None:
    """The callback of `progress`: a callable, None, or True for a line on stderr."""
    if progress is True:
        return print_line
    if progress is None or progress is False:
        return None
    if not callable(progress):
        raise InputError(f"progress={progress!r}: expected True, None or a function of stage and fraction")
    return progress


def print_line(stage: str, fraction: float) -> None:
    print(f"\r{stage} {100 * fraction:3.0f} %", end="\n" if fraction >= 1.0 else "", file=sys.stderr, flush=True)
