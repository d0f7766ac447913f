"""The log: measurements on one clock in SI units, split into segments."""

from __future__ import annotations

import dataclasses
import itertools
import textwrap
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data import attitude as attitudes
from hydrodamp.data.channels import BLOCKS, unit_of
from hydrodamp.data.checks import check_blocks, name_faults, record_faults, segment_faults
from hydrodamp.data.columns import make_dataframe, record_of_dataframe
from hydrodamp.data.measurement import Measurement, extract_measurements
from hydrodamp.data.record import (
    EPOCH_GAP_S,
    Record,
    Segment as Segment,
    consecutive_segments,
    matches_name,
    record_of_arrays,
    split_segments,
)
from hydrodamp.data.time_scale import motion_time_scale
from hydrodamp.errors import GapWarning, LogError, first_few, no_such, repr_html, warn

_ARRAYS = (*(block.name for block in BLOCKS), "commands")
_MAX_LISTED, _MAX_WIDTH = 12, 160  # lines and letters of each list in the text of a log


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Log:
    """A measured log: finite samples, time increasing within each segment.

    Body axes are x forward, y starboard, z down; the world is north-east-down.
    :meth:`from_arrays` takes gaps and NaN, :func:`hydrodamp.ingest.read.read_log` files.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Sample times [s]; the clock may restart at a segment.
    velocity : ndarray, shape (n, 6)
        Body velocity u v w [m/s] and p q r [rad/s], none beyond 50 in size; zero
        where not recorded.
    velocity_names : tuple of str
        The velocities recorded.
    attitude : ndarray, shape (n, 4), or None
        Unit quaternions ``(w, x, y, z)``, body to north-east-down.
    command_names : tuple of str
        Names of the columns of ``commands``.
    commands : ndarray, shape (n, m)
        Held from sample to sample.
    wrench : ndarray, shape (n, 6), or None
        Actuator force X Y Z [N] and moment K M N [N m] on the vehicle, body frame.
    acceleration : ndarray, shape (n, 6), or None
        Time derivative of ``velocity`` [m/s^2, rad/s^2]; a column of NaN was not recorded.
    propulsion_ratio : ndarray, shape (n,), or None
        Propulsion ratio [1]; in the paper eta-bar.
    position : ndarray, shape (n, 3), or None
        Of the reference point, north, east, down [m].
    specific_force : ndarray, shape (n, 3), or None
        Acceleration less gravity, as an accelerometer measures it, body frame
        [m/s^2]: (0, 0, -9.81) at rest and level.
    measurements : tuple of Measurement
        Sensors at their own times.
    segments : tuple of Segment
        They cover all samples in order; one segment where none is given.
    source : str
        Source of the log, for messages.
    notes : tuple of str
        Processing steps applied to the measurements, in order.

    Raises
    ------
    LogError
        With all faults.

    Examples
    --------
    >>> log = Log(time=[0.0, 0.1, 0.2], velocity=np.ones((3, 6)))
    >>> log.n, log.duration, [segment.name for segment in log.segments]
    (3, 0.2, ['1'])
    """

    time: FloatArray
    velocity: FloatArray
    velocity_names: tuple[str, ...] = VELOCITIES
    attitude: FloatArray | None = None
    command_names: tuple[str, ...] = ()
    commands: FloatArray = dataclasses.field(default_factory=lambda: np.empty((0, 0)))
    wrench: FloatArray | None = None
    acceleration: FloatArray | None = None
    propulsion_ratio: FloatArray | None = None
    position: FloatArray | None = None
    specific_force: FloatArray | None = None
    measurements: tuple[Measurement, ...] = ()
    segments: tuple[Segment, ...] = ()
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Copy and check the arrays."""
        blocks, faults = check_blocks({name: getattr(self, name) for name in _ARRAYS})
        values: dict[str, Any] = {**blocks}
        for name in ("velocity_names", "command_names", "notes", "segments", "measurements"):
            values[name] = tuple(getattr(self, name))
        values["segments"] = values["segments"] or (Segment("1", 0, np.size(self.time)),)
        if not faults:
            faults += segment_faults(values["time"], values["segments"])
            width = values["commands"].shape[1]
            faults += name_faults(values["velocity_names"], values["command_names"], width)
        if faults:
            raise LogError(faults, source=self.source)
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @classmethod
    def from_arrays(
        cls,
        time: npt.ArrayLike,
        velocity: npt.ArrayLike | Mapping[str, npt.ArrayLike],
        *,
        attitude: npt.ArrayLike | None = None,
        commands: Mapping[str, npt.ArrayLike] | None = None,
        wrench: npt.ArrayLike | None = None,
        acceleration: npt.ArrayLike | None = None,
        propulsion_ratio: npt.ArrayLike | None = None,
        position: npt.ArrayLike | None = None,
        specific_force: npt.ArrayLike | None = None,
        segment: Sequence[object] | None = None,
        source: str = "",
    ) -> Log:
        """Return the log of arrays that may have gaps and missing samples.

        Parameters
        ----------
        time : array_like, shape (n,)
            Sample times [s].
        velocity : array_like, shape (n, 6), or dict of name to array_like, shape (n,)
            Body velocity u v w [m/s] and p q r [rad/s]; a dict may lack some.
        attitude : array_like, shape (n, 4) or (n, 3), optional
            Quaternions ``(w, x, y, z)``, or roll, pitch, yaw [rad].
        commands : dict of name to array_like, shape (n,), optional
            Command channels.
        wrench : array_like, shape (n, 6), optional
            Actuator force X Y Z [N] and moment K M N [N m], body frame.
        acceleration : array_like, shape (n, 6), optional
            Body acceleration [m/s^2, rad/s^2]; a column of NaN was not recorded.
        propulsion_ratio : array_like, shape (n,), optional
            Propulsion ratio [1].
        position : array_like, shape (n, 3), optional
            North, east, down [m].
        specific_force : array_like, shape (n, 3), optional
            Acceleration less gravity, body frame [m/s^2].
        segment : sequence, optional
            The segment of each sample; a change is a join.
        source : str, optional
            Where they came from.

        Returns
        -------
        log : Log
            Split at joins, at gaps and where a value is NaN, with one GapWarning.

        Raises
        ------
        LogError
            With all faults.

        Examples
        --------
        >>> log = Log.from_arrays(
        ...     [0.0, 0.1, 0.0, 0.1], {"u": [1.0, 1.1, 1.0, 0.9]}, segment=["a", "a", "b", "b"]
        ... )
        >>> [segment.name for segment in log.segments], log.velocity_names
        (['a', 'b'], ('u',))
        """
        optional_blocks = (acceleration, propulsion_ratio, wrench, position, specific_force)
        names = (block.name for block in BLOCKS)
        arrays = dict(zip(names, (time, attitude, velocity, *optional_blocks), strict=True))
        return cls.from_record(record_of_arrays(arrays, commands or {}, segment, source))

    @classmethod
    def from_dataframe(cls, frame: Any, source: str = "") -> Log:
        """Return the log of a pandas DataFrame in the canonical form.

        Of an xarray Dataset along time, give ``dataset.to_dataframe()``.

        Parameters
        ----------
        frame : DataFrame
            Canonical columns in SI units: ``u v w p q r``, ``roll pitch yaw`` or ``qw qx qy qz``,
            ``X Y Z K M N``, ``segment``; any other is a command. The times are the column
            ``time``, or else the index: seconds, datetimes (UTC without a time zone), or
            time differences.
        source : str, optional
            Where the data came from.

        Returns
        -------
        log : Log
            Split as by :meth:`from_arrays`.

        Raises
        ------
        LogError
            With all faults of columns, names and values.
        """
        return cls.from_record(record_of_dataframe(frame, source))

    def to_dataframe(self) -> Any:
        """Return the log as a pandas DataFrame in the canonical form.

        Returns
        -------
        frame : DataFrame
            Indexed by ``time`` [s]; columns in SI units as :func:`hydrodamp.write_log` writes
            them, and the ``segment`` of each sample. Sensors at their own times are left out.

        Raises
        ------
        HydrodampError
            If pandas is not installed.
        """
        labels = np.array([segment.name for segment in self.segments])[self.segment_numbers]
        return make_dataframe(columns_of(self) | {"segment": labels}).set_index("time")

    @classmethod
    def from_record(cls, record: Record) -> Log:
        """Return the log of a recording, split at its joins, gaps and missing samples."""
        if faults := record_faults(record):
            raise LogError(faults, source=record.source)
        keep, segments, notes = split_segments(record)
        if not segments:
            empty = "no two neighbouring samples have all their values"
            raise LogError([empty, *notes], source=record.source)
        log = cls(**record.log_fields(keep), segments=segments)
        if not notes:
            return log
        cut = "; ".join(notes)
        if len(segments) > np.count_nonzero(record.joins):
            cut = f"split into {len(segments)} segments: {cut}"
        warn(f"{record.source or 'log'}: {cut}", GapWarning, stacklevel=3)
        return log.with_notes(cut)

    def with_notes(self, *notes: str) -> Log:
        """Return the same log with notes appended."""
        return dataclasses.replace(self, notes=(*self.notes, *notes))

    @property
    def n(self) -> int:
        """The number of samples."""
        return len(self.time)

    @property
    def bounds(self) -> IntArray:
        """First and one-past-last sample of each segment, shape (s, 2)."""
        return np.array([(each.start, each.stop) for each in self.segments], dtype=np.int64)

    @property
    def segment_numbers(self) -> IntArray:
        """Index of the segment of each sample, shape (n,)."""
        return np.repeat(np.arange(len(self.segments)), np.diff(self.bounds, axis=1).ravel())

    @cached_property
    def steps(self) -> FloatArray:
        """Time from sample to sample within segments [s], shape (n - s,)."""
        return frozen(np.concatenate([np.diff(self.time[a:b]) for a, b in self.bounds]))

    @cached_property
    def time_scale(self) -> float:
        """Correlation time of the velocities [s]; a median step where nothing moves."""
        return motion_time_scale(self.time, self.velocity, self.bounds)

    @property
    def sample_rate(self) -> float:
        """The inverse of the median step [Hz]; NaN for one sample."""
        return 1.0 / float(np.median(self.steps)) if len(self.steps) else np.nan

    @property
    def duration(self) -> float:
        """The time recorded, summed over segments [s]."""
        return float(sum(self.time[stop - 1] - self.time[start] for start, stop in self.bounds))

    @cached_property
    def down(self) -> FloatArray:
        """The world's downward direction in the body, R^T e3, shape (n, 3); level if unknown."""
        if self.attitude is None:
            return frozen(np.tile((0.0, 0.0, 1.0), (self.n, 1)))
        return frozen(attitudes.down_vectors(self.attitude))

    @cached_property
    def elapsed(self) -> FloatArray:
        """Time since the first sample [s], shape (n,); runs on where a clock restarts or leaps."""
        count = self.time - self.time[0]
        for before, segment in itertools.pairwise(self.segments):
            if not 0.0 < self.time[segment.start] - self.time[segment.start - 1] <= EPOCH_GAP_S:
                step = np.median(np.diff(self.time[before.start : before.stop]))
                count[segment.start :] += count[segment.start - 1] + step - count[segment.start]
        return frozen(count)

    def command(self, name: str) -> FloatArray:
        """Return one command channel.

        Parameters
        ----------
        name : str
            The channel's name.

        Returns
        -------
        values : ndarray, shape (n,)
            As recorded.

        Raises
        ------
        LogError
            If there is none of this name.
        """
        if name not in self.command_names:
            raise LogError(no_such("command", name, self.command_names), source=self.source)
        return self.commands[:, self.command_names.index(name)]

    def between(self, start: float, end: float) -> Log:
        """Return the samples of a time span.

        Parameters
        ----------
        start, end : float
            Seconds counted from the first sample of the log, see :attr:`elapsed`;
            ``start`` is included, ``end`` is not.

        Returns
        -------
        log : Log
            Its segments keep their names; those cut to one sample are left out.

        Raises
        ------
        LogError
            If no two neighbouring samples lie in the span.

        Examples
        --------
        >>> log = Log(time=np.arange(10.0), velocity=np.ones((10, 6)))
        >>> log.between(2, 5).time.tolist()
        [2.0, 3.0, 4.0]
        """
        first, last = np.searchsorted(self.elapsed, (start, end)).tolist()
        cut = [
            Segment(item.name, max(item.start, first), min(item.stop, last))
            for item in self.segments
        ]
        if pieces := [segment for segment in cut if segment.stop - segment.start >= 2]:
            return extract_segments(self, pieces)
        fault = (
            f"no two samples lie between {start:g} s and {end:g} s; the log spans 0 s to"
            f" {self.elapsed[-1]:.6g} s, counted from its first sample at {self.time[0]:.3f} s by"
            " its clock"
        )
        raise LogError(fault, source=self.source)

    def select(self, *names: str) -> Log:
        """Return the segments of the given names, in the order given.

        Parameters
        ----------
        *names : str
            Segment names; the pieces of a segment that was cut at gaps
            (``dive.1``, ``dive.2``) also answer to its own name (``dive``).

        Returns
        -------
        log : Log
            These segments only.

        Raises
        ------
        LogError
            If a name is unknown, or none is given.

        Examples
        --------
        >>> log = Log.from_arrays([0, 1, 0, 1], {"u": [1, 1, 2, 2]}, segment="aabb")
        >>> log.select("b").velocity[:, 0].tolist()
        [2.0, 2.0]
        """
        known = [segment.name for segment in self.segments]
        faults = [] if names else [f"name at least one segment of: {' '.join(known)}"]
        pieces: dict[str, Segment] = {}
        for name in names:
            matches = [item for item in self.segments if matches_name(item.name, name)]
            pieces |= {segment.name: segment for segment in matches}
            faults += [] if matches else [no_such("segment", name, known)]
        if faults:
            raise LogError(faults, source=self.source)
        return extract_segments(self, [*pieces.values()])

    _repr_html_ = repr_html

    def __repr__(self) -> str:
        """Return one line."""
        return f"<Log {self.source or 'of arrays'}: {self.n} samples, {self.duration:.6g} s>"

    def __str__(self) -> str:
        """Return a summary: span, columns, ranges and segments."""
        blocks, elapsed = recorded_arrays(self), self.elapsed
        more = [block.name.replace("_", " ") for block in BLOCKS[1:] if block.name in blocks]
        velocities = recorded_velocities(self).items()
        commands = zip(self.command_names, self.commands.T, strict=True)
        segments = [
            f"{item.name:<18} {len(item):>7} {elapsed[item.start]:>9.2f}"
            f" {elapsed[item.stop - 1]:>9.2f} {self.time[item.start]:>16.3f}"
            for item in self.segments
        ]
        ranges = [_format_range(name, values) for name, values in commands]
        notes = [textwrap.shorten(note, _MAX_WIDTH) for note in self.notes]
        lines = [
            f"Log {self.source or 'of arrays'}",
            f"{self.n} samples, {self.steps.sum():.6g} s, segments: {len(self.segments)},"
            f" median step {np.median(self.steps):.4g} s",
            f"with {', '.join(more)}",
            *(_format_range(name, values, f" {unit_of(name)}") for name, values in velocities),
            *first_few(ranges, _MAX_LISTED, "commands"),
            "segment            samples  from [s]    to [s]  by the clock [s]",
            *first_few(segments, _MAX_LISTED, "segments"),
            *(["processing:"] if self.notes else []),
            *first_few(notes, _MAX_LISTED, "notes"),
        ]
        return "\n  ".join(lines)


