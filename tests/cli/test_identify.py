from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest
from typer.testing import Result

from hydrodamp.errors import HydrodampWarning
from hydrodamp.identification.fit import Fit, empty_fit
from hydrodamp.models.files import read_damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.status import Status

Call = Callable[..., Result]
drawn = pytest.mark.skipif(
    not (find_spec("matplotlib") and find_spec("jinja2")),
    reason="pictures and reports need the extra hydrodamp[report]",
)
LINE = "identify a.csv --vehicle planar.yaml --model linear --method ls"


def test_writes_a_damping_file_with_covariance_and_vehicle(folder: Path, call: Call) -> None:
    done = call(f"{LINE} --out d.json")
    assert done.exit_code == 0, done.output
    assert "std. error" in done.stdout
    assert "grade" in done.stdout
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
    assert "aliased, so that only a combination is determined" in done.stdout
    assert "rank deficient" in done.stdout


def test_a_model_of_a_file_with_a_command(folder: Path, call: Call) -> None:
    (folder / "mine.yaml").write_text("{name: mine, terms: {X: 'u ahead', N: r}}", "utf-8")
    done = call("identify --train a.csv --vehicle planar.yaml --model mine.yaml --json")
    assert done.exit_code == 0, done.output
    assert set(json.loads(done.stdout)["coefficients"]) == {"X_u", "X_ahead", "N_r"}


@drawn
def test_the_report_says_what_the_run_was(folder: Path, call: Call) -> None:
    done = call(f"{LINE} --out d.json")
    assert done.exit_code == 0, done.output
    text = (folder / "d.report.html").read_text("utf-8")
    for name in ("a.csv", "planar.yaml"):
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() in text
    for heading in ("<dt>command</dt>", "<dt>versions</dt>"):
        assert heading in text


@drawn
def test_warnings_of_the_run_are_in_the_report(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    def warn(*args: object) -> tuple[None, tuple[()]]:
        warnings.warn("the sea was rough", HydrodampWarning, stacklevel=1)
        return None, ()

    monkeypatch.setattr("hydrodamp.cli.identify.trust", warn)
    done = call(f"{LINE} --out d.json")
    assert "warning: the sea was rough" in done.stderr
    assert "the sea was rough" in (folder / "d.report.html").read_text("utf-8")


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_nothing_of_an_earlier_fit_stays_beside_a_new_one(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch, error: type[BaseException]
) -> None:
    (folder / "d.figures").mkdir()
    mine = folder / "d.figures" / "mine.svg"
    for name in ("d.json", "d.report.html", "d.figures/power.svg", "d.figures/mine.svg"):
        (folder / name).write_text("old", "utf-8")
    index = {"pictures": [{"name": "power", "title": "", "caption": ""}]}
    (folder / "d.figures" / "index.json").write_text(json.dumps(index), "utf-8")

    def fail(*args: object) -> None:
        raise error

    monkeypatch.setattr("hydrodamp.cli.report.look_closer", fail)
    assert call(f"{LINE} --json --out d.json").exit_code in (1, 130)
    assert read_damping(folder / "d.json").covariance is not None
    assert not (folder / "d.report.html").exists()
    assert list((folder / "d.figures").iterdir()) == [mine]


@drawn
def test_a_name_with_a_point_keeps_it_in_pictures_and_report(folder: Path, call: Call) -> None:
    assert call(f"{LINE} --json --out model.v2").exit_code == 0
    found = {path.name for path in folder.glob("model*")}
    assert found == {"model.v2", "model.v2.figures", "model.v2.report.html"}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("identify d.report.html --vehicle planar.yaml --model linear", "is one of the inputs"),
        (LINE, "d.figures: no folder can be made"),
    ],
)
def test_all_targets_are_asked_for_before_the_work(
    folder: Path, call: Call, line: str, words: str
) -> None:
    (folder / "d.report.html").write_bytes((folder / "a.csv").read_bytes())
    (folder / "d.figures").write_text("", "utf-8")
    before = {path: path.read_bytes() for path in folder.iterdir()}
    done = call(f"{line} --out d.json")
    assert done.exit_code == 2, done.output
    assert words in " ".join(done.stderr.split())
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


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

    monkeypatch.setattr("hydrodamp.identification.methods.MethodEntry.value", lambda _: Hopeless())
    done = call("identify a.csv --vehicle planar.yaml --model linear --method ls --out d.json")
    assert done.exit_code == 1, done.output
    assert "error: failed" in done.stderr
    assert not (folder / "d.json").exists()


def test_a_damping_file_that_is_replaced_is_named(folder: Path, call: Call) -> None:
    line = "identify a.csv --vehicle planar.yaml --model linear --method ls --json --out d.json"
    assert "in place of" not in call(line).stderr
    assert "written to d.json, in place of an earlier one" in call(line).stderr
