"""Which data are in both parts is said, whatever names they were given by."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

Call = Callable[..., Result]
pytestmark = pytest.mark.usefixtures("undrawn")
LINE = "compare --vehicle planar.yaml --models linear --methods ls"


@pytest.mark.parametrize(
    ("parts", "shared"),
    [
        ("a.csv --train 0:20 --test 10:40", "10:19.9"),
        ("a.csv --train 0:20 --test 0:20", "0:19.9"),
        ("ab.csv --train one --test one", "0:39.9"),
        ("ab.csv --train one --test two --test 30:50", "30:39.9"),
        ("ab.csv --train 0:50 --test two", "40:49.9"),
        ("--train a.csv --test b.csv --test ./a.csv", "./a.csv"),
    ],
)
def test_shared_data_are_warned_of_and_written_down(
    folder: Path, call: Call, parts: str, shared: str
) -> None:
    done = call(f"{LINE} {parts} --out out")
    assert done.exit_code == 0, done.output
    assert f"warning: training and test data share {shared}:" in done.stderr
    assert f"Training and test data share {shared}:" in " ".join(done.stdout.split())
    document = json.loads((folder / "out" / "comparison.json").read_text("utf-8"))
    assert document["provenance"]["overlap"] == shared
    assert f"share {shared}" in (folder / "out" / "table.md").read_text("utf-8")


@pytest.mark.parametrize(
    "parts",
    [
        "a.csv --train 0:20 --test 20:40",
        "ab.csv --train one --test two",
        "ab.csv --train one --test 40:60",
        "--train a.csv --test b.csv",
    ],
)
def test_nothing_shared_is_nothing_said(folder: Path, call: Call, parts: str) -> None:
    done = call(f"{LINE} {parts} --json")
    assert done.exit_code == 0, done.output
    assert done.stderr == ""
    assert "overlap" not in json.loads(done.stdout)["provenance"]
