"""The log: what was measured on one clock, in SI units, split in segments."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data import attitude as attitudes, stretches
from hydrodamp.data.blocks import BLOCKS, freeze, name_faults, segment_faults
from hydrodamp.data.checks import faults_of
from hydrodamp.data.record import Record
from hydrodamp.data.segments import Segment, name_after, split
from hydrodamp.data.stretches import concatenate
from hydrodamp.data.summary import summary
from hydrodamp.errors import GapWarning, LogError

__all__ = ["Log", "Segment", "concatenate"]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Log:
    """A measured log: finite samples, time increasing within each segment.

    Body axes are x forward, y starboard, z down; the world is north-east-down.
    Use :meth:`from_arrays` for arrays that may have gaps or NaN, and
    :func:`hydrodamp.ingest.read.read_log` for files.

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
        What the columns of ``commands`` are called.
    commands : ndarray, shape (n, m)
        Held from sample to sample.
    wrench : ndarray, shape (n, 6), or None
        Actuator force X Y Z [N] and moment K M N [N m] on the vehicle, body frame.
    acceleration : ndarray, shape (n, 6), or None
        Time derivative of ``velocity`` [m/s^2, rad/s^2].
    propulsion_ratio : ndarray, shape (n,), or None
        Propulsion ratio [1]; in the paper eta-bar.
    position : ndarray, shape (n, 3), or None
        Of the reference point, north, east, down [m].
    specific_force : ndarray, shape (n, 3), or None
        Acceleration less gravity, as an accelerometer measures it, body frame
        [m/s^2]: (0, 0, -9.81) at rest and level.
    segments : tuple of Segment
        They cover all samples in order; one segment where none is given.
    source : str
        Where the log came from, for messages.
    notes : tuple of str
        What was done to the measurements, a sentence each, in order.

    Raises
    ------
    LogError
        With everything that is wrong.

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
    segments: tuple[Segment, ...] = ()
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Copy the arrays at the door and check them."""
        blocks, faults = freeze({name: getattr(self, name) for name in BLOCKS})
        values: dict[str, Any] = {**blocks}
        values["velocity_names"] = tuple(self.velocity_names)
        values["command_names"] = tuple(self.command_names)
        values["notes"] = tuple(self.notes)
        values["segments"] = tuple(self.segments) or (Segment("1", 0, np.size(self.time)),)
        if not faults:
            faults += segment_faults(values["time"], values["segments"])
            faults += name_faults(
                values["velocity_names"], values["command_names"], values["commands"].shape[1]
            )
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
            Body acceleration [m/s^2, rad/s^2].
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
            If a shape, the clock, a quaternion or the unit of the rates is wrong, or
            a velocity is beyond 50 in size.

        Examples
        --------
        >>> log = Log.from_arrays(
        ...     [0.0, 0.1, 0.0, 0.1], {"u": [1.0, 1.1, 1.0, 0.9]}, segment=["a", "a", "b", "b"]
        ... )
        >>> [segment.name for segment in log.segments], log.velocity_names
        (['a', 'b'], ('u',))
        """
        return cls.from_record(
            Record.from_arrays(
                time,
                velocity,
                attitude=attitude,
                commands=commands or {},
                wrench=wrench,
                acceleration=acceleration,
                propulsion_ratio=propulsion_ratio,
                position=position,
                specific_force=specific_force,
                segment=segment,
                source=source,
            )
        )

    @classmethod
    def from_record(cls, record: Record) -> Log:
        """Return the log of a recording, split at its joins, gaps and missing samples.

        Parameters
        ----------
        record : Record
            What was recorded.

        Returns
        -------
        log : Log
            Without missing samples; segments without labels are named after the source.

        Raises
        ------
        LogError
            With every fault of the recording.

        Warns
        -----
        GapWarning
            Once, if anything but a change of label cuts the recording.
        """
        if faults := faults_of(record):
            raise LogError(faults, source=record.source)
        parts = split(record, name_after(record.source))
        if not parts.segments:
            empty = "no two neighbouring samples have all their values"
            raise LogError([empty, *parts.notes], source=record.source)
        if parts.notes:
            warnings.warn(f"{record.source or 'log'}: {parts.told}", GapWarning, stacklevel=3)
        log = cls(**record.columns(parts.keep), segments=parts.segments, source=record.source)
        return log.noted(parts.told) if parts.notes else log

    def noted(self, *notes: str) -> Log:
        """Return the same log with sentences on what was done to it.

        Parameters
        ----------
        *notes : str
            One sentence each.

        Returns
        -------
        log : Log
            With the notes after those it had.
        """
        return dataclasses.replace(self, notes=(*self.notes, *notes))

    @property
    def n(self) -> int:
        """The number of samples."""
        return len(self.time)

    @property
    def bounds(self) -> IntArray:
        """First and one-past-last sample of each segment, shape (s, 2)."""
        return np.array([(part.start, part.stop) for part in self.segments], dtype=np.int64)

    @property
    def duration(self) -> float:
        """The time recorded, summed over segments [s]."""
        return float(sum(self.time[stop - 1] - self.time[start] for start, stop in self.bounds))

    @cached_property
    def down(self) -> FloatArray:
        """The world's downward direction in the body, R^T e3, shape (n, 3); level if unknown."""
        if self.attitude is None:
            return frozen(np.tile((0.0, 0.0, 1.0), (self.n, 1)))
        return frozen(attitudes.down(self.attitude))

    @cached_property
    def elapsed(self) -> FloatArray:
        """Time since the first sample [s], shape (n,); runs on where a clock restarts."""
        return frozen(stretches.elapsed(self.time, self.segments))

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
        return self.commands[:, stretches.command_index(self, name)]

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
        return stretches.take(self, stretches.spanned(self, start, end))

    def select(self, *names: str) -> Log:
        """Return the segments of the given names, in the order given.

        Parameters
        ----------
        *names : str
            Segment names; the pieces of a segment that fell apart at gaps
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
        return stretches.take(self, stretches.named(self, names))

    def __repr__(self) -> str:
        """Return one line."""
        return f"<Log {self.source or 'of arrays'}: {self.n} samples, {self.duration:.6g} s>"

    def __str__(self) -> str:
        """Return what the log holds, on one screen."""
        return summary(self)
