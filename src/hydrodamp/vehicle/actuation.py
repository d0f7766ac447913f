"""What every actuator promises, and what they share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.basis.term import Term
from hydrodamp.errors import VehicleError, did_you_mean

Gains: TypeAlias = Mapping[str, float] | tuple[tuple[str, float], ...]
"""Axis -> number, given as a mapping and kept as pairs in the order of the axes."""

Rows: TypeAlias = Sequence[Sequence[float]]
"""A small table of numbers, kept as tuples."""


class Column(NamedTuple):
    """One entry of the known matrix: ``value`` times ``term`` acts on ``axis``."""

    axis: str
    term: Term
    value: float


class Actuator(Protocol):
    """Turns commands into a known wrench, linear in terms of the basis."""

    @property
    def commands(self) -> tuple[str, ...]:
        """Names of the commands it listens to."""
        ...

    @property
    def derived(self) -> tuple[str, ...]:
        """Names of the channels it computes; empty if it uses commands as they are."""
        ...

    def channels(self, commands: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return every channel that its columns use, raw or derived."""
        ...

    def columns(self) -> tuple[Column, ...]:
        """Return what it adds to the known wrench."""
        ...


class Limited:
    """What actuators share that use one command as it is, or within a limit."""

    command: str
    limit: float | None
    dead_zone: Sequence[float] | None
    name: str

    @property
    def commands(self) -> tuple[str, ...]:
        """The command it listens to."""
        return (self.command,)

    @property
    def derived(self) -> tuple[str, ...]:
        """The limited command, where there is a limit or a dead zone."""
        plain = self.limit is None and self.dead_zone is None
        return () if plain else (f"{self.name or self.command}_limited",)

    @property
    def channel(self) -> str:
        """The channel that its columns use."""
        return (self.derived or self.commands)[0]

    def channels(self, commands: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the command within its limit, zero in its dead zone, shape (n,)."""
        given = limited(command_of(commands, self.command), self.limit)
        return {self.channel: np.where(idle(given, self.dead_zone), 0.0, given)}


def command_of(commands: Mapping[str, FloatArray], name: str) -> FloatArray:
    """Return one command as an array."""
    if name not in commands:
        raise VehicleError(
            f"the vehicle's actuators need the command `{name}`; got "
            f"{', '.join(commands) or 'none'}.{did_you_mean(name, commands)}"
        )
    return np.asarray(commands[name], dtype=np.float64)


def limited(values: npt.ArrayLike, limit: float | None) -> FloatArray:
    """Return ``values`` clipped to plus or minus ``limit``."""
    array = np.asarray(values, dtype=np.float64)
    return array if limit is None else np.clip(array, -limit, limit)


def idle(values: npt.ArrayLike, dead_zone: Sequence[float] | None) -> BoolArray:
    """Return where a command has no effect."""
    given: FloatArray = np.asarray(values, dtype=np.float64)
    if dead_zone is None:
        return np.zeros(given.shape, dtype=np.bool_)
    low, high = dead_zone
    inside: BoolArray = (given >= low) & (given <= high)
    return inside


def wrench_columns(wrench: Iterable[float], term: Term) -> tuple[Column, ...]:
    """Return the columns of a whole wrench per unit of one term."""
    pairs = zip(AXES, wrench, strict=True)
    return tuple(Column(axis, term, float(value)) for axis, value in pairs if value != 0.0)
