"""How far coefficients move where the vehicle's own numbers are wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.identification.fit import Fit, Method
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.parallel import run_parallel
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.validation.compare import Row, compare
from hydrodamp.vehicle.vehicle import Vehicle

#: How far each number is moved, as a share of it.
RELATIVE_STEP = 0.1

#: Share of the weight that W - B is taken to be for a neutral vehicle: trimming in the field is not
#: much finer.
NEUTRAL_TRIM = 0.01


@dataclass(frozen=True)
class Effect:
    """What an error of one number of the vehicle does; without a label nothing was identified."""

    change: str
    label: str = ""
    wrench_share: float = 0.0
    standard_errors: float | None = None
    rms: float | None = None

    def line(self, before: float | None) -> str:
        """Return what happens, as a line."""
        if not self.label:
            return f"{self.change}: nothing could be identified"
        many = "" if self.standard_errors is None else f", {self.standard_errors:.1f} std. errors"
        return (
            f"{self.change}: {_size(before)} -> {_size(self.rms)}; "
            f"{self.label} by {100.0 * self.wrench_share:.1f} %{many}"
        )


@dataclass(frozen=True)
class VehicleSensitivity:
    """How far a fit rests on the numbers of the vehicle.

    Attributes
    ----------
    model, method : str
        Their keys.
    rms : float or None
        RMS error of the replay with the vehicle as it is; None where it diverged.
    effects : tuple of Effect
        One a number of the vehicle that there is and that acts on a free axis.
    """

    model: str
    method: str
    rms: float | None
    effects: tuple[Effect, ...]

    def __str__(self) -> str:
        """Return a line for each number."""
        lines = [f"  {effect.line(self.rms)}" for effect in self.effects]
        head = (
            f"If the vehicle is wrong ({self.model} by {self.method}), RMS of the replay;\n"
            "what moves most, in damping of its axis:"
        )
        return "\n".join([head, *lines])


def vehicle_sensitivity(
    vehicle: Vehicle,
    train: Log,
    test: Log,
    model: DampingModel,
    method: Method,
) -> VehicleSensitivity:
    """Identify and replay with each number of the vehicle moved by a tenth, both ways.

    Parameters
    ----------
    vehicle : Vehicle
        As it is believed to be.
    train, test : Log
        What to identify from, and what to replay.
    model : DampingModel
        Which terms.
    method : Method
        How.

    Returns
    -------
    doubt : VehicleSensitivity
        For mass, added mass, W - B and r_G.

    Raises
    ------
    ProblemError
        If a log lacks what the vehicle or a term needs.

    Examples
    --------
    >>> from hydrodamp.identification.least_squares import LeastSquares
    >>> from hydrodamp.models.catalog import catalog
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> campaign = reenact(duration=10.0)
    >>> logs = campaign.train, campaign.test
    >>> doubt = vehicle_sensitivity(campaign.vehicle, *logs, catalog["fossen"], LeastSquares())
    >>> len(doubt.effects)
    4
    """
    wrong = tuple(variants(vehicle))
    vehicles = [vehicle, *(one for _, moved in wrong for one in moved)]
    first, *others = run_parallel(_row, [(one, train, test, model, method) for one in vehicles])
    share = _shares(prepare(vehicle, train, model), first.fit)
    pairs = zip(wrong, zip(others[::2], others[1::2], strict=True), strict=True)
    effects = tuple(_effect(what, first.fit, pair, share) for (what, _), pair in pairs)
    return VehicleSensitivity(first.model, first.method, first.rms, effects)


def _row(vehicle: Vehicle, train: Log, test: Log, model: DampingModel, method: Method) -> Row:
    """Return a fit and its replay."""
    fit = method.identify(prepare(vehicle, train, model), model)
    return compare((fit,), vehicle, test).rows[0]


def _shares(problem: Problem, fit: Fit) -> FloatArray:
    """Return what share of the damping on its axis one unit of each coefficient makes."""
    rows, axes = problem.equations.entries(fit.model)
    columns, n_known = problem.regressor(), problem.equations.n_known
    wrench = columns[:, n_known:] @ problem.matrix(fit.damping)[n_known:]
    whole, own = np.linalg.norm(wrench, axis=0)[axes], np.linalg.norm(columns[:, rows], axis=0)
    share: FloatArray = np.divide(own, whole, out=np.zeros(len(own)), where=whole > 0.0)
    return share


def _effect(what: str, fit: Fit, found: tuple[Row, ...], share: FloatArray) -> Effect:
    fits, errors = [fit, *(row.fit for row in found)], [row.rms for row in found]
    if not fit.model.n_coefficients or not all(one.status.usable for one in fits):
        return Effect(what)
    ways = [np.abs(one.damping.coefficients - fit.damping.coefficients) for one in fits[1:]]
    move = np.max(ways, axis=0)
    worst, covariance = int(np.argmax(move * share)), fit.damping.covariance
    variance = 0.0 if covariance is None else float(covariance[worst, worst])
    return Effect(
        change=what,
        label=fit.model.labels[worst],
        wrench_share=float(move[worst] * share[worst]),
        standard_errors=float(move[worst]) / variance**0.5 if variance > 0.0 else None,
        rms=None if None in errors else max(filter(None, errors), default=0.0),
    )


def variants(vehicle: Vehicle) -> Iterator[tuple[str, tuple[Vehicle, ...]]]:
    """Move mass, added mass, W - B and r_G, one at a time, each where there is one to move."""
    added, mass = vehicle.added_mass, vehicle.mass_matrix
    parts = {"mass and added mass": mass}
    if added is not None:
        parts = {"mass": mass - added, "added mass": added}
    for name, part in parts.items():
        if part.any():
            moved = (
                _with_mass(vehicle, mass + way * part) for way in (-RELATIVE_STEP, RELATIVE_STEP)
            )
            yield f"{name} ±{100.0 * RELATIVE_STEP:g} %", tuple(moved)
    step = RELATIVE_STEP * (abs(vehicle.weight - vehicle.buoyancy) or NEUTRAL_TRIM * vehicle.weight)
    if step and np.any(vehicle.free[[2, 3, 4]]):
        trimmed = (replace(vehicle, buoyancy=vehicle.buoyancy - way) for way in (-step, step))
        yield f"W - B ±{step:.2g} N", tuple(trimmed)
    center = vehicle.center_of_gravity
    if not center.any():
        return
    coupling = np.zeros((6, 6))
    if added is not None:
        rigid = mass - added
        coupling[:3, 3:], coupling[3:, :3] = rigid[:3, 3:], rigid[3:, :3]
    shifted = (
        replace(_with_mass(vehicle, mass + way * coupling), center_of_gravity=(1.0 + way) * center)
        for way in (-RELATIVE_STEP, RELATIVE_STEP)
    )
    yield f"r_G ±{100.0 * RELATIVE_STEP:g} %", tuple(shifted)


def _with_mass(vehicle: Vehicle, mass_matrix: FloatArray) -> Vehicle:
    """Another mass matrix; which part of it is added mass is no longer of interest."""
    return replace(vehicle, mass_matrix=mass_matrix, added_mass=None)


def _size(rms: float | None) -> str:
    return "diverged" if rms is None else f"{rms:.3g}"
