"""A thruster at a place on the vehicle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import Term
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.actuation import Column, Rows, command_of, idle, limited, wrench_columns
from hydrodamp.vehicle.checks import check_command, checked_number, checked_table, checked_zone


@dataclass(frozen=True)
class Thruster:
    """A thruster at a place, along a direction, with a gain or a thrust curve.

    The command is limited, then turned into newtons; inside the dead zone there
    are none.

    Attributes
    ----------
    command : str
        In any unit.
    position : tuple of three floats
        Where it acts, from the origin, body frame (z down) [m].
    direction : tuple of three floats
        Where a positive thrust pushes the vehicle, body frame; normalised.
    gain : float, optional
        [N] per unit of the command.
    curve : table of (command, thrust [N]) rows, optional
        Such as pulse widths and newtons, as the maker measured them. Linear in between, so
        that a table that rises gives a thrust that rises, and constant beyond; commands
        increase. Instead of a gain.
    dead_zone : tuple of two floats, optional
        Commands from the first to the second give no thrust.
    limit : float, optional
        Largest command to either side.
    name : str, optional
        Starts the name of the channel, ``<name>_thrust``; the command if not
        given.

    Raises
    ------
    VehicleError
        If a number or a name cannot be, or not exactly one of ``gain`` and
        ``curve`` is given.

    Examples
    --------
    >>> thruster = Thruster("port", (0, -0.2, 0), (1, 0, 0), gain=40, dead_zone=(-0.1, 0.1))
    >>> thruster.channels({"port": [0.05, 0.5]})["port_thrust"].tolist()
    [0.0, 20.0]
    >>> [(axis, value) for axis, term, value in thruster.columns()]
    [('X', 1.0), ('N', 0.2)]
    """

    command: str
    position: Sequence[float]
    direction: Sequence[float]
    gain: float | None = None
    curve: Rows | None = None
    dead_zone: Sequence[float] | None = None
    limit: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        """Check and freeze the fields."""
        check_command(self.command, self.name, self.limit)
        if (self.gain is None) == (self.curve is None):
            raise VehicleError("a thruster needs either `gain` or `curve`; got both or neither")
        object.__setattr__(self, "position", checked_table(self.position, (3,), "position"))
        object.__setattr__(self, "direction", _unit(self.direction))
        if self.gain is not None:
            checked_number(self.gain, "gain")
        if self.curve is not None:
            object.__setattr__(self, "curve", _increasing(self.curve))
        object.__setattr__(self, "dead_zone", checked_zone(self.dead_zone))

    @property
    def commands(self) -> tuple[str, ...]:
        """The command it listens to."""
        return (self.command,)

    @property
    def derived(self) -> tuple[str, ...]:
        """The thrust [N], unless it is the command times a gain."""
        plain = self.curve is None and self.dead_zone is None and self.limit is None
        return () if plain else (f"{self.name or self.command}_thrust",)

    def channels(self, commands: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the thrust [N], or the command where a gain is all, shape (n,)."""
        given = command_of(commands, self.command)
        if not self.derived:
            return {self.command: given}
        return {self.derived[0]: self.thrust(given)}

    def columns(self) -> tuple[Column, ...]:
        """Return the force along the direction and its moment about the origin."""
        wrench = np.concatenate([self.direction, np.cross(self.position, self.direction)])
        if self.derived or self.gain is None:
            return wrench_columns(wrench, Term.parse(self.derived[0]))
        return wrench_columns(self.gain * wrench, Term.parse(self.command))

    def thrust(self, command: npt.ArrayLike) -> FloatArray:
        """Return the thrust of a command.

        Parameters
        ----------
        command : array_like, shape (n,)
            In the unit of the command.

        Returns
        -------
        thrust : ndarray, shape (n,)
            Along ``direction`` [N].
        """
        given = limited(command, self.limit)
        if self.curve is None:
            force = np.asarray(given * (self.gain or 0.0), dtype=np.float64)
        else:
            at, newtons = np.array(self.curve).T
            force = np.asarray(np.interp(given, at, newtons), dtype=np.float64)
        return np.where(idle(given, self.dead_zone), 0.0, force)


def _unit(direction: Sequence[float]) -> tuple[float, ...]:
    vector = np.array(checked_table(direction, (3,), "direction"))
    length = float(np.linalg.norm(vector))
    if length == 0.0:
        raise VehicleError("`direction` must not be zero; got (0, 0, 0)")
    if abs(length - 1.0) > 1e-12:
        vector = vector / length
    return tuple(float(part) for part in vector)


def _increasing(curve: Rows) -> tuple[tuple[float, ...], ...]:
    rows: tuple[tuple[float, ...], ...] = checked_table(curve, (None, 2), "curve")
    at = np.array(rows)[:, 0] if rows else np.zeros(0)
    if len(at) < 2 or not (np.diff(at) > 0.0).all():
        raise VehicleError(
            "`curve` must have at least two rows (command, thrust [N]) with increasing commands; "
            f"got commands {at.tolist()}"
        )
    return rows
