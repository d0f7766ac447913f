import hashlib
import json
import warnings
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.report.files import Picture, ReportContent, picture_files
from hydrodamp.results import save_results

from .conftest import add_commands

LINE = "identify a.csv --vehicle planar.yaml --model linear --method ls"


@pytest.mark.slow
def test_writes_a_damping_file_with_a_report_of_the_run_beside_it(folder, call, monkeypatch):
    pytest.importorskip("matplotlib")
    pytest.importorskip("jinja2")

    def warn(*arguments, **options):
        warnings.warn("the sea was rough", hd.HydrodampWarning, stacklevel=1)
        raise MethodError("too rough to ask")

    monkeypatch.setattr("hydrodamp.validation.diagnostics.diagnose", warn)
    done = call(f"{LINE} --out d.v2")
    for word in ("std. error", "grade"):
        assert word in done.stdout
    written = [line for line in done.stderr.splitlines() if line.startswith("written to")]
    assert written == [f"written to d.v2{end}" for end in ("", ".figures", ".report.html")]
    damping = hd.read_damping("d.v2")
    assert damping["Y_v"] == pytest.approx(-40.0, rel=0.02)
    assert damping.covariance is not None
    assert damping.vehicle is not None
    assert damping.vehicle.name == "planar"
    text = (folder / "d.v2.report.html").read_text("utf-8")
    for name in ("a.csv", "planar.yaml"):
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() in text
    for words in (
        *("<dt>command</dt>", "<dt>versions</dt>", "replayed on the training data"),
        *("the sea was rough", "Residuals: too rough to ask"),
    ):
        assert words in text
    axes = "rank         condition"  # in the report alone
    assert axes in text
    assert axes not in done.stdout
    drawn = {path.name for path in (folder / "d.v2.figures").iterdir()}
    assert {"horizons.svg", "replays.svg", "index.json"} <= drawn
    assert {"front.svg", "residuals.svg"}.isdisjoint(drawn)


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_a_wrong_thrust_is_told_before_the_fit_and_a_free_gain_undoes_it(folder, call, ask):
    assert "inconsistent with the motion" not in call(LINE).stderr
    right = (folder / "planar.yaml").read_text("utf-8")
    (folder / "planar.yaml").write_text(right.replace("[[10,", "[[30,"), "utf-8")
    said = " ".join(call(f"{LINE} --json").stderr.split())
    assert "quality issue: `X` is inconsistent with the motion" in said
    assert "0.33 (0.33 to 0.33)" in said
    done = call(f"{LINE} --method weak --estimate gains --out d.json")
    assert "inconsistent with the motion" not in done.stderr
    damping = hd.read_damping(folder / "d.json")
    assert damping["X_actuation_X"] == pytest.approx(-2.0 / 3.0, abs=0.01)
    assert damping["X_u"] == pytest.approx(-8.0, rel=0.03)
    replayed = ask("simulate b.csv --vehicle planar.yaml --damping d.json")
    assert replayed["fit_by_axis"]["u"] > 95.0


@pytest.mark.slow
@pytest.mark.parametrize(("error", "status"), [(KeyboardInterrupt, 130), (RuntimeError, 1)])
def test_all_or_nothing_of_an_earlier_fit_is_replaced(folder, call, monkeypatch, error, status):
    figures, content = folder / "d.figures", ReportContent(pictures=(Picture("a", "", 1, 1, b""),))
    save_results(picture_files(content, figures), figures)
    mine = figures / "mine.svg"
    for path in (folder / "d.json", folder / "d.report.html", mine):
        path.write_text("old", "utf-8")

    def fail(*args):
        raise error

    before = {path: path.read_bytes() for path in folder.rglob("*.*") if path.is_file()}
    assert "d.json: exists already" in call(f"{LINE} --json --out d.json", 2).stderr
    with monkeypatch.context() as patch:
        patch.setattr("hydrodamp.cli.report.draw_diagnostics", fail)
        call(f"{LINE} --json --out d.json --force", status)
    assert {path: path.read_bytes() for path in folder.rglob("*.*") if path.is_file()} == before
    monkeypatch.setattr("hydrodamp.cli.report.draw_diagnostics", lambda *_: ReportContent())
    monkeypatch.setattr("hydrodamp.cli.report.render_report", lambda *_: None)
    done = call(f"{LINE} --json --out d.json --force")
    assert hd.read_damping(folder / "d.json").covariance is not None
    assert "d.report.html stays as it is" in done.stderr
    assert (folder / "d.report.html").read_text("utf-8") == "old"
    assert [*figures.iterdir()] == [mine]


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_sparse_alone_takes_a_vehicle_without_actuators(bare, call):
    log = hd.read_log("a.csv")
    hd.write_log(add_commands(log, lamp=np.arange(log.n) % 2), bare / "lamp.csv")
    done = call("identify lamp.csv --vehicle bare.yaml --model sparse --method weak --out d.json")
    assert "grade" in done.stdout
    assert "No axis depends on the command lamp." in done.stderr
    damping = hd.read_damping("d.json")
    assert damping["X_ahead"] > 0.0
    assert damping["N_turn"] > 0.0


@pytest.mark.slow
def test_a_parameter_that_is_not_determined_keeps_the_vehicle_and_its_coefficients(
    folder, call, ask
):
    line = LINE.replace("--method ls", "--method oe")
    plain = ask(line)
    done = call(f"{line} --estimate buoyancy --json")
    document = json.loads(done.stdout)
    buoyancy = document["fit"]["estimates"]["B"]
    assert (buoyancy["grade"], buoyancy["prior"], buoyancy["unit"]) == ("not determined", 100, "N")
    assert buoyancy["cause"]
    assert document["fit"]["vehicle"] == plain["fit"]["vehicle"]
    assert document["coefficients"] == plain["coefficients"]
    assert "does not determine B: " in done.stderr
    assert "B 100" in done.stderr


def test_the_default_model_has_gains_of_commands_that_no_actuator_uses(bare, ask):
    document = ask("identify a.csv --vehicle bare.yaml --method ls")
    assert document["model"]["key"] == "general"
    assert {"X_ahead", "N_ahead", "X_turn", "N_turn"} <= set(document["coefficients"])


@pytest.mark.slow
def test_the_papers_models_have_gains_where_nothing_else_drives_the_vehicle(bare, ask):
    rows = ask("compare --vehicle bare.yaml --train a.csv --test b.csv --methods ls")["rows"]
    keys = [*(f"{key}+inputs" for key in hd.PAPER_MODELS), "general"]
    assert [row["model"] for row in rows] == keys
    assert all("N_turn" in row["coefficients"] for row in rows)


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
def test_a_fit_that_stopped_names_the_setting_for_more_iterations(call, monkeypatch):
    identify, line = hd.OutputError.identify, LINE.replace("--method ls", "--method oe")

    def stop(method, problem, model):
        fit = identify(method, problem, model)
        return replace(fit, status=hd.Status.STOPPED, unconverged=("Y",))

    monkeypatch.setattr(hd.OutputError, "identify", stop)
    done = call(line)
    assert "stopped before it converged on Y." in done.stdout
    assert f"`max_iterations={2 * hd.OutputError().max_iterations}` of the method" in done.stderr
