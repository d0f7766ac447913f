"""A control surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hydrodamp.basis.term import Term
from hydrodamp.vehicle.actuation import Column, Gains, Limited
from hydrodamp.vehicle.checks import check_command, checked_gains, checked_zone


@dataclass(frozen=True)
class Fin(Limited):
    """A control surface: force with u|u| and its angle, drag with the angle squared.

    Attributes
    ----------
    command : str
        The deflection [rad].
    force : mapping of axis to float
        N or N m per (m/s)^2 and rad, on u|u|*command; SNAME's Y_uud, N_uud.
    drag : mapping of axis to float, optional
        N or N m per (m/s)^2 and rad^2, on u|u|*command^2; X_uudd, negative.
    limit : float, optional
        Largest deflection to either side [rad].
    name : str, optional
        Starts the name of the limited channel, ``<name>_limited``; the command
        if not given.
    dead_zone : tuple of two floats, optional
        Deflections from the first to the second do nothing, as where a linkage has play
        [rad].

    Raises
    ------
    VehicleError
        If an axis, a number or a name cannot be.

    Examples
    --------
    >>> fin = Fin("rudder", {"Y": 9.64, "N": -6.15}, limit=0.35)
    >>> [(axis, str(term)) for axis, term, value in fin.columns()]
    [('Y', 'u|u|*rudder_limited'), ('N', 'u|u|*rudder_limited')]
    """

    command: str
    force: Gains
    drag: Gains = ()
    limit: float | None = None
    name: str = ""
    dead_zone: Sequence[float] | None = None

    def __post_init__(self) -> None:
        """Check and freeze the fields."""
        check_command(self.command, self.name, self.limit)
        object.__setattr__(self, "force", checked_gains(self.force, "force"))
        object.__setattr__(self, "dead_zone", checked_zone(self.dead_zone))
        object.__setattr__(self, "drag", checked_gains(self.drag, "drag"))

    def columns(self) -> tuple[Column, ...]:
        """Return u|u|*angle and u|u|*angle^2 on the axes given."""
        force = Term.parse(f"u|u|*{self.channel}")
        drag = Term.parse(f"u|u|*{self.channel}^2")
        return tuple(
            Column(axis, force, value) for axis, value in dict(self.force).items()
        ) + tuple(Column(axis, drag, value) for axis, value in dict(self.drag).items())
