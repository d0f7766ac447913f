"""Studies are scripts beside each other."""

import importlib
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "studies"))


@pytest.fixture(scope="module")
def study(request):
    """The script that a file of tests is named after."""
    return importlib.import_module(request.path.stem.removeprefix("test_"))
