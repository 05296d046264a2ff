"""The command that the package is compared with."""

import os
import shutil

import pytest


@pytest.fixture(scope="session")
def command():
    """The command `zsim`: the variable ZSIM, else that in PATH."""
    found = os.environ.get("ZSIM") or shutil.which("zsim")
    if found is None:
        pytest.skip("the command zsim is neither in PATH nor in the variable ZSIM")
    return found
