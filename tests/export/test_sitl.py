"""The server for ArduPilot: its packets, its frames and the servos of its map.

The packets are those of libraries/SITL/examples/JSON/readme.md of ArduPilot.
"""

import json
import socket
import struct
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.attitude import rotation_matrices
from hydrodamp.errors import MethodError, VehicleError
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.export.scripts import execute_module
from hydrodamp.export.sitl import _FRAMES, SITL
from table_rows import rows

from .conftest import RICH, level_log, write_export

G = 9.80665
DOFS = "forward", "lateral", "throttle", "roll", "pitch", "yaw"
SIGNS = np.array([1.0, 1.0, -1.0, 1.0, 1.0, 1.0])
ROV = replace(
    hd.fleet["bluerov2"],
    weight=124.8,  # it sinks: equation 1 has no surface
    actuators=(
        hd.Thruster("port", (0.1, -0.1, 0.0), (1.0, 0.5, 0.0), gain=20.0, limit=1.0),
        hd.Thruster("star", (0.1, 0.1, 0.0), (1.0, -0.5, 0.1), gain=20.0, limit=1.0),
        hd.Thruster("heave", (0, 0.05, 0), (0, 0, 1), curve=((1100, -9), (1480, 0), (1900, 12))),
    ),
)
DAMPING = hd.Damping.from_dict(
    None, {"X_u": -4.0, "Y_v|v|": -20.0, "Z_w": -5.0, "K_p": -0.1, "M_q": -0.1, "N_r": -0.2}
)
STILL = [*[0] * 8, 1480, *[0] * 7]
SERVOS = SITL(servos="9:heave:1100:1900,1:port:-1:1,2:star:1:-1")


def packet(count, pulses, rate=50, magic=None):
    pulses = [*pulses, *[0] * ((16 if len(pulses) <= 16 else 32) - len(pulses))]
    magic = magic or {16: 18458, 32: 29569}[len(pulses)]
    return struct.pack(f"<HHI{len(pulses)}H", magic, rate, count, *pulses)


def run_module(form, vehicle, damping, folder):
    plant = ExportedPlant.of(vehicle, damping)
    path = next(write_export(form, plant, folder).glob("*.py"))
    return SimpleNamespace(**execute_module(path).__dict__), path


def read(reply):
    assert reply[:1] == reply[-1:] == b"\n"
    return json.loads(reply)


@pytest.fixture
def autopilot(tmp_path):
    """What sends packets to the server of the ROV, and returns its replies."""
    _, path = run_module(SERVOS, ROV, DAMPING, tmp_path)
    call = [sys.executable, str(path), "--port", "0"]
    with (
        subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as server,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link,
    ):
        port = int(server.stdout.readline().rpartition(b":")[2])
        link.settimeout(20.0)

        def ask(data):
            link.sendto(data, ("127.0.0.1", port))
            return link.recv(4096)

        yield ask, lambda data: link.sendto(data, ("127.0.0.1", port))
        server.terminate()


def test_the_states_are_those_of_the_replay(autopilot):
    ask, _ = autopilot
    n, rate, random = 80, 50, np.random.default_rng(0)
    pulses = random.integers(1100, 1901, (n, 2)).repeat(4, axis=0)[:n]
    heave = random.integers(1480, 1901, n)
    replies = []
    for k in range(n):
        outputs = np.full(16 + 16 * (k % 2), 1500)  # both sizes of packets
        outputs[[0, 1, 8]] = [*pulses[k], heave[k]]
        replies.append(read(ask(packet(k, outputs, rate))))
    commands = np.column_stack([(pulses - 1500.0) / 400.0 * [1.0, -1.0], heave])
    time, held = np.arange(n + 1) / rate, np.vstack([commands, commands[-1:]])
    log = level_log(time, commands=held, command_names=("port", "star", "heave"))
    wanted = hd.simulate(ROV, DAMPING, log, attitude="simulated").velocity[1:]
    turn = rotation_matrices(np.array([reply["quaternion"] for reply in replies]))
    velocity = np.array([reply["velocity"] for reply in replies])
    linear = np.einsum("nij,ni->nj", turn, velocity)
    rates = np.array([reply["imu"]["gyro"] for reply in replies])
    found = np.column_stack([linear, rates])
    np.testing.assert_allclose(found, wanted, rtol=1e-10, atol=1e-12)
    assert np.ptp(wanted, axis=0).min() > 0.01
    np.testing.assert_allclose([reply["timestamp"] for reply in replies], time[1:])
    steps = np.diff([reply["position"] for reply in replies], axis=0)
    np.testing.assert_allclose(steps * rate, 0.5 * (velocity[1:] + velocity[:-1]), atol=2e-3)


