"""Every example in a docstring runs."""

import doctest
import pkgutil
from importlib import import_module

import pytest

import hydrodamp

NO_EXAMPLES = ("__main__", "._core")
LONG = (
    *("batch.batch", "batch.sufficient_statistics", "identification.identifiability"),
    *("identification.command_response", "identification.predicted_error"),
    *("identification.general_model", "validation.cross_validation", "validation.diagnostics"),
)
MODULES = sorted(
    info.name
    for info in pkgutil.walk_packages(hydrodamp.__path__, "hydrodamp.")
    if not info.name.endswith(NO_EXAMPLES)
)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * name.endswith(LONG)) for name in MODULES]
)
def test_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = doctest.testmod(import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0
