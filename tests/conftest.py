"""Shared builders: smooth motions with exact accelerations, and the wrench they need."""

import os
import re
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

import hydrodamp as hd
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.log import Log
from hydrodamp.kernels.core import coriolis

# The same examples every time; `--hypothesis-profile=default` looks for new ones.
settings.register_profile("seeded", derandomize=True)
settings.load_profile("seeded")

NEAR = Path(__file__).resolve().parents[2] / "shared" / "data"
"""Where measured logs lie in a development tree; they are no part of the project."""


def pytest_configure():
    """Hear Ctrl-C: a shell that starts the tests in the background has it ignored."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


SLOW = (
    *("tests/studies/", "tests/examples/", "tests/docs/test_pages", "tests/report/gallery/"),
    *(f"tests/export/test_{name}" for name in ("c99", "fmu", "gazebo", "identifiers", "octave")),
)
"""Folders and modules whose tests compile, draw, or run scripts."""


def pytest_collection_modifyitems(items):
    """Mark slow folders and modules, and the tests that open pages in a browser."""
    for item in items:
        has_browser = "browser" in getattr(item, "fixturenames", ())
        if has_browser or any(part in item.path.as_posix() for part in SLOW):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def measured_logs():
    """The folder of a measured log by its name; the test is skipped where it is absent."""

    def find(name):
        folder = Path(os.environ.get("HYDRODAMP_DATA", NEAR)) / name
        if not folder.is_dir():
            pytest.skip(f"the measured log {name} is not here; name its folder in HYDRODAMP_DATA")
        return folder

    return find


def smooth_motion(n, seed, step=0.1, forward=0.0):
    """Time, velocity and exact acceleration of a sum of sines on every axis."""
    rng = np.random.default_rng(seed)
    time = np.arange(n) * step
    velocity, acceleration = np.zeros((n, 6)), np.zeros((n, 6))
    for axis, size in enumerate((0.5, 0.3, 0.3, 0.4, 0.3, 0.3)):
        for _ in range(6):
            rate, phase = rng.uniform(0.05, 1.5), rng.uniform(0, 2 * np.pi)
            velocity[:, axis] += size * np.sin(rate * time + phase) / 2
            acceleration[:, axis] += size * rate * np.cos(rate * time + phase) / 2
    velocity[:, 0] += forward
    return time, velocity, acceleration


def random_attitude(n, seed, step=0.1):
    """Gentle roll, pitch and yaw."""
    rng = np.random.default_rng(seed)
    time = np.arange(n) * step
    rates, phases = rng.uniform(0.1, 0.5, 3), rng.uniform(0, 6, 3)
    return 0.2 * np.sin(np.outer(time, rates) + phases)


@pytest.fixture
def vehicle():
    """A vehicle with coupling in its mass matrix and no actuators."""
    return replace(hd.fleet["vt690"], actuators=(), center_of_gravity=(0.01, 0.0, 0.0083))


@pytest.fixture
def exact_log(vehicle):
    """A log whose recorded wrench makes the damping given exactly true."""

    def build(damping, n=3000, seed=1, forward=0.0, **more):
        time, velocity, acceleration = smooth_motion(n, seed, forward=forward)
        ratio = 1.0 + 0.3 * np.sin(0.07 * time)
        log = hd.Log.from_arrays(
            time,
            velocity,
            attitude=random_attitude(n, seed),
            acceleration=acceleration,
            propulsion_ratio=ratio,
            wrench=np.zeros((n, 6)),
            segment=np.repeat(["a", "b", "c"], n // 3),
        )
        mass = vehicle.mass_matrix
        known = coriolis(mass, velocity) + vehicle.restoring_wrench(log.down)
        tau = damping.wrench(velocity, down=log.down, propulsion_ratio=ratio)
        return replace(log, wrench=acceleration @ mass - known - tau, **more)

    return build


@pytest.fixture
def true_damping():
    """Random coefficients for any model, none of them small."""

    def build(model, seed=7):
        rng = np.random.default_rng(seed)
        size = rng.uniform(0.5, 2.0, model.n_coefficients)
        return hd.Damping(model, size * rng.choice([-1.0, 1.0], model.n_coefficients))

    return build


@pytest.fixture
def swim():
    """Ten seconds of yawing to and fro at 10 Hz, attitude and rates in accord."""
    time = np.arange(0.0, 10.0, 0.1)
    yaw = 0.5 * np.sin(time)
    velocity = np.zeros((100, 6))
    velocity[:, 0] = 1 + 0.1 * np.cos(time)
    velocity[:, 5] = 0.5 * np.cos(time)
    return Log.from_arrays(
        time,
        velocity,
        attitude=quaternion_from_euler(np.column_stack((0 * time, 0 * time, yaw))),
        commands={"rudder": 0.1 * np.sign(np.sin(time)), "rpm": np.full(100, 1500.0)},
        source="swim.csv",
    )


@pytest.fixture
def csv_file(tmp_path):
    """Write text to a CSV file and return its path."""

    def write(text, name="log.csv"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture(scope="session")
def bluerov2_runs(measured_logs):
    """The BlueROV2 tank runs, where the data folder is at hand."""
    return sorted(measured_logs("bluerov2_kth").glob("run_*.csv"))


@pytest.fixture
def refused(snapshot):
    """Call what must fail: the message, without its folder, is that of the snapshot.

    Reasons of NumPy and of the operating system are left out: other versions have others.
    """

    def check(error, call, *arguments, **named):
        with pytest.raises(error) as caught:
            call(*arguments, **named)
        folder = r"\S*/pytest-\d+/(popen-\w+/)?[^/\s]+"  # pytest-xdist has one of each worker
        text = re.sub(folder, "FOLDER", str(caught.value))
        foreign = r"(?<=\.npz: cannot be read: ).*|\[Errno \d+\] [\w ]+"
        assert re.sub(foreign, "REASON", text) == snapshot

    return check