def test_frames_repeat_restart_and_are_not_confused_by_garbage(autopilot):
    ask, send = autopilot
    forward, still = [1800, 1200], [1500, 1500]
    first = ask(packet(7, forward))
    assert ask(packet(7, still)) == first  # sent again: no step
    for data in (b"", b"{}", b"x" * 40, packet(8, forward)[:-1], packet(8, forward, rate=0)):
        send(data)
    send(packet(8, forward, magic=29569))
    later = read(ask(packet(9, forward)))
    assert later["timestamp"] == pytest.approx(2 / 50)
    assert later["velocity"][0] > read(first)["velocity"][0] > 0.0
    assert ask(packet(0, forward)) == first  # a lower count: the autopilot restarted
    assert read(ask(packet(1, forward, rate=4)))["timestamp"] == pytest.approx(1 / 50 + 1 / 4)


@pytest.mark.slow
def test_acceleration_is_the_specific_force(tmp_path):
    module, _ = run_module(SERVOS, replace(ROV, weight=ROV.buoyancy), DAMPING, tmp_path)
    rest = read(module.Simulation().answer(50, 0, STILL))
    assert rest["imu"]["accel_body"] == pytest.approx([0.0, 0.0, -G], abs=1e-9)
    vehicle, rate = module.Simulation(), 2000
    pulses = [1900, 1500, *[1500] * 6, 1900, *[1500] * 7]
    replies = [read(vehicle.answer(rate, k, pulses)) for k in range(2000)]
    before, now, after = replies[-3:]
    change = (np.array(after["velocity"]) - before["velocity"]) * rate / 2.0
    turn = rotation_matrices(np.array([now["quaternion"]]))[0]
    assert turn[2, 2] < 0.99  # rolled
    wanted = turn.T @ (change - [0.0, 0.0, G])
    np.testing.assert_allclose(now["imu"]["accel_body"], wanted, atol=1e-5)


@pytest.mark.slow
def test_a_light_vehicle_floats_where_it_displaces_its_weight(tmp_path):
    light = replace(ROV, weight=0.8 * ROV.buoyancy)
    heavily = hd.Damping.from_dict(None, {"Z_w": -100.0})
    module, _ = run_module(SERVOS, light, heavily, tmp_path)
    vehicle = module.Simulation()
    for count in range(600):
        reply = read(vehicle.answer(20, count, STILL))
    side = np.cbrt(ROV.buoyancy / (1000.0 * G))
    depth = 0.3 * side - ROV.center_of_buoyancy[2]  # 80 % of the cube below z = 0
    assert reply["position"][2] == pytest.approx(depth, abs=1e-6)


def test_a_boat_of_three_axes_stays_at_the_surface(planar, tmp_path):
    boat, damping, _ = planar
    module, _ = run_module(SITL(pulse_range="-1:1"), boat, damping, tmp_path)
    vehicle = module.Simulation()
    replies = [read(vehicle.answer(50, count, [1900] * 16)) for count in range(200)]
    assert replies[-1]["position"][2] == 0.0
    assert replies[-1]["velocity"][2] == 0.0
    assert replies[-1]["imu"]["accel_body"][2] == pytest.approx(-G)
    assert replies[-1]["imu"]["gyro"][2] > 0.1


def test_a_diverging_motion_ends_the_server(tmp_path, refused):
    unstable = hd.Damping.from_dict(None, {"X_u": 200.0})
    module, _ = run_module(SERVOS, ROV, unstable, tmp_path)
    vehicle = module.Simulation()
    refused(SystemExit, lambda: [vehicle.answer(50, count, [1900] * 16) for count in range(200)])


