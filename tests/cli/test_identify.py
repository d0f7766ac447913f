from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from hydrodamp.identification.fit import Fit, empty_fit
from hydrodamp.identification.methods import METHODS
from hydrodamp.models.damping_file import read_damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.status import Status

Call = Callable[..., Result]
LINE = "identify a.csv --vehicle planar.yaml --model linear --method ls"


def test_writes_a_damping_file_with_covariance_and_vehicle(folder: Path, call: Call) -> None:
    done = call(f"{LINE} --out d.json")
    assert done.exit_code == 0, done.output
    assert "std. error" in done.stdout
    assert "written to d.json" in done.stderr
    damping = read_damping(folder / "d.json")
    assert damping["Y_v"] == pytest.approx(-40.0, rel=0.02)
    assert damping.covariance is not None
    assert damping.vehicle is not None
    assert damping.vehicle.name == "planar"


def test_json_is_the_damping_file(folder: Path, call: Call) -> None:
    done = call(f"{LINE} --train 0:30 --json --out d.json")
    document = json.loads(done.stdout)
    assert document == json.loads((folder / "d.json").read_text("utf-8"))
    assert document["fit"]["method"] == "ls"
    assert document["fit"]["n_samples"] < 400


def test_names_what_the_data_cannot_tell_apart(folder: Path, call: Call) -> None:
    done = call("identify a.csv --vehicle planar.yaml --model uncoupled --method ls")
    assert done.exit_code == 0
    assert "are known only together" in done.stdout
    assert "rank deficient" in done.stdout


def test_a_model_of_a_file_with_a_command(folder: Path, call: Call) -> None:
    (folder / "mine.yaml").write_text("{name: mine, terms: {X: 'u ahead', N: r}}", "utf-8")
    done = call("identify --train a.csv --vehicle planar.yaml --model mine.yaml --json")
    assert done.exit_code == 0, done.output
    assert set(json.loads(done.stdout)["coefficients"]) == {"X_u", "X_ahead", "N_r"}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("identify --vehicle planar.yaml --model linear", "name a LOG"),
        ("identify a.csv --vehicle planar.yaml --model linaer", "Did you mean 'linear'?"),
        ("identify a.csv --vehicle planar.yaml --model linear --method lss", "Did you mean 'ls'?"),
        ("identify a.csv --vehicle planar.yaml --model two.yaml", "takes one model"),
        (f"{LINE} --out none/d.json", "there is no folder none"),
        (f"{LINE} --out .", "is a folder"),
        (f"{LINE} --train 0:0.2", "samples are fewer"),
    ],
)
def test_bad_input(folder: Path, call: Call, line: str, words: str) -> None:
    (folder / "two.yaml").write_text(
        "models: [{name: a, terms: {X: u}}, {name: b, terms: {X: u}}]", "utf-8"
    )
    before = sorted(folder.iterdir())
    done = call(line)
    assert done.exit_code == 2, done.output
    assert words in done.stderr
    assert sorted(folder.iterdir()) == before


def test_a_fit_without_numbers_writes_nothing(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Hopeless:
        key = "ls"

        def identify(self, problem: Problem, model: DampingModel) -> Fit:
            return empty_fit(problem, model, self.key, Status.FAILED)

    monkeypatch.setitem(METHODS, "ls", Hopeless())
    done = call("identify a.csv --vehicle planar.yaml --model linear --method ls --out d.json")
    assert done.exit_code == 1, done.output
    assert "error: failed" in done.stderr
    assert not (folder / "d.json").exists()
