"""The ensemble of damping: what is known of the coefficients, and draws of what they may be."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.errors import ModelError
from hydrodamp.identification.har_covariance import reference_model
from hydrodamp.models.damping import Damping, foreign_to
from hydrodamp.models.model import DampingModel
from hydrodamp.models.published import published
from hydrodamp.simulation.checks import estimate_length
from hydrodamp.simulation.problem import vehicle_stamp
from hydrodamp.vehicle.mass import STANDARD_GRAVITY
from hydrodamp.vehicle.vehicle import Vehicle

#: Relative doubt of a coefficient whose standard error is not known, and the most of any.
DOUBT = 0.3

#: What terms that the model lacks make of the force on an axis, all together, as a share.
FORM = 0.02

#: Water [kg/m^3].
_DENSITY = 1000.0

#: Drag of a smooth hull ahead against its frontal area, and of a cylinder across the flow:
#: S. F. Hoerner, Fluid-Dynamic Drag (1965), chapters 6 and 3.
_AHEAD, _ACROSS = 0.2, 1.1

#: Lift slope of a slender hull with its tail fins, per square of its length.
_LIFT = 0.03


def prior_damping(vehicle: Vehicle, model: DampingModel, damping: Damping | None) -> Damping:
    """Return what is known of a model's coefficients: as given, as published, or by the hull."""
    free = model.restricted_to(vehicle.axes)
    if damping is not None:
        if told := foreign_to(damping, vehicle_stamp(vehicle)):
            raise ModelError(told)
        if lacking := [name for name in free.commands if name not in damping.model.commands]:
            raise ModelError(
                f"the prior says nothing of what {', '.join(lacking)} do: give one that was "
                f"identified with the terms of model '{free.key}'."
            )
        return damping
    if free.commands:
        raise ModelError(
            f"model '{free.key}' has gains of {' '.join(free.commands)} among its coefficients, "
            "and nothing says what they are: give `damping`, from a log that was identified."
        )
    for name, found in published.items():
        if found.vehicle is not None and not foreign_to(found, vehicle_stamp(vehicle)):
            return replace(found, source=f"published set '{name}'")
    return hull_damping(vehicle)


def hull_damping(vehicle: Vehicle) -> Damping:
    """Return about the damping of a hull, from its length and its displacement.

    A cylinder across the flow, a smooth hull ahead, a slender body's lift with its tail: right to
    a factor of two.
    """
    length = estimate_length(vehicle) or 1.0
    volume = vehicle.weight / STANDARD_GRAVITY / _DENSITY
    diameter = float(np.sqrt(4.0 * volume / np.pi / length))
    across = 0.5 * _DENSITY * _ACROSS * diameter * length
    lift = 0.5 * _DENSITY * _LIFT * length**2
    turning, roll = across * length**3 / 32.0, 0.5 * _DENSITY * _ACROSS * diameter**5
    values = {
        "X_u|u|": -0.5 * _DENSITY * _AHEAD * np.pi / 4.0 * diameter**2,
        "Y_v|v|": -across,
        "Z_w|w|": -across,
        "Y_uv": -lift,
        "Z_uw": -lift,
        "N_r|r|": -turning,
        "M_q|q|": -turning,
        "N_ur": -lift * length**2 / 4.0,
        "M_uq": -lift * length**2 / 4.0,
        "K_p|p|": -roll,
        "K_up": -roll,
    }
    coefficients = {label: value for label, value in values.items() if label[0] in vehicle.axes}
    source = f"a hull of {length:.2g} m and {diameter:.2g} m"
    return Damping.from_dict(None, coefficients, source=source, vehicle=vehicle_stamp(vehicle))


@dataclass(frozen=True, eq=False)
class DampingEnsemble:
    """Dampings that may be: the known one first, then draws about it.

    Attributes
    ----------
    dampings : tuple of Damping
        All of one model: the terms asked for, those of what is known, and the reference's.
    model : DampingModel
        The one that is planned for, restricted to the free axes.
    """

    dampings: tuple[Damping, ...]
    model: DampingModel

    @property
    def wide(self) -> DampingModel:
        """The model of all dampings."""
        return self.dampings[0].model

    @property
    def n(self) -> int:
        """How many there are."""
        return len(self.dampings)

    def first(self, n: int) -> DampingEnsemble:
        """Return the first few."""
        return replace(self, dampings=self.dampings[:n])


def sample_ensemble(
    vehicle: Vehicle, model: DampingModel, known: Damping, sizes: FloatArray, n: int, seed: int
) -> DampingEnsemble:
    """Draw damping coefficients about what is known.

    A coefficient is off as its standard error says, by 30 % at most, which is what it is off where
    none is known. Terms that the model lacks make some per cent of the force on an axis:
    ``sizes`` (terms of the wide model, in its order) are the coefficients that make all of it.
    """
    free = model.restricted_to(vehicle.axes)
    wide, rng = wide_model(vehicle, model, known), np.random.default_rng(seed)
    own = known.model.restricted_to(vehicle.axes)
    values = dict(zip(own.labels, known.onto(own), strict=True))
    still = np.array([values.get(label, 0.0) for label in wide.labels])
    known_ones = np.array([label in values for label in wide.labels])
    root = np.zeros((wide.n_coefficients, own.n_coefficients))
    places = [wide.index(label) for label in own.labels]
    root[places] = _root(known, own)
    axes = np.repeat(np.arange(6), [len(row) for row in wide.terms])
    lacking = np.bincount(axes[~known_ones], minlength=6)[axes]
    form = np.where(known_ones, 0.0, FORM * sizes / np.sqrt(np.maximum(lacking, 1)))
    dampings = [Damping(wide, still)]
    for _ in range(n - 1):
        moved = root @ rng.standard_normal(own.n_coefficients)
        most = DOUBT * np.abs(still)
        moved = np.clip(moved, -2.0 * most, 2.0 * most)
        other = form * rng.standard_normal(wide.n_coefficients)
        dampings.append(Damping(wide, still + moved + other))
    return DampingEnsemble(tuple(dampings), free)


def wide_model(vehicle: Vehicle, model: DampingModel, known: Damping) -> DampingModel:
    """Return a model with the terms asked for, those of what is known, and the reference's."""
    wide = model.restricted_to(vehicle.axes)
    for other in (known.model.restricted_to(vehicle.axes), reference_model(vehicle.axes)):
        rows = zip(AXES, other.terms, strict=True)
        wide = wide.with_terms({axis: [*terms] for axis, terms in rows if terms}, key=wide.key)
    return wide


def _root(known: Damping, own: DampingModel) -> FloatArray:
    """Return a root of the covariance of the known coefficients."""
    values = known.onto(own)
    if known.covariance is None:
        return np.diag(DOUBT * np.abs(values))
    places = [known.model.index(label) for label in own.labels]
    covariance = known.covariance[np.ix_(places, places)]
    level, directions = np.linalg.eigh(np.nan_to_num(covariance))
    found: FloatArray = directions * np.sqrt(np.maximum(level, 0.0))
    most = DOUBT * np.abs(values)
    spread = np.linalg.norm(found, axis=1)
    return np.asarray(found * (most / np.maximum(spread, np.maximum(most, 1e-12)))[:, None])
