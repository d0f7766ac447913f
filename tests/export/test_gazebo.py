"""SDF for gz-sim and VRX: its plugins' formulas from the file, DART as its physics."""

from dataclasses import replace
from importlib.util import find_spec
from xml.etree import ElementTree

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError, ModelError, VehicleError
from hydrodamp.export.gazebo import VRX, GzSim
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.export.verification import VerificationRun
from hydrodamp.kernels.core import coriolis

from .conftest import MODELS, PAPER, coefficients, core, level_log, read_back, states, write_export

EXACT = ["linear", "mcfarland-whitcomb", "coe", "prestero", "fossen"]
TURN = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])

dart = pytest.mark.skipif(not find_spec("dartpy"), reason="dartpy is not installed")


def crafts():
    for key in EXACT:
        for name in ("vt690", "bluerov2-heavy"):
            damping = coefficients(hd.catalog[key])
            plant = ExportedPlant.of(finless(hd.fleet[name]), damping)
            yield pytest.param(plant, id=f"{key}-{name}")


def finless(vehicle):
    """Each fin as a matrix: the lift of LiftDrag depends on the flow at the fin."""
    rows = {x: hd.Matrix(x.commands, ((0.0, 2.0, 1.0, 0.0, 3.0, 0.0),)) for x in vehicle.actuators}
    kept = (rows[x] if isinstance(x, hd.Fin) else x for x in vehicle.actuators)
    return replace(vehicle, actuators=tuple(kept))


def numbers(folder):
    root = ElementTree.parse(folder / "model.sdf").getroot()
    words = "link_name", "disable_coriolis"
    return {each.tag: float(each.text) for each in root.find(".//plugin") if each.tag not in words}


@pytest.mark.parametrize("plant", [*crafts()])
def test_the_system_of_gz_sim_makes_the_wrench_of_the_model(plant, tmp_path):
    found = numbers(write_export(GzSim(), plant, tmp_path))
    velocity = np.random.default_rng(1).normal(size=(9, 6))
    there = dict(zip("UVWPQR", (velocity * TURN).T, strict=True))
    force = np.zeros((9, 6))
    for tag, value in found.items():  # as Hydrodynamics.cc sums them
        first, last = there[tag[1]], there[tag[-1]]
        factor = np.abs(last) if "abs" in tag else last
        force[:, "xyzkmn".index(tag[0])] += value * (first if len(tag) == 2 else first * factor)
    wanted = plant.damping.wrench(velocity)
    np.testing.assert_allclose(force * TURN, wanted, rtol=1e-10, atol=1e-10)


def test_the_plugin_of_vrx_makes_the_wrench_of_the_model(tmp_path):
    plant = ExportedPlant.of(hd.fleet["remus100"], coefficients(hd.catalog["fossen"]))
    found = numbers(write_export(VRX(), plant, tmp_path))
    # As SimpleHydrodynamics.cc: what is not said is not zero, positive numbers drag.
    defaults = {f"{a}{n}": 20.0 for a, n in zip("xyzkmn", "UVWPQR", strict=True)}
    defaults |= {f"{a}Dot{n}": 5.0 for a, n in zip("xyzkmn", "UVWPQR", strict=True)}
    found = defaults | found
    velocity = np.random.default_rng(1).normal(size=(9, 6))
    force = np.zeros((9, 6))
    for i, (axis, name) in enumerate(zip("xyzkmn", "UVWPQR", strict=True)):
        there = velocity[:, i] * TURN[i]
        drag = found[f"{axis}{name}"] + found[f"{axis}{name}{name}"] * np.abs(there)
        force[:, i] = -drag * there * TURN[i]
        assert found[f"{axis}Dot{name}"] == 0.0
    np.testing.assert_allclose(force, plant.damping.wrench(velocity), rtol=1e-10, atol=1e-10)


