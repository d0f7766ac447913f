from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

Call = Callable[..., Result]
LINE = "validate a.csv --vehicle planar.yaml --models linear,fossen --methods ls"


def test_tables_say_which_model_and_why(folder: Path, call: Call) -> None:
    done = call(LINE)
    assert done.exit_code == 0, done.output
    assert "5 folds" in done.stdout
    assert "linear by ls" in done.stdout
    assert "lowest RMS error of 2 replays" in " ".join(done.stdout.split())
    for column in ("step", "1 s", "10 s", "run", "AICc", "BIC"):
        assert column in done.stdout


def test_json_holds_every_fold_and_horizon(folder: Path, call: Call) -> None:
    document = json.loads(call(f"{LINE} --folds 3 --json").stdout)
    assert len(document["held_out"]) == 3
    linear, fossen = document["folds"]
    assert (linear["model"], fossen["model"]) == ("linear", "fossen")
    assert linear["rms"] == pytest.approx(sum(linear["rms_by_fold"]) / 3)
    assert linear["rms"] < fossen["rms"]  # the plant is linear
    whole = document["whole"][0]
    assert set(whole["rms_by_horizon"]) == {"one step", "1 s", "10 s", "whole run"}
    assert whole["bic"] < document["whole"][1]["bic"]
    assert document["choice"].startswith("linear by ls")


def test_a_model_that_always_diverges_is_no_choice(folder: Path, call: Call) -> None:
    """One fold less than a model needs, and no other model."""
    done = call("validate a.csv --vehicle planar.yaml --models linear --methods ls --folds 390")
    assert done.exit_code == 2
    assert "fold" in done.stderr


def test_the_selected_model_is_sent_to_compare(folder: Path, call: Call) -> None:
    done = call("validate a.csv --vehicle planar.yaml --models sparse")
    assert done.exit_code == 2
    assert "hydrodamp compare" in done.stderr
