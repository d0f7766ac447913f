"""A damping model with numbers."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, covariance_root, freeze, frozen
from hydrodamp.basis.term import AXES
from hydrodamp.errors import ForeignVehicleWarning, ModelError, repr_html
from hydrodamp.models.model import DampingModel, one_screen, read_label, spell_label, table_of
from hydrodamp.status import TextEnum


@dataclass(frozen=True)
class VehicleStamp:
    """The vehicle some coefficients belong to.

    Parameters
    ----------
    name : str
        Name of the vehicle.
    weight : float
        Weight [N], positive.
    buoyancy : float
        Buoyancy [N], positive.
    mass_matrix_digest : str, optional
        Digest of the full mass matrix (rigid body and added); empty where unknown.
    """

    name: str
    weight: float
    buoyancy: float
    mass_matrix_digest: str = ""


@dataclass(frozen=True, eq=False)
class Damping:
    """A damping model with its coefficients.

    The wrench is on the right-hand side of equation 1: negative along the
    motion where it dissipates. ``H(M nu) nu`` with the full mass matrix is not in
    it. Reference point is the origin of the vehicle's body frame.

    Parameters
    ----------
    model : DampingModel
        The structure.
    coefficients : array_like, shape (n_coefficients,)
        In the order of ``model.labels``, SI. NaN where one could not be determined.
    covariance : array_like, shape (n_coefficients, n_coefficients), optional
        Of the coefficients, in the same order.
    vehicle : VehicleStamp, optional
        The vehicle they belong to.
    source, note : str, optional
        Where the numbers come from, what to know about them.

    Raises
    ------
    ModelError
        If the number of coefficients or the shape of the covariance is wrong.

    Examples
    --------
    >>> damping = Damping.from_dict(None, {"X_u|u|": -3.2, "Y_v": -20.0})
    >>> damping["X_u|u|"], float(damping.wrench([2.0, 0, 0, 0, 0, 0])[0])
    (-3.2, -12.8)
    """

    model: DampingModel
    coefficients: FloatArray
    covariance: FloatArray | None = None
    vehicle: VehicleStamp | None = None
    source: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        """Copy the arrays and check their shapes."""
        n = self.model.n_coefficients
        freeze(self, ModelError, coefficients=(n,))
        if self.covariance is not None:
            freeze(self, ModelError, covariance=(n, n))

    @classmethod
    def from_dict(
        cls,
        model: DampingModel | None,
        values: Mapping[str, float],
        *,
        vehicle: VehicleStamp | None = None,
        source: str = "",
        note: str = "",
    ) -> Damping:
        """Return the damping of labelled values.

        Parameters
        ----------
        model : DampingModel or None
            The structure; None makes one, called ``custom``, of just these labels.
        values : mapping of str to float
            A value for every label of the model, in any order and any spelling.
        vehicle, source, note : optional
            As in :class:`Damping`.

        Returns
        -------
        damping : Damping
            With the coefficients in the model's order.

        Raises
        ------
        ModelError
            If a label is unknown to the model or has no value.

        Examples
        --------
        >>> Damping.from_dict(None, {"N_r": -2, "X_u": -1}).coefficients
        array([-1., -2.])
        """
        read = {spell_label(*read_label(label)): float(value) for label, value in values.items()}
        structure = model or DampingModel.from_table(table_of(read), key="custom")
        structure.check_labels(read)
        ordered = frozen([read[label] for label in structure.labels])
        return cls(structure, ordered, None, vehicle, source, note)

    def as_dict(self) -> dict[str, float]:
        """Return the coefficients by label, in the model's order."""
        return dict(zip(self.model.labels, map(float, self.coefficients), strict=True))

    def onto(self, model: DampingModel) -> FloatArray:
        """Return the coefficients another model has in common, 0 for the others.

        Parameters
        ----------
        model : DampingModel
            Any.

        Returns
        -------
        coefficients : ndarray, shape (n_coefficients,)
            In the order of that model's labels.

        Examples
        --------
        >>> Damping.from_dict(None, {"Y_v": -20.0}).onto(
        ...     DampingModel.from_table({"Y": "v r"}, key="two")
        ... ).tolist()
        [-20.0, 0.0]
        """
        values = self.as_dict()
        return np.array([values.get(label, 0.0) for label in model.labels])

    def __getitem__(self, label: str) -> float:
        """Return one coefficient by its label, ``damping["Y_v|v|"]``."""
        return float(self.coefficients[self.model.index(label)])

    @cached_property
    def matrix(self) -> FloatArray:
        """The matrix of coefficients, shape (6, n_terms), columns as ``model.basis``.

        In the paper K.
        """
        return self.model.unpack(self.coefficients)

    def wrench(
        self,
        velocity: npt.ArrayLike,
        *,
        down: npt.ArrayLike | None = None,
        commands: Mapping[str, npt.ArrayLike] | None = None,
        propulsion_ratio: npt.ArrayLike = 1.0,
    ) -> FloatArray:
        """Return the damping wrench.

        Parameters
        ----------
        velocity : array_like, shape (n, 6) or (6,)
            Body velocity u v w [m/s] p q r [rad/s].
        down : array_like, shape (n, 3) or (3,), optional
            Unit vector that points down, in the body frame; level by default.
        commands : mapping of str to array_like, shape (n,) or scalar, optional
            The commands the terms contain.
        propulsion_ratio : array_like, shape (n,) or scalar, optional
            In the paper eta bar = u_c / U; one by default.

        Returns
        -------
        wrench : ndarray, shape (n, 6) or (6,)
            Force X Y Z [N] and moment K M N [N m], body frame, on the right-hand side:
            negative along the motion. In the paper tau(nu) = K xi(nu).

        Raises
        ------
        TermError
            If an array has the wrong shape or a command is missing.

        Examples
        --------
        >>> float(Damping.from_dict(None, {"Y_v": -20.0}).wrench([0, 0.5, 0, 0, 0, 0])[1])
        -10.0
        """
        regressor = self.model.basis.evaluate(
            velocity, down=down, commands=commands, propulsion_ratio=propulsion_ratio
        )
        return np.asarray(regressor @ self.matrix.T, dtype=np.float64)

    def power(self, velocity: npt.ArrayLike, **held: Any) -> FloatArray:
        """Return the power the damping wrench puts into the motion.

        Parameters
        ----------
        velocity : array_like, shape (n, 6) or (6,)
            u v w [m/s] and p q r [rad/s].
        **held
            ``down``, ``commands`` and ``propulsion_ratio``, as in :meth:`wrench`.

        Returns
        -------
        power : ndarray, shape (n,) or ()
            In watts: velocity times wrench. Negative where the wrench dissipates.

        Raises
        ------
        TermError
            If an array has the wrong shape or a command is missing.

        Examples
        --------
        >>> float(Damping.from_dict(None, {"Y_v": -20.0}).power([0, 0.5, 0, 0, 0, 0]))
        -5.0
        """
        moving = np.asarray(velocity, dtype=np.float64)
        return np.asarray(np.sum(moving * self.wrench(moving, **held), axis=-1))

    def _repr_html_(self) -> str:
        return repr_html(self, coefficient_columns(self))

    def __str__(self) -> str:
        """Return the damping in one screen."""
        model = self.model
        values = iter(self.coefficients)
        rows = [
            f"{axis}: " + ", ".join(f"{next(values):.6g} {term}" for term in row)
            for axis, row in zip(AXES, model.terms, strict=True)
            if row
        ]
        return one_screen(
            f"Damping, {model.title} ({model.key}): {model.n_coefficients} coefficients",
            *rows,
            vehicle=self.vehicle.name if self.vehicle else "",
            source=self.source,
            note=self.note,
        )


