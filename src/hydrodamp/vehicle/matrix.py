"""An actuator that is nothing but a table: command times wrench."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import Term
from hydrodamp.vehicle.actuation import Column, Rows, command_of, wrench_columns
from hydrodamp.vehicle.checks import checked_name, checked_table


@dataclass(frozen=True)
class Matrix:
    """A wrench proportional to each command: nothing but a table.

    Attributes
    ----------
    commands : tuple of str
        Names of the commands.
    wrench : tuple of tuples, one row of six a command
        X Y Z [N] and K M N [N m] per unit of the command, body frame.

    Raises
    ------
    VehicleError
        If the rows are not one of six numbers a command.

    Examples
    --------
    >>> Matrix(("surge_force",), [[1, 0, 0, 0, 0, 0]]).columns()[0].axis
    'X'
    """

    commands: tuple[str, ...]
    wrench: Rows

    def __post_init__(self) -> None:
        """Check and freeze the fields."""
        names = tuple(checked_name(name, "commands") for name in self.commands)
        rows = checked_table(self.wrench, (len(names), 6), "wrench")
        object.__setattr__(self, "commands", names)
        object.__setattr__(self, "wrench", rows)

    @property
    def derived(self) -> tuple[str, ...]:
        """No channel is computed."""
        return ()

    def channels(self, commands: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the commands as they are, each of shape (n,)."""
        return {name: command_of(commands, name) for name in self.commands}

    def columns(self) -> tuple[Column, ...]:
        """Return one term a command: the command itself."""
        pairs = zip(self.commands, self.wrench, strict=True)
        return tuple(c for name, row in pairs for c in wrench_columns(row, Term.parse(name)))
