"""Sensors that keep their own times, read from tables with empty cells and from topics."""

import numpy as np

import hydrodamp as hd
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from table_rows import rows

BASE = {"time": "t", "velocity": {"r": "r"}, "attitude": {"heading": "psi"}, "commands": ["rudder"]}


def test_empty_cells_of_a_table_are_no_gaps(tmp_path):
    """Ten rows of the base clock, and three fixes between them."""
    lines = ["t,r,psi,rudder,n,e"]
    lines += [f"{k / 10},0.1,{k / 100},{k % 2},," for k in range(10)]
    lines += [f"{t},,,,{10 * t},{-t}" for t in (0.05, 0.35, 0.65)]
    path = tmp_path / "boat.csv"
    path.write_text("\n".join([lines[0], *sorted(lines[1:], key=lambda x: float(x.split(",")[0]))]))
    sensors = {"gps": {"kind": "position", "columns": {"north": "n", "east": "e"}, "std": 0.5,
                       "delay": 0.2, "lever_arm": [1, 0, -2], "estimate": ["delay"]}}  # fmt: skip
    log = hd.read_log(path, hd.LogMapping.from_dict({**BASE, "sensors": sensors}))
    (gps,) = log.measurements
    assert (log.n, len(log.segments)) == (10, 1)
    np.testing.assert_allclose(gps.time, [0.05, 0.35, 0.65])
    np.testing.assert_allclose(gps.values, [[0.5, -0.05], [3.5, -0.35], [6.5, -0.65]])
    assert (gps.std.tolist(), gps.delay, gps.estimate) == ([0.5, 0.5], 0.2, ("delay",))
    assert gps.lever_arm.tolist() == [1.0, 0.0, -2.0]


def test_topics_keep_their_clocks_units_and_axes():
    """A depth in cm, up positive, and a specific force in forward-port-up axes."""
    time = np.arange(20) / 10
    base = Topic("base", time, {"r": np.full(20, 0.1), "psi": time, "rudder": time})
    altitude = Topic("sonar", [0.0, 0.7, 1.4], {"z": [-100.0, -110.0, -120.0]})
    imu = Topic("imu", time[:15] + 0.03, {"x": np.ones(15), "y": np.full(15, 2.0)})
    mapping = hd.LogMapping.from_dict({
        "time": "recorded", "frame": "FLU", "clock": "base",
        "velocity": {"r": "base.r"}, "attitude": {"yaw": "base.psi"},
        "sensors": {
            "depth": {"kind": "position", "columns": {"up": {"column": "sonar.z", "unit": "cm"}}},
            "imu": {"kind": "specific_force", "columns": {"x": "imu.x", "y": "imu.y"}},
        },
    })  # fmt: skip
    log = mapping.log(Recording((base, altitude, imu), "dive", "example"))
    depth, force = log.measurements
    np.testing.assert_allclose(depth.values[:, 0], [1.0, 1.1, 1.2])
    assert depth.components == ("down",)
    np.testing.assert_allclose(force.values[0], [1.0, -2.0])
    np.testing.assert_allclose(force.time[0], 0.03)


@rows("sensor")
def test_faults_of_a_sensor_are_told(sensor, refused):
    refused(LogError, hd.LogMapping.from_dict, {**BASE, "sensors": {"gps": sensor}})


def test_a_log_needs_a_velocity_or_a_sensor(refused):
    refused(LogError, hd.LogMapping.from_dict, {"time": "t", "attitude": {"heading": "psi"}})


def test_sparse_columns_of_a_canonical_table_are_sensors(tmp_path):
    """Depth at every sample, fixes in rows of their own; no mapping."""
    lines = [f"{k / 10},0,0,{k / 100},0.1,0.2,0.3,{k % 2},,,{k / 10}" for k in range(40)]
    lines += [f"{t},,,,,,,,{10 * t},{-t}," for t in (0.05, 1.05, 2.05)]
    lines.sort(key=lambda line: float(line.split(",")[0]))
    path = tmp_path / "dive.csv"
    path.write_text("\n".join(["time,roll,pitch,yaw,p,q,r,fin,north,east,down", *lines]))
    log = hd.read_log(path)
    fixes, depth = log.measurements
    assert (log.n, len(log.segments), log.velocity_names) == (40, 1, ("p", "q", "r"))
    assert (fixes.name, fixes.n, depth.name, depth.n) == ("position", 3, "depth", 40)
    np.testing.assert_allclose(fixes.values[:, 0], [0.5, 10.5, 20.5])
    assert log.command_names == ("fin",)