def test_link_and_world_move_and_restore_as_the_vehicle(tmp_path):
    vehicle = replace(
        finless(hd.fleet["remus100"]),
        center_of_gravity=np.array([0.03, 0.01, 0.02]),
        center_of_buoyancy=np.array([0.01, -0.02, -0.01]),
    )
    plant = ExportedPlant.of(vehicle, coefficients(hd.catalog["fossen"]))
    write_export(GzSim(density=1025.0), plant, tmp_path)
    root = ElementTree.parse(tmp_path / "world.sdf").getroot()
    inertial, gravity = root.find(".//inertial"), -float(root.findtext(".//gravity").split()[2])
    mass, center = float(inertial.findtext("mass")), place(inertial)
    arm = np.cross(np.eye(3), center)
    inertia, added = np.zeros((3, 3)), np.zeros((6, 6))
    for i, a in enumerate("xyzpqr"):
        for j, b in list(enumerate("xyzpqr"))[i:]:
            added[i, j] = added[j, i] = float(inertial.findtext(f"fluid_added_mass/{a}{b}"))
            if j < 3:
                inertia[i, j] = inertia[j, i] = float(inertial.findtext(f"inertia/i{a}{b}"))
    total = added + np.block(
        [[mass * np.eye(3), mass * arm.T], [mass * arm, inertia + mass * arm @ arm.T]]
    )
    there = np.random.default_rng(0).normal(size=(9, 6))
    np.testing.assert_allclose(
        coriolis(total, there) * TURN, coriolis(vehicle.mass_matrix, there * TURN), atol=1e-9
    )
    energy = np.einsum("ni,ij,nj->n", there, total, there)
    wanted = np.einsum("ni,ij,nj->n", there * TURN, vehicle.mass_matrix, there * TURN)
    np.testing.assert_allclose(energy, wanted, rtol=1e-12)
    collision = root.find(".//collision")
    volume = float(collision.findtext(".//size").split()[0]) ** 3
    lift = volume * gravity * float(root.findtext(".//uniform_fluid_density"))
    up = np.random.default_rng(2).normal(size=3)
    up /= np.linalg.norm(up)
    force = (lift - mass * gravity) * up
    moment = np.cross(place(collision), lift * up) - np.cross(center, mass * gravity * up)
    wanted = vehicle.restoring_wrench([-up * TURN[:3]])[0]
    np.testing.assert_allclose(np.concatenate([force, moment]) * TURN, wanted, atol=1e-9)


def place(element):
    return np.array([float(part) for part in element.findtext("pose").split()[:3]])


@dart
@pytest.mark.parametrize("plant", [*crafts()])
def test_dart_moves_what_is_read_back_as_the_core(plant, tmp_path):
    at = states(plant, 12)
    found = read_back(GzSim(), plant, at, tmp_path)
    wanted = core(plant, at)
    np.testing.assert_allclose(found, wanted, rtol=1e-10, atol=1e-10 * np.abs(wanted).max())


@dart
@pytest.mark.parametrize(("key", "model"), [("gz-sim", "prestero"), ("vrx", "fossen")])
def test_dart_sails_as_the_core_but_for_its_step(key, model, campaign, fit_model, export):
    damping, craft = fit_model(hd.catalog[model]).damping, finless(campaign.vehicle)
    card = export(key, damping, vehicle=craft, log=campaign.test.between(0.0, 5.0))
    assert card.exact
    assert max(card.wrench_error[axis] for axis in "XYZN") < 1e-8
    assert card.replays.source_to_target.rms < 0.01
    assert "DART" in card.run_by


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.key)
def test_what_gz_sim_has_not_is_fitted(model, campaign, fit_model, export):
    damping, craft = fit_model(model).damping, finless(campaign.vehicle)
    log = campaign.test.between(0.0, 2.0)
    card = export(GzSim(step=0.02), damping, vehicle=craft, log=log, force=True)
    assert card.exact == (model.key in EXACT)
    assert max(card.wrench_error[axis] for axis in "XYZN") < (1e-8 if card.exact else 90.0)


@dart
def test_half_the_step_of_dart_halves_its_error(tmp_path):
    damping = hd.Damping.from_dict(None, {"X_u|u|": -20.0, "Y_v": -60.0, "N_r|r|": -8.0})
    plant = ExportedPlant.of(hd.fleet["bluerov2-heavy"], damping)
    n = 41
    waves = np.sin(np.outer(0.1 * np.arange(n), [0.5, 0.7, 0.9, 1.1, 1.3, 1.7]) + np.arange(6))
    push = waves * [20.0, 20.0, 20.0, 1.0, 1.0, 4.0]
    drive = VerificationRun.of(plant, level_log(0.1 * np.arange(n), wrench=push))
    exact, found = drive.simulate_source().velocity, []
    for step in (0.004, 0.002, 0.001):
        folder = write_export(GzSim(step=step), plant, tmp_path)
        with GzSim(step=step).open_engine(folder, plant) as engine:
            velocity = drive.simulate_target(engine).velocity
        found.append(np.sqrt(np.mean((velocity - exact) ** 2)))
    np.testing.assert_allclose(np.array(found[:-1]) / found[1:], 2.0, rtol=0.02)


