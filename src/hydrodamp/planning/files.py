"""A planned dive as files: a table of what to tell, waypoints of QGroundControl, a ROS 2 bag."""

from __future__ import annotations

import csv
import io
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.errors import MethodError
from hydrodamp.files import as_json
from hydrodamp.planning.dive import DivePlan

#: Metres of a degree of latitude, and seconds of a dive from one waypoint to the next.
_DEGREE, _BETWEEN = 111_320.0, 10.0

#: MAVLink: a waypoint, a change of speed, and altitude above home.
_WAYPOINT, _SPEED, _RELATIVE = 16, 178, 3


def orders_csv(plan: DivePlan) -> str:
    """Return what to tell as a table: time, setpoints, overlays, in SI units."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["time", *plan.orders])
    columns = np.column_stack([plan.time, *plan.orders.values()])
    writer.writerows([f"{value:.6g}" for value in row] for row in columns.tolist())
    return stream.getvalue()


def plan_document(plan: DivePlan) -> dict[str, Any]:
    """Return a plan as a document of strict JSON, without its time series."""
    reach = plan.reach
    return {
        "format": "hydrodamp-plan",
        "version": 1,
        "vehicle": plan.vehicle.name,
        "model": plan.model.key,
        "known": plan.known,
        "duration": plan.duration,
        "within_envelope": plan.within,
        "draws": plan.draws,
        "envelope": plan.envelope.model_dump(mode="json"),
        "stretches": [
            {
                "start": one.start,
                "end": one.end,
                "course": one.course,
                "shape": one.manoeuvre.shape,
                "level": one.manoeuvre.level,
                "tempo": one.manoeuvre.tempo,
                "strengths": list(one.manoeuvre.strengths),
            }
            for one in plan.stretches
        ],
        "predictions": {
            one.label: {
                "value": one.value,
                "standard_error_before": one.before,
                "bound": one.bound,
                "standard_error": one.after,
                "standard_error_together": one.together,
                "standard_error_of_steps": one.steps,
                "grade": one.grade.word,
                "cause": one.cause and one.cause.word,
            }
            for one in plan.predictions
        },
        "goal": reach
        and {
            "grade": reach.goal.word,
            "duration_by_axis": reach.by_axis,
            "unreached": reach.unreached,
        },
        "notes": list(plan.notes),
    }


def waypoints(plan: DivePlan) -> str:
    """Return the predicted way as a mission of QGroundControl.

    Courses, depths and speeds only: it has no place for what is added to commands.

    Raises
    ------
    MethodError
        If the envelope has no home.
    """
    home, track = plan.envelope.home, plan.track
    if home is None or track.position is None:
        raise MethodError("waypoints need `home: [latitude, longitude]` in the envelope [deg]")
    every = max(round(_BETWEEN / plan.envelope.period), 1)
    north, east, depth = track.position[::every].T
    latitude = home[0] + north / _DEGREE
    longitude = home[1] + east / (_DEGREE * np.cos(np.radians(home[0])))
    items: list[dict[str, Any]] = []
    speeds = plan.orders.get("speed")
    for place in range(len(north)):
        if speeds is not None:
            items.append(
                _item(
                    len(items) + 1,
                    _SPEED,
                    [1, round(float(speeds[place * every]), 2), -1, 0, 0, 0, 0],
                )
            )
        where = [
            0,
            0,
            0,
            None,
            float(latitude[place]),
            float(longitude[place]),
            -float(depth[place]),
        ]
        items.append(_item(len(items) + 1, _WAYPOINT, where))
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
                "cruiseSpeed": float(np.mean(plan.envelope.speed)),
                "hoverSpeed": float(np.mean(plan.envelope.speed)),
                "plannedHomePosition": [*home, 0.0],
                "items": items,
            },
        }
    )


def _item(number: int, command: int, parameters: list[float | None]) -> dict[str, Any]:
    return {
        "type": "SimpleItem",
        "autoContinue": True,
        "command": command,
        "doJumpId": number,
        "frame": _RELATIVE if command == _WAYPOINT else 2,
        "params": parameters,
    }


def can_write_bags() -> bool:
    """Tell whether the package that writes bags is installed."""
    return find_spec("rosbags") is not None


def write_bag(plan: DivePlan, folder: Path) -> None:
    """Write a ROS 2 bag: a ``std_msgs/Float64`` topic ``/plan/NAME`` for each order."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = "std_msgs/msg/Float64"
    message = store.types[kind]
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for name, values in plan.orders.items():
            topic = writer.add_connection(f"/plan/{name}", kind, typestore=store)
            for time, value in zip(plan.time.tolist(), values.tolist(), strict=True):
                content = store.serialize_cdr(message(data=value), kind)
                writer.write(topic, round(1e9 * time), content)
