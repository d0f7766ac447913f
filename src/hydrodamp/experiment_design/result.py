"""A planned dive, its predicted results, and its files: CSV, JSON, mission."""

from __future__ import annotations

import csv
import io
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError, repr_html
from hydrodamp.experiment_design.envelope import Envelope
from hydrodamp.experiment_design.guidance import Manoeuvre
from hydrodamp.files import as_json, load_yaml
from hydrodamp.identification.grades import Cause, Grade
from hydrodamp.models.model import DampingModel, coefficient_unit, read_label
from hydrodamp.vehicle.vehicle import Vehicle

METRES_PER_DEGREE = 111_320.0
"""Of latitude [m/deg]."""

NAV_WAYPOINT, NAV_LAND, DO_CHANGE_SPEED = 16, 21, 178
"""MAVLink commands (``MAV_CMD``)."""

FRAME_MISSION, FRAME_RELATIVE_ALTITUDE = 2, 3
"""MAVLink frames: none, and altitude relative to home (``MAV_FRAME``)."""

WORTH_RATIO = 0.5**0.5
"""Width of intervals relative to today's, for a dive of as much information as today's data."""

_CONTENT: Any = load_yaml(Path(__file__).with_name("plan.yaml"))

UNITS: dict[str, str] = _CONTENT["units"]
"""Units in ``plan.json``; commands and overlays are in the units of the vehicle file."""


@dataclass(frozen=True)
class Prediction:
    """Predicted estimate of one coefficient.

    Attributes
    ----------
    label : str
        The coefficient.
    value : float
        Its prior value; without one, the estimate for the nominal member.
    prior_std_error : float or None
        Standard error of the prior; None where unknown.
    cramer_rao_bound : float
        Cramer-Rao bound of the standard error, from sensor noise alone.
    std_error : float
        Standard error that ``identify`` is expected to report from this dive.
    combined_std_error : float
        The same combined with the prior, as if independent.
    baseline_std_error : float
        Standard error from a baseline campaign of steps of the same duration and envelope.
    grade : Grade
        Grade that ``identify`` is expected to report.
    cause : Cause or None
        Why the coefficient is not determined.
    """

    label: str
    value: float
    prior_std_error: float | None
    cramer_rao_bound: float
    std_error: float
    combined_std_error: float
    baseline_std_error: float
    grade: Grade
    cause: Cause | None


@dataclass(frozen=True)
class PlanSegment:
    """A manoeuvre of a dive: its start and end [s], and its course [rad]."""

    start: float
    end: float
    course: float
    manoeuvre: Manoeuvre


@dataclass(frozen=True, eq=False)
class DivePlan:
    """A planned dive and its predicted results.

    Attributes
    ----------
    vehicle : Vehicle
        The vehicle of the dive.
    model : DampingModel
        The model to identify, restricted to the free axes.
    envelope : Envelope
        Constraints of the dive.
    prior : str
        Source of the prior coefficients.
    time : ndarray, shape (n,)
        Time of each command period [s].
    setpoints : dict of str to ndarray, shape (n,)
        ``speed`` [m/s] and the propeller's command, ``heading`` [rad], ``depth`` [m], and overlays
        of the other commands (``rudder_overlay``).
    segments : tuple of PlanSegment
        The manoeuvres in order.
    track : Log
        Predicted log with the nominal damping and sensor noise.
    depth_band : ndarray, shape (n, 2)
        5 % and 95 % quantiles of the depth over the ensemble [m].
    feasibility_rate : float
        Share of the ensemble members that satisfy all constraints.
    n_members : int
        Number of ensemble members.
    mode : {"waypoints", "setpoints", "overlays"}
        How the dive is executed; predictions hold for this mode.
    waypoints : ndarray, shape (m, 5), or None
        For that mode: expected time [s], north, east and depth [m], and the speed of the leg to
        each [m/s]. ``setpoints`` are then those of the guidance of the nominal member.
    saturation : dict of str to float
        Mean share of time that each command is at its limit or rate limit.
    assumptions : tuple of str
        Values assumed because neither vehicle nor envelope states them.
    predictions : tuple of Prediction
        One per coefficient, in the model's order.
    notes : tuple of str
        Further remarks.
    grades : dict of str to Grade
        Grades of the earlier fit, by label; empty without one.
    """

    vehicle: Vehicle
    model: DampingModel
    envelope: Envelope
    prior: str
    time: FloatArray
    setpoints: dict[str, FloatArray]
    segments: tuple[PlanSegment, ...]
    track: Log
    depth_band: FloatArray
    feasibility_rate: float
    n_members: int
    mode: str
    waypoints: FloatArray | None
    saturation: dict[str, float]
    assumptions: tuple[str, ...]
    predictions: tuple[Prediction, ...]
    notes: tuple[str, ...] = field(default=())
    grades: dict[str, Grade] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """Duration of the dive [s]."""
        return float(self.time[-1])

    @property
    def worth(self) -> str:
        """Whether the dive is worth it: how many grades are better, and how intervals shrink."""
        order, n, better, ratios = list(Grade), len(self.predictions), 0, list[float]()
        for each in self.predictions:
            better += order.index(each.grade) < order.index(self.grades.get(each.label, order[-1]))
            if each.prior_std_error:
                ratios.append(each.combined_std_error / each.prior_std_error)
        ratio, has_grades = float(np.median(ratios or [1.0])), bool(self.grades) or not ratios
        grade = "a better grade than today" if self.grades else f"a grade above '{order[-1].word}'"
        gains = [f"{better} of {n} coefficients get {grade}"] * has_grades
        gains += [f"intervals become {ratio:.0%} as wide as today's, in the median"] * bool(ratios)
        is_worth = ratio <= WORTH_RATIO or (has_grades and better)
        return f"{'Worth it' if is_worth else 'Not worth it'}: {'; '.join(gains)}."

    def _repr_html_(self) -> str:
        names = ("label", "value", "prior_std_error", "std_error", "combined_std_error")
        columns = {name: [getattr(each, name) for each in self.predictions] for name in names}
        grades = [each.grade.word for each in self.predictions]
        return repr_html(self, columns | {"unit": self.model.units, "grade": grades})

    def __str__(self) -> str:
        """Return whether the dive is worth it, and the predicted grades, in sentences."""
        grades = [each.grade for each in self.predictions]
        counts = ", ".join(f"{grades.count(grade)} {grade.word}" for grade in Grade)
        return (
            f"{self.worth} A dive of {self.duration:.0f} s by {self.mode} for '{self.model.key}' "
            f"on {self.vehicle.name}: {counts}; "
            f"feasibility rate {100.0 * self.feasibility_rate:.0f} % of {self.n_members} members."
        )


