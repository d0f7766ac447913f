"""MJCF and its passive force: MuJoCo's accelerations are the core's."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError, VehicleError
from hydrodamp.export.plant import FLU, ExportedPlant, States
from hydrodamp.export.scripts import MuJoCo, execute_module
from hydrodamp.identification.predicted_error import predict_error

from .conftest import PUBLISHED, core, write_export


@pytest.mark.slow
def test_it_sails_as_the_core_but_for_its_step(campaign, export):
    pytest.importorskip("mujoco")
    card = export("mujoco", log=campaign.test.between(0.0, 5.0))
    assert card.exact
    assert card.replays.source_to_target.rms < 1e-4
    assert "MuJoCo" in card.run_by


def test_what_is_applied_at_the_center_of_mass_moves_it_and_other_models_are_left_alone(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    plant = ExportedPlant.of(hd.fleet["vt690"], PUBLISHED)
    write_export(MuJoCo(), plant, tmp_path)
    ball = "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
    other = mujoco.MjModel.from_xml_string(ball)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "auv_vt690.xml"))
    data, water = mujoco.MjData(model), execute_module(tmp_path / "auv_vt690.py")
    water.in_water(model)
    model.opt.timestep = 1e-3
    data.xfrc_applied[1] = [3.0, -2.0, 1.0, 0.1, 0.2, -0.3]  # attitude_quaternions, at rest: z up
    mujoco.mj_forward(model, data)
    turn = np.array([1.0, -1.0, -1.0])
    force, moment = turn * [3.0, -2.0, 1.0], turn * [0.1, 0.2, -0.3]
    about = np.concatenate([force, moment + np.cross(plant.vehicle.center_of_gravity, force)])
    wanted = np.linalg.solve(plant.vehicle.mass_matrix, about)
    np.testing.assert_allclose(data.qacc * np.tile(turn, 2), wanted, rtol=1e-9, atol=1e-12)
    falling = mujoco.MjData(other)
    mujoco.mj_forward(other, falling)
    mujoco.set_mjcb_passive(None)
    np.testing.assert_allclose(falling.qacc, [0, 0, -9.81, 0, 0, 0], atol=1e-9)


@pytest.mark.slow
def test_two_vehicles_in_one_model_are_both_in_water(tmp_path):
    """Each moves as it does alone, and a callback of the user's goes on."""
    mujoco = pytest.importorskip("mujoco")
    crafts = {
        name: ExportedPlant.of(hd.fleet[name], hd.published[published])
        for name, published in (("vt690", "vt690-sname2022"), ("bluerov2", "bluerov2"))
    }
    whole, alone, called = mujoco.MjSpec(), {}, []
    whole.option.gravity, whole.option.timestep = [0.0, 0.0, -9.80665], 0.01
    whole.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    for plant in crafts.values():
        write_export(MuJoCo(), plant, tmp_path)
    for place, name in enumerate(crafts):
        own = mujoco.MjSpec.from_file(str(tmp_path / f"auv_{name}.xml"))
        frame = whole.worldbody.add_frame(pos=[0.0, 9.0 * place, 0.0])
        frame.attach_body(own.body(f"auv_{name}"), f"{place}_", "")

    def run(model, bodies):
        data = mujoco.MjData(model)
        for name, body in bodies.items():
            _, push = execute_module(tmp_path / f"auv_{name}.py").in_water(model, body)
            push[:] = [20.0, 1.0, 2.0, 0.1, 0.2, 0.3]
            if name == "vt690":
                data.actuator(body.removesuffix("auv_vt690") + "rpm").ctrl = 1500.0
        for _ in range(100):
            mujoco.mj_step(model, data)
        joints = {name: model.body(body).jntadr[0] for name, body in bodies.items()}
        return {name: data.joint(joint).qvel.copy() for name, joint in joints.items()}

    try:
        for name in crafts:
            model = mujoco.MjModel.from_xml_path(str(tmp_path / f"auv_{name}.xml"))
            alone |= run(model, {name: f"auv_{name}"})
            mujoco.set_mjcb_passive(None)
        model = whole.compile()
        mujoco.set_mjcb_passive(lambda *_: called.append(1))
        together = run(model, {name: f"{place}_auv_{name}" for place, name in enumerate(crafts)})
    finally:
        mujoco.set_mjcb_passive(None)
    assert called
    for name, velocity in alone.items():
        assert np.linalg.norm(velocity) > 0.1
        np.testing.assert_allclose(together[name], velocity, rtol=1e-9, atol=1e-12)


