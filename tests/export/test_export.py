"""The verb and the card: whole or not at all, exact or said what was lost."""

import hashlib
import json
from dataclasses import dataclass, replace
from itertools import product
from typing import ClassVar

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import FileError, MethodError, ModelError, ProblemError, PropulsionWarning
from hydrodamp.export.fidelity import Fidelity, Replays, wrench_errors
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.scripts import Python
from hydrodamp.export.target import NotRun
from hydrodamp.export.verification import VerificationRun, sample_states
from hydrodamp.identification.dissipativity import operating_box
from hydrodamp.results import MANIFEST

from .conftest import PUBLISHED, level_log


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


def record_wrench(campaign):
    """Return the test log with a wrench in the place of its commands."""
    log, bare = campaign.exact_test, replace(campaign.vehicle, weight=0.0, buoyancy=0.0)
    named = {name: log.command(name) for name in log.command_names}
    wrench = bare.known_wrench(log.velocity, log.down, named)
    return replace(log, wrench=wrench, commands=np.empty((log.n, 0)), command_names=())


LOGS = {"none": lambda _: None, "commands": lambda it: it.test, "wrench": record_wrench}


@pytest.mark.slow
@pytest.mark.parametrize("kind", LOGS)
def test_an_exact_export_is_the_same_but_for_rounding(kind, campaign, export, tmp_path):
    card = export(log=LOGS[kind](campaign))
    assert card.exact
    assert max(card.wrench_error.values()) < 1e-10
    assert "rounding" in str(card)
    assert "at a tenth" not in str(card)
    assert card.power["source"] == card.power["target"]
    assert (card.inputs == ("wrench",)) == (kind == "wrench")
    assert (card.replays is None) == (kind == "none")
    if kind != "none":
        assert card.replays.source_to_target.rms < 1e-12
        assert card.replays.source_to_log.rms == pytest.approx(card.replays.target_to_log.rms)
    written = json.loads((tmp_path / "a" / "fidelity.json").read_text("utf-8"))
    assert (written["target"], written["exact"]) == ("python", True)


@pytest.mark.slow
def test_terms_a_target_cannot_hold_are_fitted_where_the_log_sailed(campaign, export, refused):
    card = export(Linear(), log=campaign.test)
    assert not card.exact
    assert "X_u|u|" in card.projected
    assert 0.1 < card.wrench_error["X"] < 50.0
    assert card.slow_error["X"] > 2.0 * card.wrench_error["X"]  # linear drag is no quadratic one
    assert card.replays.source_to_target.rms > 0.01
    assert "Projected terms: " in str(card)
    assert "at a tenth of these velocities: X " in str(card)
    assert card.box.startswith("u 1.64 to ")  # that of the log, as in the report
    refused(MethodError, export, Linear(), name="b")
    plant = ExportedPlant.of(campaign.vehicle, PUBLISHED)
    box = operating_box(VerificationRun.of(plant, campaign.test).problem)
    assert export(Linear(), name="b", box=box).projected == card.projected


@pytest.mark.slow
@pytest.mark.parametrize("factor", [-5.0, 3.0])
def test_a_projection_worse_than_no_damping_is_refused_unless_forced(
    factor, campaign, export, tmp_path, refused
):
    """Negative damping diverges as well."""
    form = Linear(factor=factor)
    refused(MethodError, export, form, log=campaign.test)
    assert not [*tmp_path.iterdir()]
    card = export(form, log=campaign.test, force=True)
    assert card.wrench_error["X"] > 100.0
    assert bool(card.replays.target_to_log.diverged) == (factor < 0.0)
    assert ("diverged after" in str(card)) == (factor < 0.0)


@pytest.mark.slow
def test_the_error_of_no_damping_is_100_percent(campaign, export):
    card = export(Linear(factor=0.0), log=campaign.test, force=True)
    assert card.wrench_error["X"] == pytest.approx(100.0)


