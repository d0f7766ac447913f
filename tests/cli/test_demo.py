from __future__ import annotations

import functools
import json
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from hydrodamp.simulation.campaign import reenact as campaign

Call = Callable[..., Result]


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs of a few seconds in place of 200 s."""
    brief = functools.partial(campaign.reenact, duration=12.0)
    monkeypatch.setattr(campaign, "reenact", brief)


@pytest.mark.usefixtures("short")
def test_prints_our_table_beside_the_papers(folder: Path, call: Call) -> None:
    done = call("demo --out out --truth crossflow --seed 3")
    assert done.exit_code == 0, done.output
    for word in ("Truth 'crossflow'", "seed 3", "paper LS", "Rank correlation", "not settled"):
        assert word in done.stdout
    assert (folder / "out" / "comparison.json").exists()


@pytest.mark.usefixtures("short")
def test_json_says_which_truth(call: Call) -> None:
    done = call("demo --json")
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    assert len(document["rows"]) == 32
    assert document["provenance"]["truth"] == "sname"
    assert document["provenance"]["seed"] == "0"


def test_the_folder_is_checked_before_work_starts(folder: Path, call: Call) -> None:
    done = call("demo --out a.csv")
    assert done.exit_code == 2
    assert "a.csv" in done.stderr