def coefficient_columns(
    damping: Damping, critical_value: float = 1.96, grades: Iterable[TextEnum] = ()
) -> dict[str, Sequence[Any]]:
    """Return coefficients, values, half-widths of 95 % intervals, units and grades, if known."""
    covariance = np.empty((0, 0)) if damping.covariance is None else damping.covariance
    return {
        "coefficient": damping.model.labels,
        "value": damping.coefficients.tolist(),
        "± 95 %": (critical_value * np.sqrt(covariance.diagonal())).tolist(),
        "unit": damping.model.units,
        "grade": [grade.word for grade in grades],
    }


def draw_coefficients(damping: Damping, n: int, generator: np.random.Generator) -> FloatArray:
    """Return samples (n, n_coefficients) of the normal distribution of a fit."""
    if damping.covariance is None or not np.isfinite(damping.covariance).all():
        raise ModelError(
            f"'{damping.model.key}' has no covariance to draw from: give a damping file that "
            "`hydrodamp identify` wrote by a method that estimates one."
        )
    root = covariance_root(damping.covariance)
    return damping.coefficients + generator.standard_normal((n, len(root))) @ root.T


def warn_if_foreign(damping: Damping, stamp: VehicleStamp) -> None:
    """Warn when coefficients are used with a vehicle that they were not identified for."""
    if message := foreign_to(damping, stamp):
        warnings.warn(message, ForeignVehicleWarning, stacklevel=2)


def foreign_to(damping: Damping, stamp: VehicleStamp) -> str:
    """Return how two vehicles differ, as a message; empty where coefficients belong to this one."""
    origin = damping.vehicle
    differences = [] if origin is None else list(_differences(origin, stamp))
    if origin is None or not differences:
        return ""
    return (
        f"These coefficients belong to vehicle '{origin.name}', used with '{stamp.name}': "
        f"{'; '.join(differences)}. The same forces have other coefficients under another "
        "mass matrix: identify them again, or use the vehicle they belong to."
    )


def _differences(own: VehicleStamp, other: VehicleStamp) -> Iterator[str]:
    digests = own.mass_matrix_digest, other.mass_matrix_digest
    if all(digests) and digests[0] != digests[1]:
        yield "the mass matrix is another"
    for quantity in ("weight", "buoyancy"):
        theirs, ours = getattr(own, quantity), getattr(other, quantity)
        if not math.isclose(theirs, ours, rel_tol=1e-6, abs_tol=1e-6):
            yield f"{quantity} {theirs:g} N there, {ours:g} N here"
