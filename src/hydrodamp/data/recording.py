"""Recordings as read from files: topics with fields, units and faults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import LogError, no_such


class Dates(NamedTuple):
    """Order of day and month in a column of dates; its seconds in the other order if possible.

    A column of times of day has no order.
    """

    order: str
    alternative: FloatArray | None


@dataclass(frozen=True, eq=False)
class Topic:
    """Messages of one kind from one source, a row each.

    Attributes
    ----------
    name : str
        Name in the file; empty if the file is one table.
    time : ndarray, shape (n,), or None
        When each message was recorded [s], on the clock of the file; None where only a
        mapping can say which field is the time.
    fields : mapping of str to ndarray, shape (n,)
        Numbers as in the file, by the path of the field, such as
        ``twist.linear.x`` or ``current[3]``; NaN where there is none.
    texts : mapping of str to tuple of str, length n
        Text fields.
    units : mapping of str to str
        Units as spelled in the file.
    faults : mapping of str to str
        The fault of a field. Such a field is not in ``fields``; an unused faulty column does
        not refuse the log.
    lines : sequence of int
        The line of the file of each row; empty where the file has no lines.
    dates : mapping of str to Dates
        The order of day and month of columns of dates where it matters, and times of day.
    standard_names : mapping of str to str
        Names of quantities by the CF conventions.

    Raises
    ------
    LogError
        If time, fields and texts differ in length.

    Examples
    --------
    >>> Topic("imu", time=[0.0, 0.1], fields={"gyro.z": [0.0, 0.2]}).n
    2
    """

    name: str
    time: FloatArray | None
    fields: Mapping[str, FloatArray]
    texts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    faults: Mapping[str, str] = field(default_factory=dict)
    lines: Sequence[int] = ()
    dates: Mapping[str, Dates] = field(default_factory=dict)
    standard_names: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Copy writable arrays."""
        if self.time is not None:
            object.__setattr__(self, "time", _read_only(self.time))
        numbers = {name: _read_only(values) for name, values in self.fields.items()}
        object.__setattr__(self, "fields", MappingProxyType(numbers))
        for name in ("texts", "units", "faults", "dates", "standard_names"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))
        columns: dict[str, Sequence[object] | FloatArray] = {**self.fields, **self.texts}
        if odd := [f"`{key}` {len(it)}" for key, it in columns.items() if len(it) != self.n]:
            raise LogError(
                f"topic `{self.name}` must have {self.n} values a field; got {', '.join(odd)}"
            )

    @property
    def n(self) -> int:
        """The number of messages."""
        if self.time is not None:
            return len(self.time)
        lengths = [*map(len, self.fields.values()), *map(len, self.texts.values())]
        return max(lengths, default=0)


@dataclass(frozen=True, eq=False)
class Recording:
    """Everything read from one or several files.

    Attributes
    ----------
    topics : tuple of Topic
        In the order of their names in the file.
    source : str
        The file or folder, for messages.
    format : str
        Which format it was read as, such as ``"ROS 2 bag (MCAP)"``.
    notes : tuple of str
        Irregularities that the reader tolerated.
    files : mapping of str to str
        The file of every topic, if each has its own; a star replaces the name of the run.

    Examples
    --------
    >>> imu = Topic("imu", [0.0, 0.1], {"gyro.z": [0.0, 0.2]})
    >>> log = Recording((imu,), "dive.bag", "ROS 1 bag")
    >>> log.topic("imu").fields["gyro.z"].tolist()
    [0.0, 0.2]
    """

    topics: tuple[Topic, ...]
    source: str
    format: str
    notes: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)

    def topic(self, name: str) -> Topic:
        """Return a topic by its name.

        Parameters
        ----------
        name : str
            As the file calls it.

        Returns
        -------
        topic : Topic
            The only one of that name.

        Raises
        ------
        LogError
            If there is none, naming the nearest.
        """
        for topic in self.topics:
            if topic.name == name:
                return topic
        known = [topic.name for topic in self.topics]
        raise LogError(no_such("topic", name, known), source=self.source)


def _read_only(values: FloatArray) -> FloatArray:
    """Return the array itself if it is flat, read-only and owns its data; else a copy."""
    known = isinstance(values, np.ndarray) and values.dtype == np.float64 and values.ndim == 1
    if known and values.flags.c_contiguous and values.flags.owndata and not values.flags.writeable:
        return values
    return frozen(values, (None,))
