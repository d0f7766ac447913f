from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from hydrodamp.simulation import score as horizons
from hydrodamp.validation import crossvalidation

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


def interrupted_at(number: int, function: Callable[..., object]) -> Callable[..., object]:
    """Return a function that is interrupted at its n-th call."""
    calls: list[None] = []

    def run(*given: object, **more: object) -> object:
        calls.append(None)
        if len(calls) == number:
            raise KeyboardInterrupt
        return function(*given, **more)

    return run


def test_ctrl_c_shows_the_folds_that_are_finished(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = json.loads(call(f"{LINE} --json").stdout)
    for more in ("", " --json"):
        with monkeypatch.context() as patch:
            patch.setattr(crossvalidation, "compare", interrupted_at(3, crossvalidation.compare))
            done = call(LINE + more)
        assert done.exit_code == 130
        assert "2 of 5 folds" in done.stderr
        assert "2 of 5 folds: interrupted" in done.stdout
    document = json.loads(done.stdout)
    assert document["held_out"] == whole["held_out"][:2]
    for part, row in zip(document["folds"], whole["folds"], strict=True):
        assert part["rms_by_fold"] == row["rms_by_fold"][:2]
    assert document["whole"] == []


def test_ctrl_c_after_the_last_fold_shows_them_all(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    function = horizons.scores_with_restarts
    monkeypatch.setattr(horizons, "scores_with_restarts", interrupted_at(1, function))
    done = call(LINE)
    assert done.exit_code == 130
    assert "5 of 5 folds, and no errors by horizon" in done.stderr
    assert "linear by ls" in done.stdout


def test_ctrl_c_before_the_first_fold_says_so(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(crossvalidation, "compare", interrupted_at(1, crossvalidation.compare))
    done = call(LINE)
    assert done.exit_code == 130
    assert "interrupted before any fold was finished" in done.stderr
    assert not done.stdout
