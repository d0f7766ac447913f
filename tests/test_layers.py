"""Imports only go down: the contract in pyproject.toml."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def test_imports_only_go_down(monkeypatch):
    from importlinter.cli import lint_imports

    monkeypatch.chdir(ROOT)
    assert lint_imports(config_filename="pyproject.toml", no_cache=True) == 0


@pytest.mark.parametrize("suffix", ["py", "c", "h", "cpp"])
def test_no_module_is_longer_than_350_lines(suffix):
    lengths = {
        str(path.relative_to(ROOT)): len(path.read_text().splitlines())
        for path in (ROOT / "src").rglob(f"*.{suffix}")
    }
    assert not {name: length for name, length in lengths.items() if length > 350}
