"""The verb and the card: whole or not at all, exact or said what was lost."""

import hashlib
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import FileError, MethodError, ModelError, ProblemError, PropulsionWarning
from hydrodamp.export import c99
from hydrodamp.export.fidelity import Fidelity, Replays, wrench_errors
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.scripts import Python
from hydrodamp.export.target import NotRun
from hydrodamp.export.verification import VerificationRun, sample_states
from hydrodamp.identification.dissipativity import operating_box
from hydrodamp.results import MANIFEST

PUBLISHED = hd.published["vt690-sname2022"]


@dataclass(frozen=True)
class Linear(Python):
    """A target that holds linear damping alone."""

    key: ClassVar[str] = "linear"
    description: ClassVar[str] = "a target of linear terms"
    factor: float = 1.0

    def representable_model(self, plant):
        return hd.catalog["linear"]

    def render_files(self, plant):
        damping = replace(plant.damping, coefficients=self.factor * plant.damping.coefficients)
        return super().render_files(replace(plant, damping=damping))


@pytest.mark.slow
@pytest.mark.parametrize("with_log", [True, False])
def test_an_exact_export_is_the_same_but_for_rounding(campaign, tmp_path, with_log):
    log = campaign.test if with_log else None
    card = hd.export(PUBLISHED, campaign.vehicle, "python", tmp_path / "a", log=log)
    assert card.exact
    assert max(card.wrench_error.values()) < 1e-10
    assert "rounding" in str(card)
    assert card.power["source"] == card.power["target"]
    assert (card.replays is not None) == with_log
    if card.replays:
        assert card.replays.source_to_target.rms < 1e-12
        assert card.replays.source_to_log.rms == pytest.approx(card.replays.target_to_log.rms)
    written = json.loads((tmp_path / "a" / "fidelity.json").read_text("utf-8"))
    assert (written["target"], written["exact"]) == ("python", True)


@pytest.mark.slow
def test_a_recorded_wrench_takes_the_place_of_actuators(campaign, tmp_path):
    log = campaign.exact_test
    named = {name: log.command(name) for name in log.command_names}
    bare = replace(campaign.vehicle, weight=0.0, buoyancy=0.0)
    wrench = bare.known_wrench(log.velocity, log.down, named)
    driven = replace(log, wrench=wrench, commands=np.empty((log.n, 0)), command_names=())
    card = hd.export(PUBLISHED, campaign.vehicle, "python", tmp_path / "a", log=driven)
    assert card.inputs == ("wrench",)
    assert card.replays.source_to_target.rms < 1e-12


@pytest.mark.slow
def test_terms_a_target_cannot_hold_are_fitted_where_the_log_sailed(campaign, tmp_path, refused):
    card = hd.export(PUBLISHED, campaign.vehicle, Linear(), tmp_path / "a", log=campaign.test)
    assert not card.exact
    assert "X_u|u|" in card.projected
    assert 0.1 < card.wrench_error["X"] < 50.0
    assert card.replays.source_to_target.rms > 0.01
    assert "Projected terms: " in str(card)
    refused(MethodError, lambda: hd.export(PUBLISHED, campaign.vehicle, Linear(), tmp_path / "b"))
    again = hd.export(
        *(PUBLISHED, campaign.vehicle, Linear(), tmp_path / "b"),
        box=operating_box(
            VerificationRun.of(ExportedPlant.of(campaign.vehicle, PUBLISHED), campaign.test).problem
        ),
    )
    assert again.projected == card.projected


@pytest.mark.slow
def test_a_projection_that_diverges_is_refused_unless_forced(campaign, tmp_path, refused):
    wild, out = Linear(factor=-5.0), tmp_path / "a"
    refused(MethodError, hd.export, PUBLISHED, campaign.vehicle, wild, out, log=campaign.test)
    assert not [*tmp_path.iterdir()]
    card = hd.export(PUBLISHED, campaign.vehicle, wild, out, log=campaign.test, force=True)
    assert card.replays.target_to_log.diverged
    assert "diverged after" in str(card)


@pytest.mark.slow
def test_what_could_not_be_run_is_said(campaign, tmp_path):
    class Elsewhere(Python):
        def open_engine(self, folder, plant):
            raise NotRun("its simulator is not installed")

    card = hd.export(PUBLISHED, campaign.vehicle, Elsewhere(), tmp_path / "a", log=campaign.test)
    assert "Not run: its simulator is not installed." in str(card)
    assert card.replays is None
    assert card.wrench_error["X"] < 1e-10
    assert "not from the files" in str(card)