def mix(frame, demands):
    """Return pulse widths of ArduSub for demands by degree of freedom, and its factors."""
    rows = _FRAMES[frame]
    factors = np.array([rows.get(dof, [0.0] * len(rows["yaw"])) for dof in DOFS]).T
    return (1500 + 400 * factors @ demands).round().astype(int).tolist(), factors


@pytest.mark.parametrize("frame", _FRAMES)
def test_motors_of_a_frame_find_their_thrusters(frame, tmp_path):
    demands = np.array([0.2, -0.1, 0.15, 0.05, -0.1, 0.1])
    pulses, factors = mix(frame, demands)
    order = np.random.default_rng(3).permutation(len(factors))
    signs = np.where(order % 2, -1.0, 1.0)  # every second thruster is mounted in reverse
    wrenches = signs[:, None] * (SIGNS * factors)[order]
    names = tuple(f"t{number}" for number in range(len(order)))
    vehicle = replace(ROV, actuators=(hd.Matrix(names, wrenches.tolist()),))
    module, _ = run_module(SITL(frame=frame, pulse_range="-1:1"), vehicle, DAMPING, tmp_path)
    found = module.read_inputs(pulses) @ wrenches
    wanted = SIGNS * (factors.T @ factors @ demands)
    np.testing.assert_allclose(found, wanted, atol=2e-2)


@pytest.mark.parametrize("frame", _FRAMES)
def test_channels_of_a_pilot_are_unmixed(frame, tmp_path):
    dofs = [dof for dof in DOFS if dof in _FRAMES[frame]]
    demands = np.array([0.12, -0.08, 0.1, 0.05, -0.09, 0.11]) * [dof in dofs for dof in DOFS]
    table = {axis: f"ch_{dof}" for axis, dof in zip("XYZKMN", DOFS, strict=True) if dof in dofs}
    model = hd.DampingModel.from_table(table, key="gains")
    damping = hd.Damping(model, np.arange(1.0, 1.0 + model.n_coefficients))
    servos = ",".join(f"{dof}:ch_{dof}" for dof in dofs)
    form = SITL(frame=frame, servos=servos, pulse_range="-1:1")
    module, _ = run_module(form, replace(ROV, actuators=()), damping, tmp_path)
    found = dict(zip(module.INPUTS, module.read_inputs(mix(frame, demands)[0]), strict=True))
    for dof, value in zip(DOFS, demands, strict=True):
        assert found.get(f"ch_{dof}", 0.0) == pytest.approx(value, abs=2e-3)


def test_outputs_without_pulses_are_idle(tmp_path):
    servos = "1:rudder:-0.3:0.3,2:rpm:0:2000,3:lambda:1100:1900,20:lift:0.1:0.5"
    module, _ = run_module(SITL(servos=servos), RICH, DAMPING, tmp_path)
    np.testing.assert_allclose(module.read_inputs([0] * 32), [0.0, 0.0, 1500.0, 0.3])
    np.testing.assert_allclose(module.read_inputs([2200] * 32), [0.3, 2000.0, 1900.0, 0.5])
    np.testing.assert_allclose(module.read_inputs([900] * 16), [-0.3, 0.0, 1100.0, 0.3])


@rows(["settings"])
def test_maps_that_drive_no_vehicle_are_refused(settings, tmp_path, refused):
    refused(MethodError, lambda: hd.export(DAMPING, ROV, SITL(**settings), tmp_path / "a"))
    assert not (tmp_path / "a").exists()


def test_a_vehicle_that_no_servo_can_drive_is_refused(tmp_path, refused):
    refused(VehicleError, lambda: hd.export(DAMPING, hd.fleet["bluerov2"], SITL(), tmp_path / "a"))


@pytest.mark.slow
def test_the_card_replays_a_log_through_the_server(campaign, export):
    form = SITL(servos="1:rudder,2:elevator,3:rpm:-2000:2000", pulse_range="-0.3:0.3")
    card = export(form, log=campaign.exact_test.between(0.0, 4.0))
    assert card.replays.source_to_target.rms < 1e-12
    assert "of the server" in card.replays.step
    assert max(card.wrench_error.values()) < 1e-10
