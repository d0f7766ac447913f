"""Measurements of a sensor at its own times, independent of the samples of a log."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.errors import LogError

if TYPE_CHECKING:
    from hydrodamp.data.record import Segment

#: Components of each kind of measurement.
KINDS: dict[str, tuple[str, ...]] = {
    "position": ("north", "east", "down"),
    "velocity": ("u", "v", "w"),
    "ground_velocity": ("u", "v", "w"),
    "rates": ("p", "q", "r"),
    "attitude": ("roll", "pitch", "yaw"),
    "specific_force": ("x", "y", "z"),
}

#: Unit of each kind.
KIND_UNITS = {
    "position": "m",
    "velocity": "m/s",
    "ground_velocity": "m/s",
    "rates": "rad/s",
    "attitude": "rad",
    "specific_force": "m/s^2",
}

#: Nuisance parameters that an estimator can add to a measurement.
NUISANCE = ("bias", "delay", "lever_arm", "current")

_MAX_ANGLE = 100.0  # rad of an unwrapped angle; degrees pass it soon


@dataclass(frozen=True, eq=False)
class Measurement:
    """Measurements of one sensor at its own times.

    Attributes
    ----------
    name : str
        Name in messages, such as ``usbl``.
    kind : str
        ``position`` (north, east, down [m]; depth is down), ``velocity`` (u, v, w [m/s], body
        frame, that of the equation of motion), ``ground_velocity`` (the same over ground),
        ``rates`` (p, q, r [rad/s], body frame), ``attitude`` (roll, pitch, yaw [rad]; heading is
        yaw) or ``specific_force`` (x, y, z [m/s^2], body frame: (0, 0, -9.81) at rest and level).
    time : ndarray, shape (m,)
        [s], on the clock of the log, increasing within a segment.
    values : ndarray, shape (m, k)
        NaN where a component was not measured.
    components : tuple of str
        Names of the columns of ``values``; all components of the kind by default.
    std : ndarray, shape (k,), or None
        Standard deviation of the noise; None to estimate it from the data.
    segment : ndarray of int, shape (m,)
        Index of the segment of the log; the first by default.
    delay : float
        Time from the motion to its time stamp [s].
    lever_arm : ndarray, shape (3,)
        Position of the sensor in the body frame [m].
    estimate : tuple of str
        Parameters to estimate: ``bias``, ``delay``, ``lever_arm`` or ``current``.

    Raises
    ------
    LogError
        With all faults.

    Examples
    --------
    >>> fixes = Measurement("gps", "position", [0.0, 1.0], [[0.0, 0.0], [0.5, 0.1]],
    ...                     components=("north", "east"), std=[0.5, 0.5])
    >>> fixes.n, fixes.components
    (2, ('north', 'east'))
    """

    name: str
    kind: str
    time: FloatArray
    values: FloatArray
    components: tuple[str, ...] = ()
    std: FloatArray | None = None
    segment: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    delay: float = 0.0
    lever_arm: FloatArray = field(default_factory=lambda: np.zeros(3))
    estimate: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Copy and check the arrays."""
        if faults := list(self._faults()):
            raise LogError(faults)
        time = frozen(np.atleast_1d(np.asarray(self.time, dtype=np.float64)))
        segment = self.segment if np.size(self.segment) else np.zeros(len(time), dtype=np.int64)
        settings = {
            "time": time,
            "values": frozen(
                np.reshape(np.asarray(self.values, dtype=np.float64), (len(time), -1))
            ),
            "components": tuple(self.components) or KINDS[self.kind],
            "std": None if self.std is None else frozen(np.asarray(self.std, dtype=np.float64)),
            "segment": np.asarray(segment, dtype=np.int64),
            "lever_arm": frozen(np.asarray(self.lever_arm, dtype=np.float64)),
            "estimate": tuple(self.estimate),
        }
        for key, value in settings.items():
            object.__setattr__(self, key, value)

    def _faults(self) -> Iterator[str]:
        name = f"sensor `{self.name}`"
        if self.kind not in KINDS:
            yield f"{name}: `kind` must be one of {', '.join(KINDS)}; got '{self.kind}'"
            return
        known = KINDS[self.kind]
        components = tuple(self.components) or known
        if not set(components) <= set(known) or len(set(components)) < len(components):
            yield f"{name}: a {self.kind} has the components {' '.join(known)}; got {components}"
            return
        time = np.atleast_1d(np.asarray(self.time, dtype=np.float64))
        values = np.asarray(self.values, dtype=np.float64)
        if time.ndim != 1 or not len(time) or not np.all(np.isfinite(time)):
            yield f"{name} needs a finite time [s] for each measurement; got shape {time.shape}"
            return
        if values.size != len(time) * len(components):
            yield (
                f"{name}: `values` must have {len(time)} rows (one a time) and {len(components)} "
                f"columns; got shape {values.shape}"
            )
            return
        if not np.isfinite(values).any():
            yield f"{name} has no finite value"
        if self.kind == "attitude" and np.nanmax(np.abs(values), initial=0.0) > _MAX_ANGLE:
            yield f"{name}: angles must be in rad; got up to {np.nanmax(np.abs(values)):.4g}"
        if self.std is not None:
            std = np.asarray(self.std, dtype=np.float64)
            if std.shape != (len(components),) or not np.all(std > 0.0):
                yield f"{name}: `std` must be {len(components)} positive numbers; got {std}"
        if np.size(self.segment) not in (0, len(time)):
            yield f"{name}: `segment` must have one index a time; got {np.size(self.segment)}"
        if not np.isfinite(self.delay):
            yield f"{name}: `delay` must be finite [s]; got {self.delay}"
        if np.shape(self.lever_arm) != (3,) or not np.all(np.isfinite(self.lever_arm)):
            yield f"{name}: `lever_arm` must be x y z [m]; got {self.lever_arm}"
        if unknown := set(self.estimate) - set(NUISANCE):
            yield f"{name}: `estimate` takes {', '.join(NUISANCE)}; got {', '.join(unknown)}"

    @property
    def n(self) -> int:
        """The number of times."""
        return len(self.time)

    @property
    def rate(self) -> float:
        """The inverse of the median interval [Hz]; NaN for one time."""
        steps = np.diff(self.time)[np.diff(self.segment) == 0]
        return 1.0 / float(np.median(steps)) if len(steps) else np.nan

    def select(self, rows: IntArray, segment: IntArray | None = None) -> Measurement:
        """Return some of the measurements, optionally with other indices of segments."""
        chosen = self.segment[rows] if segment is None else segment
        return replace(self, time=self.time[rows], values=self.values[rows], segment=chosen)


