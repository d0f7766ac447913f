from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.canonical import write_log
from hydrodamp.data.log import Log
from hydrodamp.report.files import read_comparison

Call = Callable[..., Result]
ROW = {
    *("model", "method", "n_coefficients", "rank", "rms", "rms_by_axis", "fit_by_axis"),
    *("status", "diverged_at", "coefficients", "fit"),
}


def test_prints_every_model_and_keeps_the_papers_numbers_out(folder: Path, call: Call) -> None:
    done = call("compare a.csv --vehicle planar.yaml --train 0:20 --test 20:40")
    assert done.exit_code == 0, done.output
    for model in ("mcfarland-whitcomb", "pitch-yaw", "linear", "fossen"):
        assert model in done.stdout
    assert "paper" not in done.stdout  # another vehicle's numbers would mislead
    assert max(map(len, done.stdout.splitlines())) <= 80


@pytest.mark.usefixtures("undrawn")
def test_json_is_the_comparison_file_and_nothing_else(folder: Path, call: Call) -> None:
    done = call(
        "compare --train a.csv --test b.csv --vehicle planar.yaml --models linear,fossen "
        "--methods ls,ai --json --out out"
    )
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    written = json.loads((folder / "out" / "comparison.json").read_text(encoding="utf-8"))
    assert document == written
    assert set(document) == {"rows", "units", "provenance"}
    assert [(row["model"], row["method"]) for row in document["rows"]] == [
        ("linear", "ls"),
        ("fossen", "ls"),
        ("linear", "ai"),
        ("fossen", "ai"),
    ]
    assert all(set(row) == ROW for row in document["rows"])
    assert document["rows"][0]["rms_by_axis"].keys() == {"u", "v", "r"}
    assert document["rows"][2]["rank"] is None


def test_the_true_model_wins_and_its_folder_reads_back(folder: Path, call: Call) -> None:
    done = call(
        "compare ab.csv --vehicle planar.yaml --train one --test two --models linear,fossen "
        "--methods ls --out out"
    )
    assert done.exit_code == 0, done.output
    comparison = read_comparison(folder / "out")
    assert comparison.best().model == "linear"
    assert comparison.best().fit.damping["Y_v"] == pytest.approx(-40.0, rel=0.02)
    assert comparison.provenance["train_segments"] == "one"
    assert comparison.provenance["test_segments"] == "two"


def test_a_model_too_large_is_a_row_with_a_status(folder: Path, call: Call) -> None:
    done = call(
        "compare a.csv --vehicle planar.yaml --train 0:0.6 --test 1:20 "
        "--models mcfarland-whitcomb,linear --methods ls --json"
    )
    assert done.exit_code == 0, done.output
    rows = json.loads(done.stdout)["rows"]
    assert rows[0]["status"] == "too few samples"
    assert set(rows[0]["coefficients"].values()) == {None}
    assert rows[1]["rms"] is not None


@pytest.mark.usefixtures("undrawn")
def test_without_any_score_the_work_failed(folder: Path, call: Call) -> None:
    (folder / "wild.yaml").write_text(
        "{name: wild, terms: {X Y N: 'u^2 v^2 r^2 u v r uv ur vr u|u| v|v| r|r|'}}", "utf-8"
    )
    done = call(
        "compare a.csv --vehicle planar.yaml --train 0:1.4 --test 2:40 --models wild.yaml "
        "--methods ls --out out"
    )
    assert done.exit_code == 1, done.output
    assert "error: no row has an RMS error (diverged)" in done.stderr
    assert "wild by ls diverged in 1 after" in " ".join(done.stdout.split())
    row = json.loads((folder / "out" / "comparison.json").read_text("utf-8"))["rows"][0]
    assert row["rms"] is None
    assert row["diverged_at"][0]["segment"] == "1"


def test_settings_reach_the_score(folder: Path, call: Call) -> None:
    line = "compare ab.csv --vehicle planar.yaml --train one --test two --models fossen --json"
    degrees, radians = (
        json.loads(call(f"{line} --methods ls --rate-unit {unit}").stdout)
        for unit in ("deg", "rad")
    )
    in_degrees = degrees["rows"][0]["rms_by_axis"]["r"]
    assert in_degrees == pytest.approx(57.29578 * radians["rows"][0]["rms_by_axis"]["r"])
    assert radians["units"]["rms_by_axis"]["r"] == "rad/s"


def test_data_in_both_parts_is_warned_of(folder: Path, call: Call) -> None:
    done = call(
        "compare a.csv --vehicle planar.yaml --train 0:20 --test 10:40 --models linear --methods ls"
    )
    assert done.exit_code == 0
    assert "warning: training and test data share 10:19.9" in done.stderr


def test_a_fit_that_is_refused_is_a_row_that_says_why(folder: Path, call: Call) -> None:
    done = call(
        "compare a.csv --vehicle planar.yaml --train 0:5 --test 20:40 --out out "
        "--models mcfarland-whitcomb,fossen --methods ridge,weak"
    )
    assert done.exit_code == 0, done.output
    assert "refused" in done.stdout
    assert "mcfarland-whitcomb by ridge: " in " ".join(done.stdout.split())
    rows = read_comparison(folder / "out").rows
    assert [row.status.word for row in rows[:2]] == ["refused", "refused"]
    assert len(rows) == 4


@pytest.mark.usefixtures("undrawn")
def test_an_earlier_comparison_is_named_before_it_goes(folder: Path, call: Call) -> None:
    line = "compare a.csv --vehicle planar.yaml --train 0:20 --models linear --methods ls --out out"
    assert "earlier comparison" not in call(f"{line} --test 20:40").stderr
    (old,) = (folder / "out" / "fits").iterdir()
    again = call(f"{line.replace('linear', 'fossen')} --test 20:40")
    assert "out holds an earlier comparison, which this one replaces" in again.stderr
    assert not old.exists()
    assert [row.model for row in read_comparison("out").rows] == ["fossen"]


def test_a_rate_in_the_wrong_unit_is_told_before_it_is_fitted(folder: Path, call: Call) -> None:
    time = np.arange(0.0, 60.0, 0.1)
    heading = np.sin(time / 2)
    rate = 0.5 * np.cos(time / 2)
    euler = np.column_stack((0.0 * time, 0.0 * time, heading))
    log = Log.from_arrays(
        time,
        {"u": 1.0 + 0.1 * np.sin(time), "v": 0.1 * np.cos(time), "r": np.radians(rate)},
        attitude=quaternion_from_euler(euler),
        commands={"ahead": np.sin(time), "turn": np.cos(time)},
    )
    write_log(log, folder / "turns.csv")
    done = call("identify turns.csv --vehicle planar.yaml --model linear --method ls --json")
    told = " ".join(done.stderr.split())
    assert "warning: turns.csv: suspicion: `r` is rad/s taken for deg/s" in told
