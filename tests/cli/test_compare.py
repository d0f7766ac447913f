import json
import shutil

import numpy as np
import pytest

import hydrodamp as hd

from .conftest import VEHICLES, add_commands

ROW = {
    *("model", "method", "n_coefficients", "rank", "rms", "rms_by_axis", "fit_by_axis"),
    *("rms_by_segment", "status", "diverged_at", "coefficients", "fit"),
    *("n_determined", "adequacy", "standard_error"),
}
PARTS = "compare ab.csv --vehicle planar.yaml --train one --test two"
ONE = "compare a.csv --vehicle planar.yaml"


@pytest.mark.slow
def test_the_papers_models_by_the_usual_method_without_the_papers_numbers(
    folder, call, monkeypatch
):
    monkeypatch.setattr("hydrodamp.identification.methods.MethodEntry.make", usual)
    done = call(f"{ONE} --train 0:20 --test 20:40")
    for model in hd.PAPER_MODELS:
        assert model in done.stdout
    assert "paper" not in done.stdout  # another vehicle's numbers would mislead
    assert max(map(len, done.stdout.splitlines())) <= 80


def usual(entry):
    """A quick method in the place of the one that is recommended."""
    assert entry is hd.METHODS["recommended"]
    return hd.LeastSquares()


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_json_is_the_comparison_file_and_the_folder_reads_back(folder, ask):
    document = ask(f"{PARTS} --models linear,fossen --methods ls,ai --out out")
    assert document.pop("paths") == {"folder": "out", "damping": "out/damping.json"}
    assert set(document) == {"format", "version", "verdict", "rows", "units", "provenance"}
    assert document["verdict"]["model"] == "linear"
    assert set(document["verdict"]["axes"]) == {"u", "v", "r"}
    assert hd.read_damping(folder / "out" / "damping.json").model.key == "linear"
    pairs = [f"{row['model']} {row['method']}" for row in document["rows"]]
    assert pairs == ["linear ls", "fossen ls", "linear ai", "fossen ai"]
    assert all(set(row) == ROW for row in document["rows"])
    assert document["rows"][0]["rms_by_axis"].keys() == {"u", "v", "r"}
    assert document["rows"][2]["rank"] is None
    comparison = hd.read_comparison(folder / "out")
    assert comparison.best().model == "linear"
    assert comparison.best().fit.damping["Y_v"] == pytest.approx(-40.0, rel=0.02)
    assert comparison.provenance["train_segments"] == "one"
    assert comparison.provenance["test_segments"] == "two"


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("option", ["--train one --test two", "--folds 2"])
def test_a_named_model_that_nothing_drives_has_the_inputs_of_the_log(bare, ask, option):
    (bare / "mine.yaml").write_text("{name: mine, terms: {X: u ahead, Y: v turn, N: r turn}}")
    line = f"compare ab.csv --vehicle bare.yaml {option} --methods ls"
    document = ask(f"{line} --models linear,mine.yaml")
    rows = document.get("rows") or document["folds"]
    assert [row["model"] for row in rows] == ["linear+inputs", "mine"]
    assert all(row["rms"] is not None for row in rows)


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_a_command_that_nothing_uses_is_told_and_no_fault(folder, call):
    log = hd.read_log("ab.csv")
    wide = add_commands(log, battery_V=np.full(log.n, 15.0), turns=np.zeros(log.n))
    hd.write_log(wide, folder / "wide.csv")
    done = call(f"{PARTS.replace('ab.csv', 'wide.csv')} --models linear --methods ls --out out")
    (line,) = (line for line in done.stderr.splitlines() if "not used by" in line)
    assert "'battery_V', 'turns'" in line
    assert "Did you mean" not in line
    assert line.removeprefix("warning: ") in hd.read_comparison("out").provenance["warnings"]


def test_a_current_in_the_log_is_told_once_and_that_nothing_is_kept(folder, call, monkeypatch):
    current = "hydrodamp.simulation.log_issues.current_warning"
    monkeypatch.setattr(current, lambda log: f"a current for {log.duration:.0f} s.")
    done = call(f"{PARTS} --models linear --methods ls")
    (line,) = (line for line in done.stderr.splitlines() if "current" in line)
    assert line == "warning: ab.csv: a current for 40 s."
    assert "`--out DIR`" in done.stdout


@pytest.mark.usefixtures("undrawn")
def test_without_any_score_the_work_failed(folder, call):
    (folder / "wild.yaml").write_text("{name: wild, terms: {X Y N: 'u^2 v^2 r^2 uv ur vr'}}")
    line = f"{ONE} --train 0:1.4 --test 2:40 --models wild.yaml --methods ls --out out"
    done = call(line, 1)
    assert "error: no row has an RMS error (diverged)" in done.stderr
    words = " ".join(done.stdout.split())
    assert "Not usable: wild by ls, because a replay diverged." in words
    assert "It diverged in segment 1 after" in words
    (row,) = json.loads((folder / "out" / "comparison.json").read_text("utf-8"))["rows"]
    assert row["rms"] is None
    assert row["diverged_at"][0]["segment"] == "1"


@pytest.mark.slow
def test_settings_reach_the_score(folder, ask):
    line = f"{PARTS} --models fossen --methods ls --rate-unit"
    degrees, radians = (ask(f"{line} {unit}") for unit in ("deg", "rad"))
    in_degrees = degrees["rows"][0]["rms_by_axis"]["r"]
    assert in_degrees == pytest.approx(57.29578 * radians["rows"][0]["rms_by_axis"]["r"])
    assert radians["units"]["rms_by_axis"]["r"] == "rad/s"


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_guesses_of_the_vehicle_are_estimated_unless_switched_off(folder, ask):
    shutil.copy(VEHICLES / "guess.yaml", folder)
    line = "compare --train a.csv --test b.csv --vehicle guess.yaml --models linear --methods oe"
    options = "", "--estimate none", "--estimate added-mass"
    estimated, guessed, named = (ask(f"{line} {option}")["rows"][0]["rms"] for option in options)
    assert estimated < 0.5 * guessed
    assert named == estimated