@pytest.mark.slow
def test_an_export_replaces_the_files_of_an_earlier_one_alone(campaign, tmp_path, refused):
    out = tmp_path / "deep" / "a"
    hd.export(PUBLISHED, campaign.vehicle, "c", out)
    mine = {out / "controller.c": "mine", out / ".git" / "HEAD": "mine", out / "new" / "x": "mine"}
    for path, text in mine.items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    refused(FileError, hd.export, PUBLISHED, campaign.vehicle, "c", out)
    hd.export(PUBLISHED, campaign.vehicle, "python", out, force=True)
    left = {path for path in out.rglob("*") if path.is_file()}
    assert left == {*mine, out / "auv_vt690.py", out / "fidelity.json", out / MANIFEST}
    assert all(path.read_text() == text for path, text in mine.items())
    listed = json.loads((out / "fidelity.json").read_text("utf-8"))["files"]
    digest = hashlib.sha256((out / "auv_vt690.py").read_bytes()).hexdigest()
    assert listed == {"auv_vt690.py": digest}
    assert [*out.parent.iterdir()] == [out]


@pytest.mark.slow
def test_files_that_somebody_edited_or_wrote_are_not_replaced(campaign, tmp_path, refused):
    out = tmp_path / "a"
    hd.export(PUBLISHED, campaign.vehicle, "c", out)
    edited = out / "examples" / "simulate.c"
    edited.write_text("my loop")
    refused(FileError, hd.export, PUBLISHED, campaign.vehicle, "c", out, force=True)
    edited.unlink()  # what is gone is no work lost
    (out / "fidelity.html").write_text("mine")
    refused(FileError, hd.export, PUBLISHED, campaign.vehicle, "c", out, force=True)
    (out / "fidelity.html").unlink()
    (out / "auv_vt690.py").write_text("mine")
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    refused(FileError, hd.export, PUBLISHED, campaign.vehicle, "python", out, force=True)
    assert before == {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_folders_without_a_list_of_files_are_left_alone(campaign, tmp_path, refused):
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "thesis.tex").write_text("mine")
    refused(
        FileError,
        lambda: hd.export(PUBLISHED, campaign.vehicle, "python", tmp_path / "b", force=True),
    )
    for listed in ({}, {"files": {"../thesis.tex": ["0"]}}, {"files": {"/etc/hosts": ["0"]}}):
        (tmp_path / "b" / "fidelity.json").write_text("{}")
        (tmp_path / "b" / MANIFEST).write_text(json.dumps(listed))
        refused(
            FileError,
            lambda: hd.export(PUBLISHED, campaign.vehicle, "python", tmp_path / "b", force=True),
        )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("target", "name"),
    [("python", "class"), ("casadi", "mpc"), ("c", "batch"), ("octave", "3 a"), ("fmu", "été */")],
)
def test_any_name_and_words_make_files_that_run(tmp_path, target, name):
    words = 'a "thesis" \\ of """1999""" */\nand more'
    vehicle = replace(hd.fleet["vt690"], name=name, source=words)
    damping = replace(PUBLISHED, vehicle=None)
    card = hd.export(damping, vehicle, target, tmp_path / "a")
    if card.not_run:
        assert "is not installed" in card.not_run or "compiler" in card.not_run
    assert max(card.wrench_error.values()) < 1e-9


def test_targets_are_found_by_name(refused):
    refused(MethodError, hd.find_target, "pyhton")


def test_terms_of_propulsion_need_to_know_it(campaign, tmp_path):
    damping = hd.Damping.from_dict(None, {"X_u": -1.0, "X_u^2(eta-1)": 2.0})
    still = replace(campaign.vehicle, actuators=())
    log = replace(campaign.test, wrench=np.zeros((campaign.test.n, 6)), propulsion_ratio=None)
    with pytest.warns(PropulsionWarning), pytest.raises(ProblemError, match="record `eta`"):
        hd.export(damping, still, "python", tmp_path / "a", log=log)


def test_an_axis_that_the_source_does_not_damp_counts():
    plant = ExportedPlant.of(hd.fleet["vt690"], hd.Damping.from_dict(None, {"X_u": -4.0}))
    velocity = np.random.default_rng(0).normal(size=(50, 6))
    down, none = np.tile([0.0, 0.0, 1.0], (50, 1)), np.zeros((50, len(plant.inputs)))
    at = States(velocity, down, none, np.zeros((50, 6)))
    other = np.zeros((50, 6))
    other[:, 1] = -2.0 * velocity[:, 1]
    found = wrench_errors(plant, at, plant.acceleration(at) + other @ plant.inverse)
    size = np.sqrt(np.mean(velocity**2, axis=0))
    assert set(found) == {"X", "Y"}
    assert found["X"] == pytest.approx(0.0, abs=1e-9)
    assert found["Y"] == pytest.approx(100.0 * 2.0 * size[1] / (4.0 * size[0]))