def test_commands_are_actuators_whose_force_acts_on_added_mass(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    pwm = hd.Thruster("pwm", (-0.1, 0.2, 0), (0, 0, 1), curve=((1100, -30), (1500, 0), (1900, 40)))
    thrusters = hd.Thruster("port", (0.1, -0.2, 0.05), (3.0, 4.0, 0.0), gain=40, limit=1.0), pwm
    vehicle = replace(hd.fleet["bluerov2"], actuators=thrusters)
    damping = hd.Damping.from_dict(None, {"X_u": -5.0, "N_turn": 2.0, "X_turn*|turn|": 1.0})
    plant = ExportedPlant.of(vehicle, damping)
    write_export(MuJoCo(), plant, tmp_path)
    whole = mujoco.MjSpec.from_file(str(tmp_path / "auv_bluerov2.xml"))
    whole.body("auv_bluerov2").add_site(name="own")
    whole.add_actuator(
        name="own", target="own", trntype=mujoco.mjtTrn.mjTRN_SITE, gear=[0, 0, 7, 0, 0, 0]
    )
    model = whole.compile()
    data = mujoco.MjData(model)
    for name, value in {"port": 2.0, "pwm": 1700.0, "turn": -0.5, "own": 1.0}.items():
        data.actuator(name).ctrl = value
    mujoco.mj_forward(model, data)  # without water: what MuJoCo's own actuators apply, z up
    force, position = 40.0 * np.array([0.6, -0.8, 0.0]), np.array([0.1, 0.2, -0.05])
    own = np.array([*force, *np.cross(position, force)])
    own[[2, 5]] += [7.0, 1.0]
    np.testing.assert_allclose(data.qfrc_actuator, own, atol=1e-12)
    try:
        execute_module(tmp_path / "auv_bluerov2.py").in_water(model)
        mujoco.mj_forward(model, data)
    finally:
        mujoco.set_mjcb_passive(None)
    down, push = np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, -7.0, 0.0, 0.0, 0.0]])
    wanted = core(plant, States(np.zeros((1, 6)), down, np.array([[2.0, 1700.0, -0.5]]), push))[0]
    np.testing.assert_allclose(data.qacc, FLU * wanted, rtol=1e-9, atol=1e-12)
    assert [model.sensor(index).name for index in (1, 3)] == ["imu_rates", "dvl_velocity"]


@pytest.mark.slow
def test_the_card_has_the_fit_of_the_simulator_and_its_share_in_the_band(
    campaign, fit_model, export
):
    pytest.importorskip("mujoco")
    fit, log = fit_model(hd.catalog["prestero"]), campaign.test.between(0.0, 5.0)
    card = export("mujoco", fit.damping, log=log, fit=fit)
    band = predict_error(campaign.vehicle, fit, log)
    replayed = hd.simulate(campaign.vehicle, fit.damping, log, attitude="simulated").velocity
    inside = np.abs(replayed - log.velocity) <= band.half_width
    shares = list(card.replays.coverage.values())
    np.testing.assert_allclose(shares, 100.0 * inside.mean(axis=0), atol=3.0)  # Euler or RK steps
    assert f"u {card.replays.target_to_log.fit_by_axis['u']:.0f} % ({shares[0]:.0f} %" in str(card)
    bare = export("mujoco", fit.damping, "b", log=log)
    assert bare.replays.coverage == {}
    assert "Fit of the target to this log: u " in str(bare)


def test_locked_axes_and_time_that_stands_are_refused(planar, tmp_path, refused):
    boat, damping, _ = planar
    swaying = replace(boat, axes=("Y", "N"))
    refused(VehicleError, hd.export, damping, swaying, "mujoco", tmp_path / "a")
    refused(MethodError, MuJoCo, step=0.0)
