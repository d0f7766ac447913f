from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner, Result

import hydrodamp as hd
from hydrodamp.cli.output import guarded
from hydrodamp.cli.report import Beside, illustrate, offer, report
from hydrodamp.report import examine as examining, page as pages

Call = Callable[..., Result]


@pytest.fixture
def call() -> Call:
    """Return a function that calls the command alone."""
    app = typer.Typer()
    app.command()(guarded(report))
    return lambda line: CliRunner().invoke(app, line.split())


@pytest.fixture(scope="module")
def fitted() -> tuple[hd.Fit, hd.Vehicle, hd.Log]:
    """A fit of a planar vehicle to 400 samples of its own motion."""
    vehicle = hd.Vehicle(
        name="planar",
        mass_matrix=np.diag([20.0, 30.0, 1.0, 1.0, 1.0, 5.0]),
        weight=100.0,
        buoyancy=100.0,
        axes=("X", "Y", "N"),
    )
    truth = hd.Damping.from_dict(None, {"X_u": -8.0, "Y_v": -40.0, "N_r": -6.0})
    time = 0.1 * np.arange(400)
    wrench = np.zeros((400, 6))
    wrench[:, [0, 1, 5]] = np.sin(np.outer(time, [0.9, 0.7, 1.3]))
    wrench[:, 0] += 5.0
    still = hd.Log(time, np.zeros((400, 6)), wrench=wrench, source="a.csv")
    log = replace(still, velocity=hd.simulate(vehicle, truth, still).velocity)
    return hd.identify(hd.catalog["linear"], vehicle, log, hd.LeastSquares()), vehicle, log


@pytest.fixture(scope="module")
def comparison(fitted: tuple[hd.Fit, hd.Vehicle, hd.Log]) -> hd.Comparison:
    """The fit alone, replayed."""
    fit, vehicle, log = fitted
    return hd.compare([fit], vehicle, log)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to be in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def results(comparison: hd.Comparison, folder: Path) -> Path:
    """A folder of results."""
    hd.write_comparison(comparison, folder / "out")
    return folder / "out"


def test_the_report_goes_into_the_folder(results: Path, call: Call) -> None:
    for _ in range(2):  # one that is there already is replaced
        done = call("out")
        assert done.exit_code == 0, done.output
        assert "written to out/report.html" in done.stderr
    text = (results / "report.html").read_text("utf-8")
    assert "linear by ls" in text
    assert "which was compared with no other" in text
    assert '"name":"r","unit":"deg/s"' in text
    assert '"name":"w"' not in text  # a locked velocity is not drawn


def test_or_where_it_is_asked_to_go(results: Path, call: Call, folder: Path) -> None:
    assert call("out --out mine.html").exit_code == 0
    assert (folder / "mine.html").exists()
    assert not (results / "report.html").exists()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("nowhere", "nowhere: is no folder of results"),
        ("nowhere --out r.html", "nowhere: is no folder of results"),
        ("out --out out/replays.npz", "is one of the inputs"),
        ("out --out deep/r.html", "there is no folder deep"),
        ("out --out out", "is a folder"),
    ],
)
def test_what_cannot_be_is_refused(results: Path, call: Call, line: str, words: str) -> None:
    done = call(line)
    assert done.exit_code == 2
    assert words in " ".join(done.stderr.split())


def test_a_spoilt_folder_is_refused(results: Path, call: Call) -> None:
    (results / "comparison.json").write_text("[]", "utf-8")
    done = call("out")
    assert done.exit_code == 2
    assert "out/comparison.json: is not what hydrodamp writes" in done.stderr
    assert not (results / "report.html").exists()


def test_without_jinja2_a_note_says_how_to_get_it(
    results: Path, call: Call, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pages, "find_spec", lambda _: None)
    done = call("out")
    assert done.exit_code == 0
    assert 'pip install "hydrodamp[report]", then run the command again.' in done.stderr
    assert "written" not in done.stderr
    assert not (results / "report.html").exists()
    assert not offer(str(results), results / "report.html")
    assert "jinja2" in capsys.readouterr().err


