"""What turns commands into a known wrench: a plain matrix, fins, propellers, thrusters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar, TypeAlias

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES, Term, check_command_name
from hydrodamp.errors import TermError, VehicleError, did_you_mean
from hydrodamp.vehicle.mass import checked_array

#: Axis -> number, given as a mapping and kept as pairs in the order of the axes.
Gains: TypeAlias = Mapping[str, float] | tuple[tuple[str, float], ...]

#: A small table of numbers, kept as tuples.
Rows: TypeAlias = Sequence[Sequence[float]]

#: Terms, each with the wrench X Y Z K M N that it makes per unit, shape (6,).
Columns: TypeAlias = tuple[tuple[Term, FloatArray], ...]


@dataclass(frozen=True)
class Limited:
    """What actuators share that use one command as it is, or within a limit."""

    command: str
    limit: float | None = field(default=None, kw_only=True)
    dead_zone: Sequence[float] | None = field(default=None, kw_only=True)
    name: str = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        """Check and freeze the fields."""
        for name, check in _CHECKS.items():
            value = getattr(self, name, None)
            if value is not None and (name != "name" or value):
                object.__setattr__(self, name, check(value, name))

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
        """Return what the command does within its limit, nothing in its dead zone, shape (n,)."""
        value = command_of(commands, self.command)
        if not self.derived:
            return {self.command: value}
        if self.limit is not None:
            # `np.clip` takes three times as long for one sample.
            value = np.minimum(np.maximum(value, -self.limit), self.limit)
        done = self.acting(value)
        if self.dead_zone is not None:
            low, high = self.dead_zone
            done = np.where((value >= low) & (value <= high), 0.0, done)
        return {self.channel: done}

    def acting(self, given: FloatArray) -> FloatArray:
        """Return what a command within its limit does."""
        return given


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
    >>> term, wrench = Matrix(("surge_force",), [[1, 0, 0, 0, 0, 0]]).regressor_terms()[0]
    >>> str(term), wrench.tolist()
    ('surge_force', [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    """

    commands: tuple[str, ...]
    wrench: Rows
    derived: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        """Check and freeze the fields."""
        names = tuple(checked_name(name, "commands") for name in self.commands)
        rows = checked_table(self.wrench, (len(names), 6), "wrench")
        object.__setattr__(self, "commands", names)
        object.__setattr__(self, "wrench", rows)

    def channels(self, commands: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the commands as they are, each of shape (n,)."""
        return {name: command_of(commands, name) for name in self.commands}

    def regressor_terms(self) -> Columns:
        """Return one term a command: the command itself."""
        pairs = zip(self.commands, self.wrench, strict=True)
        return tuple((Term.parse(name), np.array(row)) for name, row in pairs)


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
    >>> [(str(term), wrench.tolist()) for term, wrench in fin.regressor_terms()][0]
    ('u|u|*rudder_limited', [0.0, 9.64, 0.0, 0.0, 0.0, -6.15])
    """

    force: Gains
    drag: Gains = ()

    def regressor_terms(self) -> Columns:
        """Return u|u|*angle and u|u|*angle^2 on the axes given."""
        lift = Term.parse(f"u|u|*{self.channel}")
        return (lift, wrench_of(self.force)), (Term.parse(f"{lift}^2"), wrench_of(self.drag))


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

    thrust: float
    advance: float = 0.0
    torque: float = 0.0
    speed_slope: float | None = None
    speed_offset: float = 0.0

    def regressor_terms(self) -> Columns:
        """Return n|n| on X and K, and u|n| on X."""
        square = Term.parse(f"{self.channel}*|{self.channel}|")
        advance = Term.parse(f"u*|{self.channel}|")
        return (
            (square, wrench_of({"X": self.thrust, "K": self.torque})),
            (advance, wrench_of({"X": self.advance})),
        )

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


@dataclass(frozen=True)
class Thruster(Limited):
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
    >>> [(str(term), float(wrench[0])) for term, wrench in thruster.regressor_terms()]
    [('port_thrust', 1.0)]
    """

    position: Sequence[float]
    direction: Sequence[float]
    gain: float | None = None
    curve: Rows | None = None

    def __post_init__(self) -> None:
        """Check and freeze the fields."""
        if (self.gain is None) == (self.curve is None):
            raise VehicleError("a thruster needs either `gain` or `curve`; got both or neither")
        super().__post_init__()

    @property
    def derived(self) -> tuple[str, ...]:
        """The thrust [N], unless it is the command times a gain."""
        plain = self.curve is None and self.dead_zone is None and self.limit is None
        return () if plain else (f"{self.name or self.command}_thrust",)

    def acting(self, given: FloatArray) -> FloatArray:
        """Return the thrust of a command along ``direction`` [N]."""
        if self.curve is None:
            return given * (self.gain or 0.0)
        return np.asarray(np.interp(given, *np.array(self.curve).T))

    def regressor_terms(self) -> Columns:
        """Return the force along the direction and its moment about the origin."""
        wrench = np.concatenate([self.direction, np.cross(self.position, self.direction)])
        scale = 1.0 if self.derived or self.gain is None else self.gain
        return ((Term.parse(self.channel), scale * wrench),)


@dataclass(frozen=True)
class Curve(Limited):
    """A static curve of a command: all terms and actuators get its value instead of the command.

    With c the command, limited, b the dead band and r the reference, the value is
    f(c) = ± r ((abs(c) - b) / (r - b))^exponent (voltage / reference_voltage)^voltage_exponent,
    times the reverse ratio where c is negative, and zero in the dead band. As f(r) = r, gains keep
    their meaning.

    Attributes
    ----------
    command : str
        In any unit, zero at rest: of a pulse width, the difference from neutral.
    reference : float
        The positive command at which the curve has the value of the command.
    reverse_ratio : float, optional
        Value of the curve at -reference over that at reference.
    exponent : float, optional
        1 is linear, 2 quadratic.
    dead_band : float, optional
        Commands up to this, to either side, do nothing; less than the reference.
    voltage : str, optional
        Channel with the voltage of the supply.
    reference_voltage : float, optional
        Voltage at which the curve holds [V]; required with ``voltage``.
    voltage_exponent : float, optional
        Of the voltage over its reference.
    limit : float, optional
        Largest command to either side, such as the stall angle of a fin.
    dead_zone, name
        As of other actuators.

    Raises
    ------
    VehicleError
        If a number or a name cannot be.

    Examples
    --------
    >>> curve = Curve("m1", reference=400, reverse_ratio=0.8, exponent=2, dead_band=40)
    >>> curve.channels({"m1": [-400, 30, 220, 400]})["m1"].tolist()
    [-320.0, 0.0, 100.0, 400.0]
    """

    reference: float
    reverse_ratio: float = 1.0
    exponent: float = 1.0
    dead_band: float = 0.0
    voltage: str | None = None
    reference_voltage: float | None = None
    voltage_exponent: float = 1.0

    def __post_init__(self) -> None:
        """Check and freeze the fields."""
        super().__post_init__()
        if not 0.0 <= self.dead_band < self.reference:
            wanted = f"zero or positive, and less than the reference {self.reference:g}"
            raise VehicleError(f"`dead_band` must be {wanted}; got {self.dead_band:g}")
        if (self.voltage is None) != (self.reference_voltage is None):
            raise VehicleError("a curve needs both `voltage` and `reference_voltage`, or neither")

    @property
    def commands(self) -> tuple[str, ...]:
        """The command, and the voltage where the curve depends on it."""
        return (self.command,) if self.voltage is None else (self.command, self.voltage)

    @property
    def derived(self) -> tuple[str, ...]:
        """The command itself: its values are those of the curve."""
        return (self.command,)

    def channels(self, commands: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the values of the curve by the name of the command, shape (n,)."""
        values = super().channels(commands)
        if self.voltage is None or self.reference_voltage is None:
            return values
        share = np.maximum(command_of(commands, self.voltage), 0.0) / self.reference_voltage
        return {self.command: values[self.command] * share**self.voltage_exponent}

    def acting(self, given: FloatArray) -> FloatArray:
        """Return the value of the curve of a command within its limit."""
        effective = np.maximum(np.abs(given) - self.dead_band, 0.0)
        share = effective / (self.reference - self.dead_band)
        scale = np.where(given < 0.0, -self.reference * self.reverse_ratio, self.reference)
        return np.asarray(scale * share**self.exponent)

    def regressor_terms(self) -> Columns:
        """Return no terms."""
        return ()


Actuator: TypeAlias = Matrix | Fin | Propeller | Thruster | Curve


def checked_actuators(actuators: tuple[Actuator, ...]) -> tuple[Actuator, ...]:
    """Return actuators whose channels do not collide."""
    raw = {name for actuator in actuators for name in actuator.commands}
    names: set[str] = set()
    for name, used in ((name, each.commands) for each in actuators for name in each.derived):
        if name in names or (name in raw and name not in used):
            owner = "another actuator's channel" if name in names else "a command"
            raise VehicleError(
                f"`actuators`: the channel `{name}` has the name of {owner}; give the actuator "
                "a `name` of its own"
            )
        names.add(name)
    return actuators


def command_of(commands: Mapping[str, FloatArray], name: str) -> FloatArray:
    """Return one command as an array."""
    if name not in commands:
        raise VehicleError(
            f"the vehicle's actuators need the command `{name}`; got "
            f"{', '.join(commands) or 'none'}.{did_you_mean(name, commands)}"
        )
    return np.asarray(commands[name], dtype=np.float64)


def wrench_of(gains: Gains) -> FloatArray:
    """Return numbers by axis as a whole wrench."""
    gain_items = dict(gains)
    return np.array([gain_items.get(axis, 0.0) for axis in AXES])


def checked_name(name: str, what: str) -> str:
    """Return ``name`` if a command or channel may be called so."""
    try:
        check_command_name(name)
    except TermError as error:
        raise VehicleError(f"`{what}`: {error}") from error
    return name


def checked_number(value: float, what: str, *, positive: bool = False) -> float:
    """Return a finite, and if required positive, number."""
    if not math.isfinite(value) or (positive and value <= 0.0):
        wanted = "a positive number" if positive else "a finite number"
        raise VehicleError(f"`{what}` must be {wanted}; got {value}")
    return value


def checked_table(values: Any, shape: tuple[int | None, ...], what: str) -> Any:
    """Return a small array of finite numbers as nested tuples."""
    return _nested(checked_array(values, shape, what).tolist())


def _nested(values: Any) -> Any:
    return tuple(_nested(value) for value in values) if isinstance(values, list) else values


def _checked_point(values: Sequence[float], what: str) -> Any:
    return checked_table(values, (3,), what)


def _checked_band(values: Sequence[float], what: str) -> tuple[float, float]:
    low, high = checked_table(values, (2,), what)
    if low > high:
        raise VehicleError(f"`{what}` must be (lowest, highest); got ({low:g}, {high:g})")
    return low, high


def _unit_vector(direction: Sequence[float], what: str) -> tuple[float, ...]:
    vector = np.array(_checked_point(direction, what))
    length = float(np.linalg.norm(vector))
    if length == 0.0:
        raise VehicleError("`direction` must not be zero; got (0, 0, 0)")
    if abs(length - 1.0) > 1e-12:
        vector = vector / length
    return tuple(float(component) for component in vector)


def _increasing(curve: Rows, what: str) -> tuple[tuple[float, ...], ...]:
    rows: tuple[tuple[float, ...], ...] = checked_table(curve, (None, 2), what)
    at = np.array(rows)[:, 0] if rows else np.zeros(0)
    if len(at) < 2 or not (np.diff(at) > 0.0).all():
        raise VehicleError(
            "`curve` must have at least two rows (command, thrust [N]) with increasing commands; "
            f"got commands {at.tolist()}"
        )
    return rows


def checked_gains(gains: Gains, what: str) -> tuple[tuple[str, float], ...]:
    """Return axis gains as pairs in the order of the axes."""
    gain_items = dict(gains)
    for axis, value in gain_items.items():
        if axis not in AXES:
            raise VehicleError(f"`{what}` must name axes of {' '.join(AXES)}; got {axis!r}")
        checked_number(value, f"{what} {axis}")
    return tuple((axis, float(gain_items[axis])) for axis in AXES if axis in gain_items)


_CHECKS: dict[str, Callable[[Any, str], Any]] = {
    **dict.fromkeys(("command", "name", "voltage"), checked_name),
    **dict.fromkeys(
        ("limit", "speed_slope", "reference", "reverse_ratio", "exponent", "reference_voltage"),
        partial(checked_number, positive=True),
    ),
    **dict.fromkeys(
        ("thrust", "advance", "torque", "speed_offset", "gain", "voltage_exponent", "dead_band"),
        checked_number,
    ),
    **dict.fromkeys(("force", "drag"), checked_gains),
    "dead_zone": _checked_band,
    "position": _checked_point,
    "direction": _unit_vector,
    "curve": _increasing,
}
"""Check of each field of an actuator of one command."""
