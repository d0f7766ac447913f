"""A planned dive as files: a table of commands, a mission of QGroundControl, a ROS 2 bag."""

from __future__ import annotations

import csv
import io
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.experiment_design.result import DivePlan
from hydrodamp.files import as_json
from hydrodamp.models.model import coefficient_unit, read_label

#: Metres of a degree of latitude.
_DEGREE = 111_320.0

#: MAVLink commands, and the frame of an altitude relative to home.
_WAYPOINT, _LAND, _SPEED, _RELATIVE = 16, 21, 178, 3

#: Units in ``plan.json``; commands and their excitation are in the units of the vehicle file.
UNITS = {
    "duration, start, end, duration_by_axis": "s",
    "course": "deg",
    "waypoints": "s, m, m, m, m/s",
    "within_envelope, time_at_limits, level, tempo, strengths": "1",
    "envelope depth, bottom, altitude, area": "m",
    "envelope pitch, roll, home": "deg",
    "envelope speed": "m/s",
    "envelope period": "s",
    "envelope margin": "1",
    "envelope noise": "m/s, rad/s, rad, m",
    "predictions value, bound, standard_error*": "as the unit of each",
}


def command_table(plan: DivePlan) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Return times [s], and what to command by name: a row for each waypoint, or each period."""
    if plan.waypoints is None:
        return plan.time, plan.setpoints
    time, north, east, depth, speed = plan.waypoints.T
    named = {"north": north, "east": east, "depth": depth, "speed": speed}
    if "depth" not in plan.setpoints:
        del named["depth"]
    return time, named


def commands_csv(plan: DivePlan) -> str:
    """Return what to command as a table in SI units."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    time, named = command_table(plan)
    writer.writerow(["time", *named])
    columns = np.column_stack([time, *named.values()]) + 0.0  # no negative zeros
    writer.writerows([f"{value:.6g}" for value in row] for row in columns.tolist())
    return stream.getvalue()


def plan_document(plan: DivePlan) -> dict[str, Any]:
    """Return a plan as a document of strict JSON, without its time series."""
    reach = plan.goal_duration
    return {
        "format": "hydrodamp-plan",
        "version": 2,
        "units": UNITS,
        "vehicle": plan.vehicle.name,
        "model": plan.model.key,
        "known": plan.prior,
        "duration": plan.duration,
        "mode": plan.mode,
        "within_envelope": plan.feasibility_rate,
        "time_at_limits": plan.saturation,
        "assumptions": list(plan.assumptions),
        "draws": plan.n_members,
        "envelope": plan.envelope.model_dump(mode="json"),
        "waypoints": None if plan.waypoints is None else (plan.waypoints + 0.0).tolist(),
        "stretches": [
            {
                "start": one.start,
                "end": one.end,
                "course": float(np.degrees(one.course) % 360.0),
                "shape": one.manoeuvre.shape,
                "level": one.manoeuvre.level,
                "tempo": one.manoeuvre.tempo,
                "strengths": list(one.manoeuvre.strengths),
            }
            for one in plan.segments
        ],
        "predictions": {
            one.label: {
                "unit": coefficient_unit(*read_label(one.label)),
                "value": one.value,
                "standard_error_before": one.prior_std_error,
                "bound": one.cramer_rao_bound,
                "standard_error": one.std_error,
                "standard_error_together": one.combined_std_error,
                "standard_error_of_steps": one.baseline_std_error,
                "grade": one.grade.word,
                "cause": one.cause and one.cause.word,
            }
            for one in plan.predictions
        },
        "goal": reach
        and {
            "grade": reach.goal.word,
            "duration_by_axis": reach.duration_by_axis,
            "unreached": reach.unreached,
        },
        "notes": list(plan.notes),
    }