@pytest.mark.slow
def test_what_could_not_be_run_is_said(campaign, export):
    class Elsewhere(Python):
        def open_engine(self, folder, plant):
            raise NotRun("its simulator is not installed")

    card = export(Elsewhere(), log=campaign.test)
    assert "Not run: its simulator is not installed." in str(card)
    assert card.replays is None
    assert card.wrench_error["X"] < 1e-10
    assert "not from the files" in str(card)


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_an_export_replaces_the_files_of_an_earlier_one_alone(export, tmp_path, refused):
    out = tmp_path / "deep" / "a"
    export("c", name="deep/a")
    mine = {out / "controller.c", out / ".git" / "HEAD", out / "new" / "x"}
    for path in mine:
        path.parent.mkdir(exist_ok=True)
        path.write_text("mine")
    refused(FileError, export, "c", name="deep/a")
    (out / "examples" / "simulate.c").unlink()  # what is gone is no work lost
    export(name="deep/a", force=True)
    left = contents(out)
    assert {*left} == {*mine, out / "auv_vt690.py", out / "fidelity.json", out / MANIFEST}
    assert {left[path] for path in mine} == {b"mine"}
    listed = json.loads(left[out / "fidelity.json"])["files"]
    assert listed == {"auv_vt690.py": hashlib.sha256(left[out / "auv_vt690.py"]).hexdigest()}
    assert [*out.parent.iterdir()] == [out]


def link_nowhere(path):
    path.symlink_to("nowhere")


def write_own(path):
    path.write_text("mine")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("obstruct", "name"),
    [
        (write_own, "auv_vt690.py"),
        (write_own, "fidelity.html"),
        (write_own, "motion.c"),
        (write_own, "examples"),  # to be a folder
        (link_nowhere, "README.md"),
    ],
)
def test_what_hydrodamp_did_not_write_is_not_replaced(obstruct, name, export, tmp_path, refused):
    export()
    obstruct(tmp_path / "a" / name)
    before = contents(tmp_path)
    refused(FileError, export, "c", force=True)
    assert before == contents(tmp_path)
    assert (tmp_path / "a" / name).is_symlink() == (obstruct is link_nowhere)


def test_a_folder_of_other_files_is_no_export(export, tmp_path, refused):
    write_own(tmp_path / "thesis.tex")
    refused(FileError, export, name="", force=True)


NAMES = "hd", "*/ x; /*", "sqrt", "norm", "cos", "INPUTS"
RUN = "python", "c", "octave", "casadi", "jax", "fmu", "mujoco"
OTHERS = (
    ("python", "class"),
    ("casadi", "mpc"),
    ("c", "batch"),
    ("octave", "3 a"),
    ("fmu", "été */"),
)


@pytest.mark.slow
@pytest.mark.parametrize(("target", "name"), [*product(RUN, NAMES), *OTHERS])
def test_any_name_and_words_make_files_that_run(target, name, tmp_path):
    """Names of built-ins, of the files themselves, and of what ends a comment."""
    words = 'a "thesis" \\ of """1999""" */\nand more'
    vehicle = replace(hd.fleet["bluerov2"], name=name, source=words)
    card = hd.export(hd.published["bluerov2"], vehicle, target, tmp_path / "a")
    assert not card.run_error
    assert "failed: " not in str(card)
    assert max(card.wrench_error.values()) < (1e-6 if target == "mujoco" else 1e-9)


def test_targets_are_found_by_name(refused):
    refused(MethodError, hd.find_target, "pyhton")


def test_terms_of_propulsion_need_to_know_it(campaign, export):
    damping = hd.Damping.from_dict(None, {"X_u": -1.0, "X_u^2(eta-1)": 2.0})
    still = replace(campaign.vehicle, actuators=())
    log = replace(campaign.test, wrench=np.zeros((campaign.test.n, 6)), propulsion_ratio=None)
    with pytest.warns(PropulsionWarning), pytest.raises(ProblemError, match="record `eta`"):
        export(damping=damping, vehicle=still, log=log)


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
    n, names = 600, log.command_names
    still = {"commands": np.zeros((n, len(names))), "command_names": names}
    drift = level_log(0.1 * np.arange(n), 0.05 * np.eye(1, 6).repeat(n, axis=0), **still)
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
@pytest.mark.parametrize("model", ["fossen", "prestero"])
def test_axes_whose_terms_are_held_are_not_refused_for_the_mass_matrix(
    model, campaign, fit_model, export, refused
):
    """A diagonal mass matrix is no fault of the model, and no other model would mend it."""
    damping = fit_model(hd.catalog[model]).damping
    card = export("urdf", damping, log=campaign.test)
    assert card.exact == (model == "fossen")
    assert not [label for label in card.projected if label.startswith("K")]
    assert card.wrench_error["K"] > 100.0
    assert "coupled added mass" in str(card)
    refused(MethodError, export, "stonefish", damping, "b", log=campaign.test)


@pytest.mark.parametrize("name", hd.published)
def test_a_published_set_goes_onto_its_own_vehicle_alone(name):
    damping = hd.published[name]
    for vehicle in hd.fleet.values():
        stamp = damping.vehicle
        if (stamp.weight, stamp.buoyancy) == (vehicle.weight, vehicle.buoyancy):
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