def _format_range(name: str, values: FloatArray, unit: str = "") -> str:
    return f"{name:<14} {values.min():>10.4g} .. {values.max():<10.4g}{unit}".rstrip()


def recorded_velocities(log: Log) -> dict[str, FloatArray]:
    """Return the velocities recorded, by their names."""
    return {name: log.velocity[:, VELOCITIES.index(name)] for name in log.velocity_names}


def columns_of(log: Log) -> dict[str, FloatArray]:
    """Return the columns of a log by name, without velocities not recorded."""
    columns: dict[str, FloatArray] = {}
    for block in BLOCKS:
        values = getattr(log, block.name)
        if values is not None:
            columns |= dict(zip(block.columns, values.reshape(log.n, -1).T, strict=True))
    for name in VELOCITIES:
        if name not in log.velocity_names:
            del columns[name]
            columns.pop(f"d{name}", None)
        elif np.isnan(columns.get(f"d{name}", 0.0)).all():
            columns.pop(f"d{name}", None)
    return columns | dict(zip(log.command_names, log.commands.T, strict=True))


def extract_segments(log: Log, pieces: Sequence[Segment], every: int = 1) -> Log:
    """Return the log of given pieces, each a segment, or of every k-th sample of these."""
    rows = [np.arange(piece.start, piece.stop, every) for piece in pieces]
    segments = consecutive_segments((piece.name for piece in pieces), map(len, rows))
    index = np.concatenate(rows)
    blocks: dict[str, Any] = {name: block[index] for name, block in recorded_arrays(log).items()}
    measurements = extract_measurements(log.measurements, log.time, log.segments, pieces)
    return dataclasses.replace(log, **blocks, segments=segments, measurements=measurements)


def recorded_arrays(log: Log) -> dict[str, FloatArray]:
    """Return the arrays that a log has, commands included."""
    blocks = {name: getattr(log, name) for name in _ARRAYS}
    return {name: block for name, block in blocks.items() if block is not None}
