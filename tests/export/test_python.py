"""The Python file: the same accelerations, and the forms of two simulators."""

import numpy as np

import hydrodamp as hd
from hydrodamp.data.attitude import euler_from_quaternion, quaternion_from_euler, rotation_matrices
from hydrodamp.export.scripts import Python

from .conftest import PAPER, WIDE


def module_of(plant, folder):
    for name, text in Python().render_files(plant).items():
        (folder / name).write_text(text, encoding="utf-8")
    names = {}
    exec(next(folder.glob("*.py")).read_text(encoding="utf-8"), names)
    return names


def test_the_simulators_euler_step_converges_to_the_replay(campaign, tmp_path):
    log, vehicle = campaign.exact_test.between(0.0, 5.0), campaign.vehicle
    names = module_of(PAPER, tmp_path)
    wanted = hd.simulate(vehicle, PAPER.damping, log, attitude="simulated").velocity[-1]
    errors = []
    for step in (0.02, 0.01):
        boat = names[f"auv_{vehicle.name}"]()
        nu, actual = log.velocity[0], boat.u_actual
        eta = np.concatenate([np.zeros(3), euler_from_quaternion(log.attitude[:1])[0]])
        for time in np.arange(log.time[0], log.time[-1] - 1e-9, step):
            held = log.commands[np.searchsorted(log.time, time + 1e-9) - 1]
            command = [held[log.command_names.index(name)] for name in boat.controls]
            nu, actual = boat.dynamics(eta, nu, actual, np.array(command), step)
            phi, theta, _ = eta[3:]
            p, q, r = nu[3:]
            turn = q * np.sin(phi) + r * np.cos(phi)
            eta[3] += step * (p + np.tan(theta) * turn)
            eta[4] += step * (q * np.cos(phi) - r * np.sin(phi))
            eta[5] += step * turn / np.cos(theta)
        errors.append(np.abs(nu - wanted).max())
    assert errors[1] < 0.6 * errors[0] < 0.01


def test_a_current_carries_the_vehicle_along(tmp_path):
    boat = module_of(PAPER, tmp_path)["auv_vt690"](0.5, np.pi / 2)
    nu = np.array([0.0, 0.5, 0.0, 0.0, 0.0, 0.0])  # with the water, heading north
    still, _ = boat.dynamics(np.zeros(6), nu, boat.u_actual, np.zeros(3), 0.1)
    np.testing.assert_allclose(still, nu, atol=1e-15)


def test_holoocean_is_asked_in_its_own_world(tmp_path):
    names = module_of(WIDE, tmp_path)
    quaternion = quaternion_from_euler(np.array([[0.3, -0.4, 2.0]]))[0]
    nu, given = np.array([1.0, 0.2, -0.3, 0.1, 0.2, -0.1]), np.full(len(WIDE.inputs), 0.2)
    turn, turned = rotation_matrices(quaternion[None])[0], np.array([1.0, -1.0, -1.0])
    w, x, y, z = quaternion
    linear, angular = (turned * (turn @ part) for part in (nu[:3], nu[3:]))
    state = np.concatenate([np.zeros(3), linear, np.zeros(6), angular, [x, -y, -z, w]])
    found, step = names["holoocean"](state, given), 1e-6
    # The same by differences: move the vehicle for a moment, and look at it from the world.
    at = np.concatenate([nu, np.zeros(3), quaternion])
    later = at + step * names["derivative"](at, given)
    moved = rotation_matrices(later[None, 9:] / np.linalg.norm(later[9:]))[0]
    before, after = turn @ nu.reshape(2, 3).T, moved @ later[:6].reshape(2, 3).T
    wanted = ((after - before).T * turned / step).ravel()
    np.testing.assert_allclose(found, wanted, atol=1e-4 * np.abs(wanted).max())
