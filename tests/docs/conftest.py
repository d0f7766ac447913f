"""The files that the examples on the pages read."""

import shutil
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from strangers import Truth, odometry_messages
from writers import RosBag


@pytest.fixture
def sailed_once(monkeypatch):
    """Campaigns that several pages sail are sailed once; the same arguments give the same."""
    monkeypatch.setattr(hd, "reenact", _sailed)


@cache
def _sailed(**arguments):
    from hydrodamp.simulation.campaign.reenact import reenact

    return reenact(**arguments)


@pytest.fixture
def dive(tmp_path, monkeypatch):
    """A folder with the logs that pages about logs read, as the working directory."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.delitem(
        sys.modules, "auv_vt690", raising=False
    )  # a page may export, and import, its own
    log = _dive()
    hd.write_log(log, "dive.csv")
    _write_tables(log)
    _write_bag()
    shutil.copy(Path(__file__).with_name("mapping.yaml"), "mapping.yaml")
    return tmp_path


def _dive():
    """A campaign with its way, and with what a pilot's log has beside."""
    log = _sailed(seed=0, duration=60.0).exact_train
    yaw, step = _euler(log)[:, 2], np.diff(log.time, prepend=log.time[0])
    north = np.cumsum(step * (log.velocity[:, 0] * np.cos(yaw) - log.velocity[:, 1] * np.sin(yaw)))
    east = np.cumsum(step * (log.velocity[:, 0] * np.sin(yaw) + log.velocity[:, 1] * np.cos(yaw)))
    return hd.Log.from_arrays(
        log.time,
        log.velocity,
        attitude=log.attitude,
        commands={
            **{name: log.command(name) for name in log.command_names},
            "m1": np.full(log.n, 1550.0),
            "dvl_good": np.ones(log.n),
        },
        position=np.stack([north, east, np.full(log.n, 2.0)], axis=1),
        segment=np.repeat([one.name for one in log.segments], np.diff(log.bounds, axis=1).ravel()),
    )


def _euler(log):
    from hydrodamp.data.attitude import euler_from_quaternion

    return np.asarray(euler_from_quaternion(log.attitude))


def _write_tables(log):
    import pyarrow as pa
    import pyarrow.parquet as pq

    roll, pitch, yaw = _euler(log).T
    motion = dict(zip("uvwpqr", log.velocity.T, strict=True))
    turned = {"roll": roll, "pitch": pitch, "yaw": yaw}
    pq.write_table(pa.table({"time": log.time, **motion, **turned}), "dive.parquet")
    pq.write_table(pa.table({"t": log.time, **motion, **turned}), "season.parquet")
    imu = {"t": log.time, **turned, **{name: motion[name] for name in "pqr"}}
    dvl = {"t": log.time, **{name: motion[name] for name in "uvw"}}
    Path("dive").mkdir()
    for folder in (Path(), Path("dive")):
        for name, columns in (("imu", imu), ("dvl", dvl)):
            rows = np.stack(list(columns.values()), axis=1)
            head = ",".join(columns)
            np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header=head, comments="")


def _write_bag():
    """Odometry as robots record it."""
    bag = RosBag()
    odometry = odometry_messages(bag, bag.modern, Truth(20), "/odom")
    next(bag.ros2(Path("bag"), odometry).glob("*.mcap")).rename("dive.mcap")