@pytest.mark.slow
def test_an_earlier_export_stays_where_a_new_file_cannot_take_its_place(tmp_path, monkeypatch):
    out, opened = tmp_path / "a", Path.open
    hd.export(PUBLISHED, hd.fleet["vt690"], "c", out)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}

    def fails(path, *arguments, **options):
        if path.name == "motion.c" and path.parent.name == "new":
            raise OSError(28, "No space left on device")
        return opened(path, *arguments, **options)

    monkeypatch.setattr(Path, "open", fails)
    with pytest.raises(FileError, match="No space left"):
        hd.export(PUBLISHED, hd.fleet["vt690"], "c", out, force=True)
    assert before == {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    with pytest.raises(FileError, match="No space left"):
        hd.export(PUBLISHED, hd.fleet["vt690"], "c", tmp_path / "b")
    assert [*tmp_path.iterdir()] == [out]


@pytest.mark.slow
@pytest.mark.parametrize("target", ["vrx", "uuv", "urdf", "marinegym", "gz-sim", "stonefish"])
def test_a_projection_drives_no_vehicle_at_rest(target, campaign):
    """Fitted at cruise alone, where linear and quadratic drag are hardly told apart."""
    plant, log = ExportedPlant.of(campaign.vehicle, PUBLISHED, campaign.test), campaign.test
    drive = VerificationRun.of(plant, log)
    assert drive.states.velocity[:, 0].min() > 1.0
    box = operating_box(drive.problem)
    held = hd.find_target(target).project_plant(replace(plant, box=box), drive.states).damping
    values = held.as_dict()
    for axis, name in zip("XYZKMN", "uvwpqr", strict=True):
        for term in (name, f"{name}|{name}|"):
            assert values.get(f"{axis}_{term}", 0.0) <= 0.0
    n = 600
    drift = hd.Log(
        0.1 * np.arange(n),
        np.tile([0.05, 0.0, 0.0, 0.0, 0.0, 0.0], (n, 1)),
        attitude=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)),
        commands=np.zeros((n, len(log.command_names))),
        command_names=log.command_names,
    )
    surge = hd.simulate(campaign.vehicle, held, drift, attitude="simulated").velocity[:, 0]
    assert surge.max() <= 0.05
    assert surge[-1] < 0.05


@pytest.mark.slow
def test_linear_couplings_of_a_projection_feed_no_slow_motion():
    """``|v|`` is lost in uuv; linear Y_r and N_v that take its place are bounded by the drag."""
    values = {"X_u": -1.0, "Y_v": -1e-3, "N_r": -1e-3, "Y_rV": 40.0, "N_vV": 40.0}
    plant = ExportedPlant.of(hd.fleet["bluerov2-heavy"], hd.Damping.from_dict(None, values))
    held = hd.find_target("uuv").project_plant(plant, sample_states(plant))
    found = held.damping.as_dict()
    assert found["Y_r"] + found["N_v"] > 0.0
    nu = 1e-3 * np.random.default_rng(0).normal(size=(500, 6)) * [1, 1, 0, 0, 0, 1]
    linear = hd.Damping.from_dict(
        None, {x: y for x, y in found.items() if len(x.split("_")[1]) == 1}
    )
    assert linear.power(nu).max() <= 1e-12 * np.abs(linear.power(nu)).max()


@pytest.mark.slow
def test_the_card_looks_at_low_speeds(campaign, tmp_path):
    card = hd.export(PUBLISHED, campaign.vehicle, Linear(), tmp_path / "a", log=campaign.test)
    assert card.slow_error["X"] > 2.0 * card.wrench_error["X"]  # linear drag is no quadratic one
    assert "at a tenth of these velocities: X " in str(card)
    assert card.box.startswith("u 1.64 to ")  # that of the log, as in the report
    exact = hd.export(PUBLISHED, campaign.vehicle, "python", tmp_path / "b", log=campaign.test)
    assert "at a tenth" not in str(exact)


@pytest.mark.slow
def test_an_export_that_is_worse_than_no_damping_is_refused_unless_forced(
    campaign, tmp_path, refused
):
    doubled = Linear(factor=3.0)
    refused(
        MethodError,
        lambda: hd.export(PUBLISHED, campaign.vehicle, doubled, tmp_path / "a", log=campaign.test),
    )
    assert not [*tmp_path.iterdir()]
    card = hd.export(
        PUBLISHED, campaign.vehicle, doubled, tmp_path / "a", log=campaign.test, force=True
    )
    assert card.wrench_error["X"] > 100.0
    none = Linear(factor=0.0)
    card = hd.export(
        PUBLISHED, campaign.vehicle, none, tmp_path / "b", log=campaign.test, force=True
    )
    assert card.wrench_error["X"] == pytest.approx(100.0)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["fossen", "prestero"])
