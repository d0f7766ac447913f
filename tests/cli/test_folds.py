from __future__ import annotations

import json

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.validation import cross_validation, workflow

from .conftest import interrupted_at

LINE = "compare a.csv --folds 5 --vehicle planar.yaml --models linear,fossen --methods ls"
THREE = LINE.replace("--folds 5", "--folds 3")


@pytest.mark.slow
def test_json_holds_every_fold_and_horizon(folder, call):
    document = json.loads(call(f"{THREE} --json").stdout)
    assert len(document["held_out"]) == 3
    linear, fossen = document["folds"]
    assert (linear["model"], fossen["model"]) == ("linear", "fossen")
    assert linear["rms"] == pytest.approx(np.sqrt(np.mean(np.square(linear["rms_by_fold"]))), 0.02)
    assert linear["rms"] < fossen["rms"]  # the plant is linear
    whole = document["whole"][0]
    assert set(whole["rms_by_horizon"]) == {"one step", "1 s", "10 s", "whole run"}
    assert document["verdict"]["model"] == "linear"


def test_without_an_error_on_any_fold_the_work_failed(folder, call):
    terms = "u v r u^2 v^2 r^2 uv ur vr u|u| v|v| r|r|"
    (folder / "wild.yaml").write_text(f"{{name: wild, terms: {{X: '{terms}'}}}}", "utf-8")
    log = hd.read_log("ab.csv")
    short = hd.concatenate([log.between(0.0, 1.0), log.between(50.0, 51.0)])
    hd.write_log(short, folder / "short.csv")
    line = "compare short.csv --models wild.yaml --folds 2 --vehicle planar.yaml --methods ls"
    assert call(line, 1).stderr.splitlines()[-1].startswith("error: ")


@pytest.mark.slow
def test_a_short_log_has_fewer_folds(folder, call):
    done = call(f"{LINE.replace('--folds 5', '--folds 390')} --json")
    n_folds = len(json.loads(done.stdout)["held_out"])
    assert 2 <= n_folds < 390
    assert f"`--folds 390`: the log is long enough for {n_folds} folds" in done.stderr


@pytest.mark.slow
def test_windows_are_scored_in_each_fold(folder, call):
    document = json.loads(call(f"{THREE} --horizon 2 --json").stdout)
    for row in document["folds"]:
        assert [each["seconds"] for each in row["windows"]] == [2.0, 2.0, 2.0]
    shown = call(f"{THREE} --horizon 2 --verbose").stdout
    assert "RMS over windows of 2 s by held-out fold" in shown


@pytest.mark.slow
def test_a_selection_is_repeated_in_each_fold(folder, call, monkeypatch):
    seen: list[int] = []

    def select(self, vehicle, log, *more):
        seen.append(log.n)
        return hd.DampingModel.from_table({"X": "u", "Y": "v", "N": "r"}, key="sparse")

    monkeypatch.setattr(hd.StepwiseSelection, "select", select)
    done = call(LINE.replace("linear,fossen", "fossen,sparse") + " --json")
    assert seen[0] == 400  # the whole log, for the errors by horizon
    assert len(seen) == 1 + 5
    assert max(seen[1:]) < 400
    assert [row["model"] for row in json.loads(done.stdout)["folds"]] == ["fossen", "sparse"]


@pytest.mark.slow
def test_ctrl_c_shows_the_folds_that_are_finished(folder, call, monkeypatch):
    whole = json.loads(call(f"{LINE} --json").stdout)
    for more in ("", " --json"):
        with monkeypatch.context() as patch:
            patch.setattr(cross_validation, "compare", interrupted_at(3, cross_validation.compare))
            done = call(LINE + more, 130)
        assert "interrupted after 2 of 5 folds" in done.stderr
        assert more or done.stdout.startswith("Usable: linear by ls")
    document = json.loads(done.stdout)
    assert document["held_out"] == whole["held_out"][:2]
    for part, row in zip(document["folds"], whole["folds"], strict=True):
        assert part["rms_by_fold"] == row["rms_by_fold"][:2]
    assert document["whole"] == []


@pytest.mark.slow
@pytest.mark.parametrize("is_first", [True, False])
def test_ctrl_c_at_once_or_after_the_last_fold(folder, call, monkeypatch, is_first):
    place = (cross_validation, "compare") if is_first else (workflow, "horizon_scores")
    monkeypatch.setattr(*place, interrupted_at(1, getattr(*place)))
    done = call(f"{LINE} --verbose", 130)
    assert ("after 5 of 5 folds; no errors by" in done.stderr) != is_first
    assert ("linear by ls" in done.stdout) != is_first


@pytest.mark.slow
def test_the_next_command_identifies_the_selected_model(folder, call):
    line = "compare a.csv --folds 3 --vehicle planar.yaml --methods weak --json"
    model = json.loads(call(f"{line} --models linear --estimate gains").stdout)["verdict"]["model"]
    said = call(f"{line} --models linear --estimate gains".replace(" --json", "")).stdout
    command = " ".join(said.split()).partition("`hydrodamp ")[2].partition("`")[0]
    document = json.loads(call(command.replace("--out damping.json", "--json")).stdout)
    assert document["model"]["key"] == model == "linear+gains"
