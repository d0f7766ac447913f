"""The files that the examples on the pages read."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd

MAPPING = """
time: t
attitude: {roll: [imu.roll, roll], pitch: [imu.pitch, pitch], yaw: [imu.yaw, yaw]}
velocity:
  u: [dvl.u, u]
  v: [dvl.v, v]
  w: [dvl.w, w]
  p: [imu.p, p]
  q: [imu.q, q]
  r: [imu.r, r]
"""


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
        sys.modules, "vt690", raising=False
    )  # a page may export, and import, its own
    log = _dive()
    hd.write_log(log, "dive.csv")
    _write_tables(log)
    _write_bag(log)
    Path("mapping.yaml").write_text(MAPPING, encoding="utf-8")
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


def _write_bag(log):
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    point, vector = kinds["geometry_msgs/msg/Point"], kinds["geometry_msgs/msg/Vector3"]
    turn = kinds["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    pose = kinds["geometry_msgs/msg/Pose"](point(0.0, 0.0, 0.0), turn)
    header, stamp = kinds["std_msgs/msg/Header"], kinds["builtin_interfaces/msg/Time"]
    name = "nav_msgs/msg/Odometry"
    with Writer(Path("bag"), version=8, storage_plugin=StoragePlugin.MCAP) as bag:
        topic = bag.add_connection("/odom", name, typestore=store)
        for k in range(20):
            twist = kinds["geometry_msgs/msg/Twist"](
                vector(*log.velocity[k, :3]), vector(*log.velocity[k, 3:])
            )
            message = kinds[name](
                header(stamp(100 + k // 10, k % 10 * 100_000_000), "odom"),
                "base_link",
                kinds["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
                kinds["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36)),
            )
            bag.write(topic, int((100 + 0.1 * k) * 1e9), store.serialize_cdr(message, name))
    next(Path("bag").glob("*.mcap")).rename("dive.mcap")
