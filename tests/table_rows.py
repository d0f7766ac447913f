"""Tables of examples, in files of data beside the tests that they drive."""

import inspect
import json
from pathlib import Path

import pytest


def rows(names):
    """Give a test the rows of its name in the JSON file of its module."""

    def decorate(function):
        tables = json.loads(Path(inspect.getfile(function)).with_suffix(".json").read_text("utf-8"))
        return pytest.mark.parametrize(names, tables[function.__name__])(function)

    return decorate