def test_the_legacy_path(planar, tmp_path, refused):
    legacy, damping = GzSim(legacy=True), coefficients(hd.catalog["fossen"])
    light = replace(hd.fleet["bluerov2-heavy"], added_mass=np.diag([5.0, 6, 7, 0.1, 0.1, 0.2]))
    whole = replace(light, added_mass=None)
    for numbers_of, vehicle in ((PAPER.damping, PAPER.vehicle), (damping, whole)):
        refused(MethodError, hd.export, numbers_of, vehicle, legacy, tmp_path / "a")
    card = hd.export(damping, light, legacy, tmp_path / "a")
    assert ElementTree.parse(tmp_path / "a" / "model.sdf").findtext(".//disable_coriolis") == "true"
    assert "fluid_added_mass" not in (tmp_path / "a" / "model.sdf").read_text()
    assert numbers(tmp_path / "a")["xDotU"] < 0.0
    assert card.not_run
    folder = write_export(VRX(legacy=True), ExportedPlant.of(light, damping), tmp_path)
    assert numbers(folder)["xDotU"] > 0.0


@dart
@pytest.mark.parametrize("model", ["linear", "uncoupled"])
def test_an_actuator_of_unknown_gain_drives_it_from_outside(model, tmp_path):
    rov, n = hd.fleet["bluerov2-heavy"], 40
    values = {"X_u": -20.0, "Y_v": -30.0, "N_r": -4.0, "X_ahead": 35.0, "N_turn*|turn|": 1.0}
    values |= {"Z_w": -30.0, "K_p": -4.0, "M_q": -4.0}
    extra = {"linear": {}, "uncoupled": {"Y_|v|": -0.5}}[model]
    damping = hd.Damping.from_dict(None, values | extra)
    held = np.random.default_rng(0).uniform(-1.0, 1.0, (n // 10, 2))
    named = {"commands": np.repeat(held, 10, axis=0), "command_names": ("ahead", "turn")}
    log = level_log(0.1 * np.arange(n), **named)
    moved = replace(log, velocity=hd.simulate(rov, damping, log).velocity)
    for key in ("gz-sim", "urdf"):
        card = hd.export(damping, rov, key, tmp_path / key, log=moved)
        assert card.projected == tuple(extra)
        assert card.replays.source_to_target.rms < 0.05
    assert "ahead" not in (tmp_path / "gz-sim" / "model.sdf").read_text()
    exact = hd.export(damping, rov, "python", tmp_path / "python", log=moved)
    assert exact.replays.source_to_target.rms < 1e-12


def test_gz_sims_own_forces_of_the_moving_frame_have_the_other_sign():
    """Why `legacy` disables them: the entries of buildCoriolisMatrix, as its system adds them."""
    nu, derivatives = np.random.default_rng(0).normal(size=6), -np.arange(1.0, 7.0)
    matrix = np.zeros((6, 6))
    for place, sign, of in (
        *(((0, 4), -1, 2), ((0, 5), 1, 1), ((1, 3), 1, 2), ((1, 5), -1, 0), ((2, 3), -1, 1)),
        *(((2, 4), 1, 0), ((3, 1), -1, 2), ((3, 2), 1, 1), ((3, 4), -1, 5), ((3, 5), 1, 4)),
        *(((4, 0), 1, 2), ((4, 2), -1, 0), ((4, 3), 1, 5), ((4, 5), -1, 3), ((5, 0), -1, 1)),
        *(((5, 1), 1, 0), ((5, 3), -1, 4), ((5, 4), 1, 3)),
    ):
        matrix[place] = sign * derivatives[of] * nu[of]
    total = -matrix @ nu  # kCmatVec of Hydrodynamics.cc
    wanted = coriolis(np.diag(-derivatives), nu[None])[0]  # what moves the body
    np.testing.assert_allclose(-total, -wanted, rtol=1e-12, atol=1e-12)


def test_what_is_no_body_in_water_is_refused(planar, tmp_path, refused):
    (boat, damping, _), out = planar, tmp_path / "a"
    refused(VehicleError, hd.export, damping, replace(boat, axes=("Y", "N")), "gz-sim", out)
    weightless = replace(hd.fleet["vt690"], weight=0.0)
    refused(VehicleError, hd.export, coefficients(hd.catalog["fossen"]), weightless, "vrx", out)
    steered = hd.Damping.from_dict(None, {"X_u": -1.0, "Y_u|u|*fin": 3.0, "Z_wdown_z": 1.0})
    refused(ModelError, hd.export, steered, hd.fleet["bluerov2"], "gz-sim", out)
    refused(MethodError, GzSim, density=0.0)
    assert not [*tmp_path.iterdir()]


def test_what_the_velocities_do_not_tell_apart_does_not_run_away():
    damping = hd.Damping.from_dict(None, {"X_|u|": -10.0, "Y_v": -1.0})
    plant = ExportedPlant.of(hd.fleet["vt690"], damping)
    at = states(plant)._replace(velocity=2.0 + 0.01 * states(plant).velocity)
    held = GzSim().project_plant(plant, at)
    assert held.damping.model.labels == ("X_u", "X_u|u|", "Y_v")
    forward = np.array([[2.0, 0, 0, 0, 0, 0], [1.0, 0, 0, 0, 0, 0]])
    there, slower = held.damping.wrench(forward)[:, 0]
    assert there == pytest.approx(-20.0, rel=0.02)
    assert -10.0 < slower < -5.0


def test_an_axis_is_fitted_by_itself():
    values = {"X_u": -3.0, "X_u|u|": -4.0, "M_q": -9.0, "M_|q|": 2.0, "M_wV": -5.0}
    plant = ExportedPlant.of(hd.fleet["vt690"], hd.Damping.from_dict(None, values))
    held = GzSim().project_plant(plant, states(plant))
    assert held.damping["X_u"] == pytest.approx(-3.0, rel=1e-12)
    assert held.damping["X_u|u|"] == pytest.approx(-4.0, rel=1e-12)


DRIVEN = replace(
    hd.fleet["bluerov2"],
    actuators=(
        hd.Thruster("port", (0.1, -0.2, 0.05), (1.0, 1.0, 0.0), gain=40.0, limit=0.8),
        hd.Thruster("pwm", (-0.1, 0.2, 0.0), (1, 0, 0), curve=((1100, -30), (1500, 0), (1900, 40))),
        hd.Propeller("rpm", 3e-6, advance=-1e-4, torque=-1e-7, limit=2000.0),
        hd.Fin("rudder", {"Y": 9.0, "N": -5.0}, {"X": -4.0}, limit=0.3),
        hd.Fin("flap", {"Y": 9.0, "K": 1.0, "M": 2.0}),
        hd.Matrix(("jet",), ((0.0, 0.0, 1.0, 0.0, 0.2, 0.0),)),
    ),
)

CURVED = "port", "rudder", "jet", "turn"


@dart
@pytest.mark.parametrize(
    "curves", [(), tuple(hd.Curve(name, 1.0, 0.8, 1.5, 0.1) for name in CURVED)]
)
def test_thrusters_propellers_and_fins_are_joints_with_a_system(tmp_path, curves):
    """Their numbers give the wrench of the vehicle: that of a fin where the flow is along x."""
    damping = hd.Damping.from_dict(None, {"X_u": -5.0, "Y_v|v|": -40.0, "N_turn": 2.0})
    vehicle = replace(DRIVEN, actuators=(*DRIVEN.actuators, *curves))
    plant = ExportedPlant.of(vehicle, damping)
    at, n = states(plant, 12), 12
    speed = at.velocity[:, :1] * [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    given = np.random.default_rng(3).uniform(-1.2, 1.2, (n, len(plant.inputs)))
    given = given * [1.0, 0.0, 2000.0, 1.0, 1.0, 1.0, 1.0] + [0.0, 1600.0, 0, 0, 0, 0, 0]
    at = at._replace(velocity=speed, inputs=given)
    found = read_back(GzSim(density=1025.0), plant, at, tmp_path)
    wanted = core(plant, at)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())
    model = ElementTree.parse(tmp_path / "model.sdf").getroot()[0]
    joints = [joint.get("name") for joint in model.iter("joint")]
    assert joints == ["port_1", "pwm_2", "rpm_3", "rudder_4"]  # no force at a point is the flap's
    masses = [float(each.text) for each in model.iter("mass")]
    np.testing.assert_allclose(sum(masses), DRIVEN.weight / 9.80665, rtol=1e-12)
    limits = {each.tag: float(each.text) for each in model.find("plugin[joint_name='pwm_2']")[-2:]}
    assert limits == {"max_thrust_cmd": 40.0, "min_thrust_cmd": -30.0}
    assert model.findtext("plugin[joint_name='rpm_3']/use_angvel_cmd") == "true"
    ignores = GzSim().omissions_of(plant)
    assert ignores.startswith("forces of rpm, rudder, flap, jet, turn that no system")
    assert GzSim().omissions_of(replace(plant, vehicle=hd.fleet["bluerov2"])).count("turn") == 1


@dart
def test_fins_lift_as_the_flow_at_them(campaign, export):
    card = export(GzSim(step=0.02), log=campaign.test.between(0.0, 2.0))
    assert 1e-6 < card.wrench_error["Y"] < 1.0
    assert card.ignores == "forces of rudder, elevator that no system of gz-sim has (apply them)"
