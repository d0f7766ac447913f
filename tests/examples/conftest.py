"""An example, run as its script is."""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import SimpleNamespace

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture
def run(monkeypatch, capsys):
    """Return a function that runs an example; a warning is an error."""

    def call(name, *arguments):
        spec = spec_from_file_location(f"example_{name}", EXAMPLES / name / "compare.py")
        assert spec is not None
        assert spec.loader is not None
        module = module_from_spec(spec)
        monkeypatch.setitem(sys.modules, module.__name__, module)
        spec.loader.exec_module(module)
        status = module.main([str(each) for each in arguments])
        said, told = capsys.readouterr()
        return SimpleNamespace(status=status, stdout=said, stderr=told)

    return call
