"""Every example in a docstring runs."""

import doctest
import pkgutil
from importlib import import_module

import pytest

import hydrodamp

NO_EXAMPLES = ("__main__", "._core")
MODULES = sorted(
    info.name
    for info in pkgutil.walk_packages(hydrodamp.__path__, "hydrodamp.")
    if not info.name.endswith(NO_EXAMPLES)
)


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = doctest.testmod(import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0