def extract_measurements(
    measurements: Sequence[Measurement],
    time: FloatArray,
    segments: Sequence[Segment],
    pieces: Sequence[Segment],
) -> tuple[Measurement, ...]:
    """Return the measurements in pieces (parts of segments) of a log, numbered by piece."""
    starts = np.array([segment.start for segment in segments])
    extracted = []
    for measurement in measurements:
        rows, numbers = [], []
        for number, piece in enumerate(pieces):
            origin = int(np.searchsorted(starts, piece.start, side="right")) - 1
            moment = measurement.time - measurement.delay
            inside = (measurement.segment == origin) & (moment >= time[piece.start])
            piece_rows = np.flatnonzero(inside & (moment <= time[piece.stop - 1]))
            rows.append(piece_rows)
            numbers.append(np.full(len(piece_rows), number))
        chosen = np.concatenate(rows)
        if len(chosen):
            extracted.append(measurement.select(chosen, np.concatenate(numbers)))
    return tuple(extracted)


def concatenate_measurements(
    groups: Sequence[tuple[Sequence[Measurement], int]],
) -> tuple[Measurement, ...]:
    """Return the measurements of successive logs, each with its number of segments, by name."""
    merged: dict[str, list[Measurement]] = {}
    offset = 0
    for measurements, n_segments in groups:
        for each in measurements:
            merged.setdefault(each.name, []).append(replace(each, segment=each.segment + offset))
        offset += n_segments
    return tuple(
        replace(
            same[0],
            time=np.concatenate([each.time for each in same]),
            values=np.concatenate([each.values for each in same]),
            segment=np.concatenate([each.segment for each in same]),
        )
        for same in merged.values()
    )
