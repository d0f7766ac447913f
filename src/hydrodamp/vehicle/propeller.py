"""A propeller on the x axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import Term
from hydrodamp.vehicle.actuation import Column, Limited
from hydrodamp.vehicle.checks import check_command, checked_number, checked_zone


@dataclass(frozen=True)
class Propeller(Limited):
    """A propeller on the x axis: thrust and torque with its speed n.

    X = thrust n|n| + advance u|n| and K = torque n|n|, and the surge speed that
    n sustains, u_c = speed_slope n + speed_offset, from which the propulsion
    ratio follows.

    Attributes
    ----------
    command : str
        Propeller speed n, in any unit: the gains are per that unit.
    thrust : float
        [N] per unit of n squared; positive drives forward.
    advance : float, optional
        [N s/m] per unit of n; negative where thrust falls with speed.
    torque : float, optional
        Reaction on the vehicle [N m] per unit of n squared.
    speed_slope, speed_offset : float, optional
        u_c per unit of n [m/s], and at n = 0 [m/s]; without a slope the
        propulsion ratio is unknown.
    limit : float, optional
        Largest speed either way, in the unit of n.
    name : str, optional
        Starts the name of the limited channel, ``<name>_limited``; the command
        if not given.
    dead_zone : tuple of two floats, optional
        Commands from the first to the second do not turn it, in the unit of n.

    Raises
    ------
    VehicleError
        If a number or a name cannot be.

    Examples
    --------
    >>> propeller = Propeller("rpm", thrust=3e-6, speed_slope=0.001)
    >>> propeller.propulsion_speed({"rpm": [1500.0]}).tolist()
    [1.5]
    """

    command: str
    thrust: float
    advance: float = 0.0
    torque: float = 0.0
    speed_slope: float | None = None
    speed_offset: float = 0.0
    limit: float | None = None
    name: str = ""
    dead_zone: Sequence[float] | None = None

    def __post_init__(self) -> None:
        """Check and freeze the fields."""
        check_command(self.command, self.name, self.limit)
        for field in ("thrust", "advance", "torque", "speed_offset"):
            checked_number(getattr(self, field), field)
        object.__setattr__(self, "dead_zone", checked_zone(self.dead_zone))
        if self.speed_slope is not None:
            checked_number(self.speed_slope, "speed_slope", positive=True)

    def columns(self) -> tuple[Column, ...]:
        """Return n|n| on X and K, and u|n| on X."""
        square = Term.parse(f"{self.channel}*|{self.channel}|")
        advance = Term.parse(f"u*|{self.channel}|")
        columns = (
            Column("X", square, self.thrust),
            Column("X", advance, self.advance),
            Column("K", square, self.torque),
        )
        return tuple(column for column in columns if column.value != 0.0)

    def propulsion_speed(self, commands: Mapping[str, FloatArray]) -> FloatArray | None:
        """Return u_c, the steady surge speed of the present n.

        Parameters
        ----------
        commands : mapping of str to ndarray, shape (n,)
            Must hold the propeller speed.

        Returns
        -------
        speed : ndarray, shape (n,), or None
            [m/s]; None where no ``speed_slope`` is known.
        """
        if self.speed_slope is None:
            return None
        return self.speed_slope * self.channels(commands)[self.channel] + self.speed_offset