def test_axes_whose_terms_are_held_are_not_refused_for_the_mass_matrix(
    model, campaign, tmp_path, refused
):
    """A diagonal mass matrix is no fault of the model, and no other model would mend it."""
    damping = hd.identify(
        hd.catalog[model], campaign.vehicle, campaign.train, hd.LeastSquares()
    ).damping
    card = hd.export(damping, campaign.vehicle, "urdf", tmp_path / "a", log=campaign.test)
    assert card.exact == (model == "fossen")
    assert not [label for label in card.projected if label.startswith("K")]
    assert card.wrench_error["K"] > 100.0
    assert "coupled added mass" in str(card)
    refused(
        MethodError,
        lambda: hd.export(
            damping, campaign.vehicle, "stonefish", tmp_path / "b", log=campaign.test
        ),
    )


@pytest.mark.slow
def test_a_link_that_leads_nowhere_is_no_file_of_the_export(tmp_path, refused):
    plant = hd.fleet["bluerov2"], hd.published["bluerov2"]
    hd.export(plant[1], plant[0], "python", tmp_path / "a")
    link = tmp_path / "a" / "README.md"
    link.symlink_to("nowhere")
    refused(FileError, lambda: hd.export(plant[1], plant[0], "c", tmp_path / "a", force=True))
    assert link.is_symlink()


@pytest.mark.slow
def test_a_file_in_the_place_of_a_folder_is_named(tmp_path, refused):
    plant = hd.fleet["bluerov2"], hd.published["bluerov2"]
    hd.export(plant[1], plant[0], "python", tmp_path / "a")
    (tmp_path / "a" / "examples").write_text("mine")
    refused(FileError, lambda: hd.export(plant[1], plant[0], "c", tmp_path / "a", force=True))
    assert (tmp_path / "a" / "examples").read_text() == "mine"


@pytest.mark.slow
@pytest.mark.parametrize("target", ["python", "c", "octave", "casadi", "jax", "fmu", "mujoco"])
@pytest.mark.parametrize("name", ["hd", "*/ x; /*", "sqrt", "norm", "cos", "INPUTS"])
def test_names_of_built_ins_and_of_the_files_themselves_run(target, name, tmp_path):
    vehicle = replace(hd.fleet["bluerov2"], name=name)
    card = hd.export(hd.published["bluerov2"], vehicle, target, tmp_path / "a")
    assert not card.run_error
    assert "failed: " not in str(card)
    assert max(card.wrench_error.values()) < 1e-6


@pytest.mark.slow
def test_what_does_not_compile_is_said_on_the_card(tmp_path, monkeypatch):
    header = c99.render_header
    monkeypatch.setattr(c99, "render_header", lambda plant: header(plant) + "\nint;")
    card = hd.export(PUBLISHED, hd.fleet["vt690"], "c", tmp_path / "a")
    assert "error" in card.run_error
    assert "Verdict: failed: " in str(card)


@pytest.mark.parametrize("name", hd.published)
def test_a_published_set_goes_onto_its_own_vehicle_alone(name, tmp_path):
    damping = hd.published[name]
    for vehicle in hd.fleet.values():
        stamp = damping.vehicle
        own = (stamp.weight, stamp.buoyancy) == (vehicle.weight, vehicle.buoyancy)
        if own:
            assert stamp.name == vehicle.name
            ExportedPlant.of(vehicle, damping)
        else:
            with pytest.raises(ModelError, match="belong to vehicle"):
                ExportedPlant.of(vehicle, damping)


def test_the_text_of_a_card(snapshot):
    scores = [
        hd.Score(rms, {}, {}, "deg", () if rms else (("a", 3.0),)) for rms in (0.02, None, 0.5)
    ]
    card = Fidelity(
        target="linear",
        description="A program 1.0",
        settings={},
        vehicle="boat",
        model="Fossen",
        inputs=("rpm", "wrench"),
        projected=("X_u|u|", "N_vr"),
        about=[0.1, 0.0, -0.02],
        ignores="the actuators",
        run_by="NumPy",
        not_run="it is not installed",
        run_error="cc reports: no header",
        wrench_error={"X": 12.3, "N": 0.4},
        slow_error={"X": 45.6},
        asked_at="the log's samples",
        replays=Replays(*scores, "Runge-Kutta, at most 0.05 s"),
        power={"source": -1.0, "target": 2.5},
        box="u 0 to 2 m/s",
        mass_ratio={"X": 0.1, "Y": 1.2},
    )
    exact = replace(card, projected=(), run_by="", wrench_error={"X": 1e-13}, replays=None)
    assert f"{card}\n\n{exact}" == snapshot