def command_table(plan: DivePlan) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Return times [s] and columns of the plan: a row for each waypoint, or each period."""
    if plan.waypoints is None:
        return plan.time, plan.setpoints
    time, *columns = plan.waypoints.T
    table = dict(zip(("north", "east", "depth", "speed"), columns, strict=True))
    if "depth" not in plan.setpoints:
        del table["depth"]
    return time, table


def commands_csv(plan: DivePlan) -> str:
    """Return the commands as CSV in SI units."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    time, table = command_table(plan)
    writer.writerow(["time", *table])
    columns = np.column_stack([time, *table.values()]) + 0.0  # no negative zeros
    writer.writerows([f"{value:.6g}" for value in row] for row in columns.tolist())
    return stream.getvalue()


def plan_document(plan: DivePlan) -> dict[str, Any]:
    """Return the content of ``plan.json``: a plan without its time series."""
    return {
        "format": "hydrodamp-plan",
        "version": 4,
        "units": UNITS,
        "vehicle": plan.vehicle.name,
        "model": plan.model.key,
        "prior": plan.prior,
        "duration": plan.duration,
        "mode": plan.mode,
        "feasibility_rate": plan.feasibility_rate,
        "time_at_limits": plan.saturation,
        "assumptions": list(plan.assumptions),
        "ensemble_members": plan.n_members,
        "envelope": plan.envelope.model_dump(mode="json"),
        "waypoints": None if plan.waypoints is None else (plan.waypoints + 0.0).tolist(),
        "segments": [
            {
                "start": item.start,
                "end": item.end,
                "course": float(np.degrees(item.course) % 360.0),
                **asdict(item.manoeuvre),
            }
            for item in plan.segments
        ],
        "predictions": {
            item.label: {
                "unit": coefficient_unit(*read_label(item.label)),
                "value": item.value,
                "standard_error_before": item.prior_std_error,
                "cramer_rao_bound": item.cramer_rao_bound,
                "standard_error": item.std_error,
                "standard_error_combined": item.combined_std_error,
                "standard_error_of_baseline": item.baseline_std_error,
                "grade": item.grade.word,
                "cause": item.cause and item.cause.word,
            }
            for item in plan.predictions
        },
        "notes": list(plan.notes),
    }


def mission_plan(plan: DivePlan) -> str:
    """Return the waypoints as a QGroundControl mission, with a run-in and a return to the start.

    The run-in starts at the least depth, so that the dive begins at speed and on course. After the
    dive the vehicle returns to the start at the least depth, and surfaces there
    (``MAV_CMD_NAV_LAND``: ArduSub goes there at its depth, then ascends).

    Raises
    ------
    MethodError
        If the dive does not follow waypoints, or the envelope has no home.
    """
    home, envelope = plan.envelope.home, plan.envelope
    if plan.waypoints is None:
        raise MethodError("a mission needs waypoints: plan with mode 'waypoints'")
    if home is None:
        raise MethodError("a mission needs `home: [latitude, longitude]` in the envelope [deg]")
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
            items.append(_item(len(items) + 1, DO_CHANGE_SPEED, [1, speed, -1, 0, 0, 0, 0]))
        position = _position(home, north, east)
        items.append(_item(len(items) + 1, NAV_WAYPOINT, [0, 0, 0, None, *position, 0.0 - depth]))
    items.append(_item(len(items) + 1, NAV_LAND, [0, 0, 0, None, *home, 0.0]))
    document, speed = _CONTENT["mission"], float(np.mean(envelope.speed))
    mission = document["mission"] | {"cruiseSpeed": speed, "hoverSpeed": speed}
    mission |= {"plannedHomePosition": [*home, 0.0], "items": items}
    return as_json(document | {"mission": mission})


def _run_in(plan: DivePlan) -> FloatArray:
    """Return a waypoint at the least depth, in line with the first leg and inside the area.

    Its distance from the start is at least a leg, and such that the descent needs at most half of
    the pitch limit.
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
    longitude = home[1] + east / (METRES_PER_DEGREE * np.cos(np.radians(home[0])))
    return home[0] + north / METRES_PER_DEGREE, float((longitude + 180.0) % 360.0 - 180.0)


def _item(number: int, command: int, parameters: list[float | None]) -> dict[str, Any]:
    return {
        "type": "SimpleItem",
        "autoContinue": True,
        "command": command,
        "doJumpId": number,
        "frame": FRAME_MISSION if command == DO_CHANGE_SPEED else FRAME_RELATIVE_ALTITUDE,
        "params": parameters,
    }
