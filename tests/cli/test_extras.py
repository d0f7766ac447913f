"""Packages that are not installed: one message names all extras of a call."""

import re
import sys

import pytest


@pytest.mark.parametrize(
    ("out", "extras"), [(" --out damping.json", ["logs", "report"]), ("", ["logs"])]
)
def test_a_missing_reader_and_a_missing_report_are_named_at_once(
    folder, call, monkeypatch, out, extras
):
    (folder / "a.parquet").write_bytes(b"PAR1")
    for package in ("pyarrow", "pyarrow.parquet", "matplotlib"):
        monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setattr(
        "hydrodamp.cli.output.find_spec", lambda name: None if name == "matplotlib" else name
    )
    done = call(f"identify a.parquet --vehicle planar.yaml --model linear{out}", 2)
    assert re.findall(r'pip install "hydrodamp\[(\w+)\]"', done.stderr) == extras