def mission_plan(plan: DivePlan) -> str:
    """Return the waypoints as a mission of QGroundControl, with a way to the start and an end.

    The vehicle passes a waypoint at the least depth on its way to the start, so that it begins at
    speed and on course. It returns over the start at the least depth, and surfaces there
    (``MAV_CMD_NAV_LAND``: ArduSub goes there at its depth, then ascends).

    Raises
    ------
    MethodError
        If the dive does not follow waypoints, or the envelope has no home.
    """
    home, envelope = plan.envelope.home, plan.envelope
    if plan.waypoints is None:
        raise MethodError("a mission is of waypoints alone: plan with mode 'waypoints'")
    if home is None:
        raise MethodError("it needs `home: [latitude, longitude]` in the envelope [deg]")
    legs = plan.waypoints[:, 1:]
    shallow = np.array([0.0, 0.0, envelope.depth[0], legs[0, 3]])
    path = np.vstack([_run_in(plan), legs, shallow])
    if "depth" not in plan.setpoints:
        path[:, 2] = 0.0
    items: list[dict[str, Any]] = []
    speed = None
    for north, east, depth, leg_speed in path.tolist():
        if round(leg_speed, 2) != speed:
            speed = round(leg_speed, 2)
            items.append(_item(len(items) + 1, _SPEED, [1, speed, -1, 0, 0, 0, 0]))
        where = _position(home, north, east)
        items.append(_item(len(items) + 1, _WAYPOINT, [0, 0, 0, None, *where, 0.0 - depth]))
    items.append(_item(len(items) + 1, _LAND, [0, 0, 0, None, *home, 0.0]))
    return as_json(
        {
            "fileType": "Plan",
            "version": 1,
            "groundStation": "hydrodamp",
            "geoFence": {"circles": [], "polygons": [], "version": 2},
            "rallyPoints": {"points": [], "version": 2},
            "mission": {
                "version": 2,
                "firmwareType": 3,
                "vehicleType": 12,
                "cruiseSpeed": float(np.mean(envelope.speed)),
                "hoverSpeed": float(np.mean(envelope.speed)),
                "plannedHomePosition": [*home, 0.0],
                "items": items,
            },
        }
    )


def _run_in(plan: DivePlan) -> FloatArray:
    """Return a waypoint at the least depth from which the first leg begins without a turn.

    It is so far behind the start that the descent takes half of the pitch that is allowed, and at
    least a leg; within the area.
    """
    assert plan.waypoints is not None
    start, leg = plan.waypoints[0, 1:], np.diff(plan.waypoints[:2, 1:3], axis=0)[0]
    descent = start[2] - plan.envelope.depth[0]
    length = max(descent / np.tan(np.radians(0.5 * plan.envelope.pitch)), np.linalg.norm(leg))
    north, east = start[:2] - length * leg / np.linalg.norm(leg)
    if (area := plan.envelope.area) is not None:
        north, east = np.clip(north, *area.north), np.clip(east, *area.east)
    return np.array([north, east, plan.envelope.depth[0], plan.waypoints[0, 4]])


def _position(home: tuple[float, float], north: float, east: float) -> tuple[float, float]:
    """Return latitude and longitude, -180 to 180 [deg]."""
    longitude = home[1] + east / (_DEGREE * np.cos(np.radians(home[0])))
    return home[0] + north / _DEGREE, float((longitude + 180.0) % 360.0 - 180.0)


def _item(number: int, command: int, parameters: list[float | None]) -> dict[str, Any]:
    return {
        "type": "SimpleItem",
        "autoContinue": True,
        "command": command,
        "doJumpId": number,
        "frame": 2 if command == _SPEED else _RELATIVE,
        "params": parameters,
    }


def can_write_bags() -> bool:
    """Tell whether the package that writes bags is installed."""
    return find_spec("rosbags") is not None


def write_bag(plan: DivePlan, folder: Path) -> None:
    """Write a ROS 2 bag: a ``std_msgs/Float64`` topic ``/plan/NAME`` for each column."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = "std_msgs/msg/Float64"
    message = store.types[kind]
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        time, named = command_table(plan)
        for name, values in named.items():
            topic = writer.add_connection(f"/plan/{name}", kind, typestore=store)
            for stamp, value in zip(time.tolist(), values.tolist(), strict=True):
                content = store.serialize_cdr(message(data=value), kind)
                writer.write(topic, round(1e9 * stamp), content)
