"""The vehicle: everything equation 1 knows before a log is read."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import BoolArray, FloatArray, frozen
from hydrodamp.basis.basis import Basis
from hydrodamp.basis.term import AXES, DOWN, VELOCITIES, Term
from hydrodamp.errors import VehicleError, has_controls, printable, repr_html
from hydrodamp.vehicle import hulls, mass as masses, priors
from hydrodamp.vehicle.actuators import Actuator, Curve, Propeller, checked_actuators

_MOTIONS = {"K": ("roll", "down_y"), "M": ("pitch", "down_x")}


def mass_matrix_digest(matrix: npt.ArrayLike) -> str:
    """Return a short fingerprint of a mass matrix."""
    rounded = np.round(np.asarray(matrix, dtype="<f8"), 9) + 0.0
    return hashlib.sha256(rounded.tobytes()).hexdigest()[:16]


MAX_NAME_LENGTH = 100
"""Of a vehicle: file systems allow 255 bytes, which exporters extend by suffixes."""


@dataclass(frozen=True, eq=False)
class Vehicle:
    """Mass, restoring and actuators of a marine craft; it owns no damping.

    Attributes
    ----------
    name : str
        What to call it.
    mass_matrix : ndarray, shape (6, 6)
        Rigid body plus added mass about the origin of the body frame, in the paper
        M. With k free axes a k x k block may be given.
    weight, buoyancy : float
        Both positive [N]; in the paper g and -b.
    center_of_gravity, center_of_buoyancy : ndarray, shape (3,)
        r_G and r_B from the origin, body frame: a center of buoyancy above the
        center of gravity has the smaller z [m].
    actuators : tuple of Matrix, Fin, Propeller, Thruster or Curve
        What turns commands into a known wrench.
    axes : tuple of str
        The free axes; the velocities of the others are zero.
    source, note : str
        Where the numbers come from, and what to know about them.
    added_mass : ndarray, shape (6, 6), or None
        The part of ``mass_matrix`` that is added mass, where it is known.
    estimate : tuple of str
        What ``hydrodamp identify`` estimates with the damping: ``added_mass``,
        ``center_of_gravity``, ``buoyancy``, ``gains``, ``thrust_curve`` or ``fin_curve``.
    std : mapping of str to tuple of float
        Standard deviations of ``added_mass`` (of the logarithm, X Y Z K M N),
        ``center_of_gravity`` (x y z) [m], ``buoyancy`` (over the weight) and
        ``wrench_gain`` (as added mass): what has one is estimated with the damping, the
        rest is exact.
    origin : mapping of str to str
        Where such a value comes from: ``measured``, ``published``, ``formula`` (from
        the sizes of the hull) or ``assumed``.
    wrench_gain : ndarray, shape (6,)
        By what a wrench that a log records is multiplied, positive.

    Raises
    ------
    VehicleError
        If the mass matrix is not symmetric positive-definite on the free axes,
        or a number, an axis or an actuator cannot be.

    Examples
    --------
    >>> import numpy as np
    >>> vehicle = Vehicle("cube", np.eye(6), weight=10.0, buoyancy=9.0)
    >>> vehicle.restoring_wrench([[0, 0, 1]])[0, :3].tolist()
    [0.0, 0.0, 1.0]

    References
    ----------
    .. [1] Gibson et al., "A Comparison of Hydrodynamic Damping Models Using
       Least-Squares and Adaptive Identifier Methods for Autonomous Underwater
       Vehicles", OCEANS 2015, equation 1.
    """

    name: str
    mass_matrix: FloatArray
    weight: float
    buoyancy: float
    center_of_gravity: FloatArray = field(default_factory=lambda: np.zeros(3))
    center_of_buoyancy: FloatArray = field(default_factory=lambda: np.zeros(3))
    actuators: tuple[Actuator, ...] = ()
    axes: tuple[str, ...] = AXES
    source: str = ""
    note: str = ""
    added_mass: FloatArray | None = None
    estimate: tuple[str, ...] = ()
    std: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    origin: Mapping[str, str] = field(default_factory=dict)
    wrench_gain: FloatArray = field(default_factory=lambda: np.ones(6))

    def __post_init__(self) -> None:
        """Check every field and copy the arrays."""
        fixed: dict[str, Any] = {
            "axes": checked_axes(self.axes),
            "center_of_gravity": masses.checked_array(
                self.center_of_gravity, (3,), "center_of_gravity"
            ),
            "center_of_buoyancy": masses.checked_array(
                self.center_of_buoyancy, (3,), "center_of_buoyancy"
            ),
            "actuators": checked_actuators(tuple(self.actuators)),
            "std": priors.checked_std(self.std),
            "origin": priors.checked_origin(self.origin),
            "wrench_gain": masses.checked_array(self.wrench_gain, (6,), "wrench_gain"),
        }
        if not 0 < len(self.name) <= MAX_NAME_LENGTH or printable(self.name) != self.name:
            wanted = f"1 to {MAX_NAME_LENGTH} characters on one line, none of them a control"
            raise VehicleError(f"`name` must be {wanted} character; got {self.name[:40]!r}")
        for name in ("source", "note"):
            if has_controls(getattr(self, name)):
                raise VehicleError(f"`{name}` must be text without control characters; remove them")
        for name in ("weight", "buoyancy"):
            force = fixed[name] = float(getattr(self, name))
            if not 0.0 <= force < math.inf:
                raise VehicleError(f"`{name}` must be zero or positive [N]; got {force:g}")
        if not (fixed["wrench_gain"] > 0.0).all():
            got = fixed["wrench_gain"].tolist()
            raise VehicleError(f"`wrench_gain` must be positive; got {got}")
        fixed["mass_matrix"] = masses.checked_mass_matrix(self.mass_matrix, fixed["axes"])
        if self.added_mass is not None:
            fixed["added_mass"] = masses.checked_array(self.added_mass, (6, 6), "added_mass")
        elif "added_mass" in fixed["std"]:
            raise VehicleError(
                "`std` has `added_mass`, and only the sum `mass_matrix` is known: give "
                "`rigid_body` and `added_mass` instead"
            )
        for name, value in fixed.items():
            object.__setattr__(self, name, value)

    @classmethod
    def from_hull(
        cls,
        length: float,
        diameter: float,
        mass: float,
        *,
        name: str = "hull",
        buoyancy: float | None = None,
        center_of_gravity: npt.ArrayLike = (0.0, 0.0, 0.0),
        center_of_buoyancy: npt.ArrayLike = (0.0, 0.0, 0.0),
        actuators: tuple[Actuator, ...] = (),
    ) -> Vehicle:
        """Estimate a torpedo-shaped vehicle from its size.

        The origin is the middle of the hull. Added mass is that of the water
        the vehicle displaces, as a spheroid of its length over diameter (Lamb).

        Parameters
        ----------
        length, diameter : float
            Of the hull [m].
        mass : float
            With everything that moves along, flooded spaces included [kg].
        name : str, optional
            What to call it.
        buoyancy : float, optional
            [N]; neutral if not given.
        center_of_gravity, center_of_buoyancy : array_like, shape (3,), optional
            From the middle of the hull, body frame (z down) [m].
        actuators : tuple, optional
            Fins, propellers, thrusters.

        Returns
        -------
        vehicle : Vehicle
            Its note says that it is an estimate.

        Raises
        ------
        VehicleError
            If a size is not positive or the hull is wider than long.

        Examples
        --------
        >>> vehicle = Vehicle.from_hull(length=1.33, diameter=0.19, mass=30.5)
        >>> [round(float(m), 1) for m in vehicle.mass_matrix.diagonal()[:3]]
        [31.6, 59.0, 59.0]
        """
        displaced = mass if buoyancy is None else buoyancy / masses.STANDARD_GRAVITY
        hull = hulls.estimate_spheroid(length, diameter, mass, displaced)
        return cls._estimate(hull, name, actuators, buoyancy, center_of_gravity, center_of_buoyancy)

    @classmethod
    def from_dimensions(
        cls,
        kind: hulls.HullKind,
        length: float,
        beam: float,
        draft: float,
        *,
        mass: float | None = None,
        block_coefficient: float | None = None,
        name: str = "hull",
        actuators: tuple[Actuator, ...] = (),
    ) -> Vehicle:
        """Estimate a ship, boat, catamaran or ROV from its main dimensions.

        The origin is amidships, on the centerline; of an ROV, the middle of its box. The center
        of gravity is there.

        Parameters
        ----------
        kind : {"boat", "catamaran", "ship", "rov"}
            A boat, catamaran or ship has the axes X Y N, an ROV all six. A catamaran has two
            hulls at the sides of its beam, without interaction.
        length, beam, draft : float
            Of the hull below the waterline, of a catamaran over both hulls; ``draft`` is the height
            of the box of an ROV [m].
        mass : float, optional
            With everything that moves along [kg]; by default that displaced at sea.
        block_coefficient : float, optional
            Displaced volume over length x beam x draft; by default that of the mass. Of a
            catamaran, that of each hull; by default 0.4.
        name : str, optional
            What to call it.
        actuators : tuple, optional
            Rudders, propellers, thrusters.

        Returns
        -------
        vehicle : Vehicle
            Its note names the formulas, its ``std`` has their errors.

        Raises
        ------
        VehicleError
            If the dimensions cannot displace the mass, or neither mass nor block coefficient
            is given.

        References
        ----------
        .. [1] H. Soeding, "Prediction of Ship Steering Capabilities", Schiffstechnik 29,
           1982; as in T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion
           Control, Wiley, 2021.
        .. [2] D. Clarke, P. Gedling, G. Hine, "The Application of Manoeuvring Criteria in
           Hull Design Using Linear Theory", Transactions of RINA 125, 1983.
        .. [3] DNV-RP-H103, Modelling and Analysis of Marine Operations, 2011, table A-2.

        Examples
        --------
        >>> boat = Vehicle.from_dimensions("boat", 1.2, 0.3, 0.1, mass=17.0)
        >>> [round(float(boat.mass_matrix[i, i]), 1) for i in (0, 1, 5)]
        [19.1, 37.0, 2.7]
        """
        hull = hulls.estimate_hull(kind, length, beam, draft, mass, block_coefficient)
        return cls._estimate(hull, name, actuators)

    @classmethod
    def _estimate(
        cls,
        hull: hulls.Hull,
        name: str,
        actuators: tuple[Actuator, ...],
        buoyancy: float | None = None,
        center_of_gravity: npt.ArrayLike = (0.0, 0.0, 0.0),
        center_of_buoyancy: npt.ArrayLike = (0.0, 0.0, 0.0),
    ) -> Vehicle:
        """Return the vehicle of a hull, neutrally buoyant if no buoyancy is given."""
        rigid = masses.rigid_body_mass_matrix(
            hull.mass, hull.inertia, center_of_gravity, "center_of_gravity"
        )
        weight = hull.mass * masses.STANDARD_GRAVITY
        std: dict[str, tuple[float, ...]] = {"added_mass": hull.std}
        origin = {"added_mass": "formula"}
        if buoyancy is None and "Z" in hull.axes:
            std["buoyancy"], origin["buoyancy"] = (priors.NEUTRAL_STD,), "assumed"
        return cls(
            name=name,
            mass_matrix=rigid + hull.added_mass,
            weight=weight,
            buoyancy=weight if buoyancy is None else buoyancy,
            center_of_gravity=np.asarray(center_of_gravity),
            center_of_buoyancy=np.asarray(center_of_buoyancy),
            actuators=actuators,
            axes=hull.axes,
            source=hull.source,
            note=hull.note,
            added_mass=hull.added_mass,
            std=std,
            origin=origin,
        )

    @property
    def commands(self) -> tuple[str, ...]:
        """Names of the commands that the actuators use, each once."""
        return tuple(
            dict.fromkeys(name for actuator in self.actuators for name in actuator.commands)
        )

    @property
    def free(self) -> BoolArray:
        """Which of the six axes are free; shape (6,)."""
        return np.array([axis in self.axes for axis in AXES])

    @cached_property
    def restoring_matrix(self) -> FloatArray:
        """What turns R^T e3 into the restoring wrench; shape (6, 3)."""
        heavy = (self.weight - self.buoyancy) * np.eye(3)
        lever = self.weight * self.center_of_gravity - self.buoyancy * self.center_of_buoyancy
        return frozen(np.vstack([heavy, masses.cross_matrix(lever)]) + 0.0)

    def known_columns(self) -> dict[Term, FloatArray]:
        """Return restoring and actuators as columns of the regressor.

        Returns
        -------
        known : dict of Term to ndarray, shape (6,)
            The wrench per unit of each term: everything known of equation 1 but
            H(M nu) nu and a recorded wrench; terms without any are left out.
        """
        columns = [*zip(map(Term.parse, DOWN), self.restoring_matrix.T, strict=True)]
        columns += [column for actuator in self.actuators for column in actuator.regressor_terms()]
        sums: dict[Term, FloatArray] = {}
        for term, wrench in columns:
            sums[term] = sums.get(term, 0.0) + wrench
        return {term: wrench for term, wrench in sums.items() if wrench.any()}

    def channels(self, commands: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return every channel that the known columns use.

        Parameters
        ----------
        commands : mapping of str to ndarray, shape (n,)
            What was recorded.

        Returns
        -------
        channels : dict of str to ndarray, shape (n,)
            Commands as they are, or limited and turned into thrust, those with a curve by its
            values.

        Raises
        ------
        VehicleError
            If a command is missing.
        """
        shaped = self.shape_commands(commands)
        return {
            name: values
            for actuator in self.actuators
            for name, values in actuator.channels(
                commands if isinstance(actuator, Curve) else shaped
            ).items()
        }

    def shape_commands(self, commands: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the commands with the values of their curves."""
        curves = [each for each in self.actuators if isinstance(each, Curve)]
        known = [each for each in curves if {*each.commands} <= {*commands}]
        return {**commands} | {
            each.command: each.channels(commands)[each.command] for each in known
        }

    def propulsion_speed(self, commands: Mapping[str, FloatArray]) -> FloatArray | None:
        """Return u_c, the steady surge speed that the present propeller speed gives.

        Parameters
        ----------
        commands : mapping of str to ndarray, shape (n,)
            What was recorded.

        Returns
        -------
        speed : ndarray, shape (n,), or None
            [m/s]; the mean of several propellers, None where none knows its
            own or no propeller speed was recorded.
        """
        propellers = [each for each in self.actuators if isinstance(each, Propeller)]
        commands = self.shape_commands(commands)
        speeds = [
            each.propulsion_speed(commands) for each in propellers if each.command in commands
        ]
        known = [speed for speed in speeds if speed is not None]
        return sum(known[1:], known[0]) / len(known) if known else None

    def restoring_wrench(self, down: npt.ArrayLike) -> FloatArray:
        """Return the wrench of weight and buoyancy.

        Parameters
        ----------
        down : array_like, shape (n, 3)
            R^T e3, the downward unit vector in the body frame.

        Returns
        -------
        wrench : ndarray, shape (n, 6)
            X Y Z [N] and K M N [N m], body frame, on the right-hand side; in
            the paper G(R).
        """
        directions: FloatArray = np.asarray(down, dtype=np.float64)
        return directions @ self.restoring_matrix.T

    def known_wrench(
        self,
        velocity: npt.ArrayLike,
        down: npt.ArrayLike,
        commands: Mapping[str, FloatArray] | None = None,
    ) -> FloatArray:
        """Return restoring and actuator wrenches together.

        Parameters
        ----------
        velocity : array_like, shape (n, 6)
            u v w [m/s] and p q r [rad/s].
        down : array_like, shape (n, 3)
            R^T e3, the downward unit vector in the body frame.
        commands : mapping of str to ndarray, shape (n,), optional
            What the actuators listen to.

        Returns
        -------
        wrench : ndarray, shape (n, 6)
            X Y Z [N] and K M N [N m], body frame, on the right-hand side;
            without H(M nu) nu.

        Raises
        ------
        VehicleError
            If a command is missing.
        """
        known = self.known_columns()
        regressor = Basis(tuple(known)).evaluate(
            velocity, down=down, commands=self.channels(commands or {})
        )
        return np.asarray(regressor @ np.reshape([*known.values()], (-1, 6)))

    def __eq__(self, other: object) -> bool:
        """Whether all fields are equal."""
        return isinstance(other, Vehicle) and _values(self) == _values(other)

    def __hash__(self) -> int:
        """Return a hash of the name and the numbers of the mass matrix."""
        return hash((self.name, mass_matrix_digest(self.mass_matrix)))

    _repr_html_ = repr_html

    def __str__(self) -> str:
        """Return the vehicle on one screen."""
        blocks = [
            f"{self.name}: axes {' '.join(self.axes)}",
            f"weight {self.weight:g} N, buoyancy {self.buoyancy:g} N",
            f"center of gravity {_point(self.center_of_gravity)}, "
            f"of buoyancy {_point(self.center_of_buoyancy)} m",
            "mass matrix, rigid body and added mass [kg, kg m, kg m^2]",
            *_table(self),
            *(
                f"{type(actuator).__name__.lower()} on {', '.join(actuator.commands)}"
                for actuator in self.actuators
            ),
        ]
        if not self.actuators:
            blocks.append("no known actuators")
        origins = (("source", self.source), ("note", self.note))
        return "\n".join([*blocks, *(f"{what}: {text}" for what, text in origins if text)])


def checked_axes(axes: Iterable[str]) -> tuple[str, ...]:
    """Return the free axes if they are some of the six, in order."""
    letters = tuple(axes)
    if not letters or letters != tuple(axis for axis in AXES if axis in letters):
        got = " ".join(letters) or "none"
        raise VehicleError(f"`axes` must be some of {' '.join(AXES)}, in this order; got {got}")
    return letters


def without_righting(vehicle: Vehicle) -> str:
    """Return what to say of a vehicle that nothing turns upright."""
    gravity, lift = float(vehicle.center_of_gravity[2]), float(vehicle.center_of_buoyancy[2])
    free = [axis for axis in _MOTIONS if axis in vehicle.axes]
    if not free or (gravity > lift and max(vehicle.weight, vehicle.buoyancy) > 0.0):
        return ""
    motions = " and ".join(_MOTIONS[axis][0] for axis in free)
    terms = ", ".join(f"{axis}: {_MOTIONS[axis][1]}" for axis in free)
    return (
        f"'{vehicle.name}' has no righting moment in {motions}: its center of gravity "
        f"(z {gravity:g} m) is not below its center of buoyancy (z {lift:g} m), and damping has to "
        "explain what turns the vehicle upright. Enter in the vehicle file by how much it is, "
        f"mostly millimetres to centimetres, or let it be fitted by `terms: {{{terms}}}` in a "
        "model file."
    )


def _values(vehicle: Vehicle) -> list[Any]:
    values = (getattr(vehicle, field.name) for field in fields(vehicle))
    return [value.tolist() if isinstance(value, np.ndarray) else value for value in values]


def _point(values: object) -> str:
    return "(" + ", ".join(f"{value:g}" for value in np.asarray(values)) + ")"


def _table(vehicle: Vehicle) -> list[str]:
    free = [index for index, axis in enumerate(AXES) if axis in vehicle.axes]
    head = "   " + "".join(f"{VELOCITIES[j]:>10}" for j in free)
    rows = vehicle.mass_matrix
    return [head, *(f"  {AXES[i]}" + "".join(f"{rows[i, j]:10.4g}" for j in free) for i in free)]
