"""How far coefficients move where the vehicle's own numbers are wrong."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, Method
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.parallel import each
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import replay
from hydrodamp.simulation.score import score
from hydrodamp.validation.vehicle_variants import Variant, variants
from hydrodamp.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Sway:
    """What an error of one number of the vehicle does."""

    what: str
    label: str = ""
    share: float = 0.0
    errors: float | None = None
    rms: float | None = None
    moved: bool = True

    def line(self, before: float | None) -> str:
        """Return what happens, as a line."""
        if not self.moved:
            return self.what
        if not self.label:
            return f"{self.what}: nothing could be identified"
        many = "" if self.errors is None else f", {self.errors:.1f} standard errors"
        return (
            f"{self.what}: {self.label} moves by {100.0 * self.share:.1f} % of the damping on its "
            f"axis{many}; RMS of the replay {_size(before)} -> {_size(self.rms)}"
        )


@dataclass(frozen=True)
class VehicleDoubt:
    """How far a fit rests on the numbers of the vehicle.

    Attributes
    ----------
    model, method : str
        Their keys.
    rms : float or None
        RMS error of the replay with the vehicle as it is; None where it diverged.
    sways : tuple of Sway
        One a number of the vehicle.
    """

    model: str
    method: str
    rms: float | None
    sways: tuple[Sway, ...]

    @property
    def worst(self) -> Sway | None:
        """The number whose error moves a coefficient furthest; None where none does."""
        moved = [sway for sway in self.sways if sway.label]
        return max(moved, key=lambda sway: sway.share, default=None)

    @property
    def sentence(self) -> str:
        """The worst of it, as a remark of a fit."""
        if self.worst is None:
            return "No number of the vehicle could be moved, or nothing was identified."
        return f"If the vehicle is wrong, most for {self.worst.line(self.rms)}."

    def __str__(self) -> str:
        """Return a line for each number."""
        lines = [f"  {sway.line(self.rms)}" for sway in self.sways]
        head = f"If the vehicle is wrong ({self.model}, again by {self.method}, and replayed):"
        return "\n".join([head, *lines])


def vehicle_doubt(
    vehicle: Vehicle,
    train: Log,
    test: Log,
    model: DampingModel,
    method: Method,
    share: float = 0.1,
) -> VehicleDoubt:
    """Identify and replay with each number of the vehicle moved both ways.

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
    share : float
        How far to move each number, as a share of it.

    Returns
    -------
    doubt : VehicleDoubt
        For mass, added mass, W - B and r_G, see
        :func:`hydrodamp.validation.vehicle_variants.variants`.

    Raises
    ------
    MethodError
        If the share is not between 0 and 1.
    ProblemError
        If a log lacks what the vehicle or a term needs.

    Examples
    --------
    >>> from hydrodamp.identification.linear import LeastSquares
    >>> from hydrodamp.models.catalog import catalog
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> campaign = reenact(duration=10.0)
    >>> logs = campaign.train, campaign.test
    >>> doubt = vehicle_doubt(campaign.vehicle, *logs, catalog["fossen"], LeastSquares())
    >>> len(doubt.sways)
    4
    """
    if not 0.0 < share < 1.0:
        raise MethodError(f"`share` must lie between 0 and 1, such as 0.1; got {share}")
    wrong = variants(vehicle, share)
    vehicles = [vehicle, *(one for variant in wrong for one in variant.vehicles)]
    found = each(_fitted, [(one, train, test, model, method) for one in vehicles])
    fit, rms = found[0]
    size, wrench = _sizes(prepare(vehicle, train, model), fit)
    later = iter(found[1:])
    sways = tuple(
        _sway(variant, fit, [next(later) for _ in variant.vehicles], size, wrench)
        for variant in wrong
    )
    return VehicleDoubt(fit.model.key, fit.method, rms, sways)


def _fitted(
    vehicle: Vehicle, train: Log, test: Log, model: DampingModel, method: Method
) -> tuple[Fit, float | None]:
    """Return a fit and the RMS error of its replay."""
    fit = method.identify(prepare(vehicle, train, model), model)
    if not fit.status.usable:
        return fit, None
    trajectory = replay(prepare(vehicle, test, model), fit.damping)
    return fit, score(trajectory, vehicle.axes).rms


def _sizes(problem: Problem, fit: Fit) -> tuple[FloatArray, FloatArray]:
    """Root mean square of each coefficient's column, and of the wrench on its axis."""
    rows, axes = problem.columns.entries(fit.model)
    design = problem.regressor()[:, problem.columns.n_known :]
    columns = design[:, rows - problem.columns.n_known]
    wrench = np.zeros(len(AXES))
    for axis in range(len(AXES)):
        here = axes == axis
        explained = columns[:, here] @ fit.damping.coefficients[here]
        wrench[axis] = np.sqrt(np.mean(explained**2))
    return np.sqrt(np.mean(columns**2, axis=0)), wrench[axes]


def _sway(
    variant: Variant,
    fit: Fit,
    found: list[tuple[Fit, float | None]],
    size: FloatArray,
    wrench: FloatArray,
) -> Sway:
    if not variant.vehicles:
        return Sway(variant.what, moved=False)
    usable = fit.status.usable and all(other.status.usable for other, _ in found)
    if not usable or not fit.model.n_coefficients:
        return Sway(variant.what)
    ways = [np.abs(other.damping.coefficients - fit.damping.coefficients) for other, _ in found]
    move = np.max(ways, axis=0)
    share = move * size / np.where(wrench > 0.0, wrench, np.inf)
    worst = int(np.argmax(share))
    scores = [rms for _, rms in found]
    return Sway(
        what=variant.what,
        label=fit.model.labels[worst],
        share=float(share[worst]),
        errors=_in_errors(float(move[worst]), fit, worst),
        rms=None if None in scores else max(rms for rms in scores if rms is not None),
    )


def _in_errors(move: float, fit: Fit, place: int) -> float | None:
    covariance = fit.damping.covariance
    if covariance is None or not covariance[place, place] > 0.0:
        return None
    return move / float(np.sqrt(covariance[place, place]))


def _size(rms: float | None) -> str:
    return "diverged" if rms is None else f"{rms:.3g}"