def test_a_fit_alone_is_replayed_on_what_it_was_fitted_to(
    fitted: tuple[hd.Fit, hd.Vehicle, hd.Log], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fit, vehicle, log = fitted
    assert np.all(np.isfinite(fit.damping.coefficients))
    said = {"command": "hydrodamp identify a.csv", "versions": "Python 3"}
    Beside(Path("damping.json")).illustrate(fit, ("axis  grade\nX     known",), vehicle, log, said)
    text = (folder / "damping.report.html").read_text("utf-8")
    assert "share all 400 samples" in text
    assert "hydrodamp identify a.csv" in text
    assert "<pre>axis  grade\nX     known</pre>" in text
    drawn = {path.name for path in (folder / "damping.figures").iterdir()}
    assert {"excitation.svg", "residuals.svg", "replays.svg", "index.json"} <= drawn
    assert "front.svg" not in drawn
    said = capsys.readouterr().err
    assert "written to damping.figures\nwritten to damping.report.html" in said


def test_without_the_extra_nothing_is_said_to_be_written(
    fitted: tuple[hd.Fit, hd.Vehicle, hd.Log],
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(pages, "find_spec", lambda _: None)
    monkeypatch.setattr(examining, "find_spec", lambda _: None)
    fit, vehicle, log = fitted
    Beside(Path("damping.json")).illustrate(fit, (), vehicle, log, {})
    said = capsys.readouterr().err
    assert "written" not in said
    assert "matplotlib" in said
    assert "jinja2" in said
    assert "hydrodamp report" not in said  # there is no folder of results
    assert said.count("then run the command again.") == 2
    assert not list(folder.glob("damping.*"))


def test_grades_pictures_and_report_go_beside_the_results(
    fitted: tuple[hd.Fit, hd.Vehicle, hd.Log], comparison: hd.Comparison, results: Path, call: Call
) -> None:
    _, vehicle, log = fitted
    written = illustrate(comparison, vehicle, log, results)
    assert written == ("identifiability.json", "band.npz", "figures", "report.html")
    first = (results / "report.html").read_bytes()
    assert call("out").exit_code == 0
    assert (results / "report.html").read_bytes() == first
    assert b"The log determined " in first


def test_a_page_elsewhere_names_a_lost_picture(
    fitted: tuple[hd.Fit, hd.Vehicle, hd.Log],
    comparison: hd.Comparison,
    results: Path,
    call: Call,
    folder: Path,
) -> None:
    _, vehicle, log = fitted
    illustrate(comparison, vehicle, log, results)
    (results / "figures" / "power.svg").unlink()
    done = call("out --out elsewhere.html")
    assert done.exit_code == 0, done.output
    text = (folder / "elsewhere.html").read_text("utf-8")
    assert "The run wrote its pictures as SVG files for print" in text
    assert "Power over the operating box: power.svg is not there" in text
    assert "beside this report" not in text


def test_without_the_extra_grades_are_written_all_the_same(
    fitted: tuple[hd.Fit, hd.Vehicle, hd.Log],
    comparison: hd.Comparison,
    results: Path,
    call: Call,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    _, vehicle, log = fitted
    with monkeypatch.context() as bare:
        bare.setattr(pages, "find_spec", lambda _: None)
        bare.setattr(examining, "find_spec", lambda _: None)
        written = illustrate(comparison, vehicle, log, results)
    assert written == ("identifiability.json", "band.npz")
    said = capsys.readouterr().err
    assert said.count('pip install "hydrodamp[report]"') == 2
    assert f"then `hydrodamp report {results}` makes it." in said
    done = call("out")  # later, with the extra: no log, so no pictures, and the page says so
    assert done.exit_code == 0
    text = (results / "report.html").read_text("utf-8")
    assert "the pictures need the package matplotlib" in text.lower()
    assert "The log determined " in text
