"""Least squares whose damping takes power everywhere the vehicle operates."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import block_diag, solve_triangular
from scipy.optimize import nnls

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, empty_fit, fitted
from hydrodamp.identification.linear import refused
from hydrodamp.identification.power import (
    OperatingBox,
    PowerRows,
    operating_box,
    size,
    spread,
    worst_found,
    worst_places,
)
from hydrodamp.identification.rows import Equations
from hydrodamp.identification.triangle import Triangle, group_labels, solve_axis
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

# Pull towards zero, as a share of the length of each column: it settles what the data leave open
# and moves nothing that they tell by more than one part in a million.
_RIDGE = 1e-6

# Rounds at the most.
_ROUNDS = 40

# Share of the greatest power below which a violation only tightens the planes. Tightening may
# lengthen the distance by the factor: sets without interior would have it grow without bound.
_TOLERANCE, _WORTH = 2e-5, 2.0

# Planes that press less than this share of the hardest, and are further away than that share of the
# greatest power, are dropped.
_PRESSING, _SLACK = 1e-9, 1e-3

# Size of the greatest scaled coefficient in a program; the solver's tolerances suit it.
_SIZE = 100.0

# A share left over below which no coefficients satisfy all planes.
_INFEASIBLE = 1e-10

# A relative growth of the residual below this is rounding of the solver.
_NOTHING = 1e-6


@dataclass(frozen=True)
class Dissipative:
    """Least squares with damping that takes power at every velocity of a box.

    The velocities at which a solution puts most power into the motion are searched for and
    forbidden, and the quadratic program is solved again, until no search objects. In products
    such as v|r| the absolute value counts as a speed of its own, anywhere within the box: that
    asks for more than the power needs, and keeps large models from running away. The fit says
    what was checked; that there is no worse velocity is not proven.

    Terms with commands, weight, constants or (eta-1) stay free: they are no damping.
    The constraint says nothing outside the box.

    Parameters
    ----------
    equations : Equations
        Rows of the regression; the weak form by default.
    box : OperatingBox, optional
        Where the damping is to take power; by default from the quantiles of the log, see
        :func:`hydrodamp.operating_box`.
    margin : float
        [1/s]. The power is to be at most ``−margin · νᵀMν``: damping alone then halves
        the speed within ``ln 2 / margin``. Zero asks for no more than no push.

    Raises
    ------
    MethodError
        If the margin is negative or not finite.

    Examples
    --------
    >>> Dissipative().key
    'dissipative'
    """

    equations: Equations = field(default_factory=WeakEquations)
    box: OperatingBox | None = None
    margin: float = 0.0

    def __post_init__(self) -> None:
        """Check the margin."""
        if not (np.isfinite(self.margin) and self.margin >= 0.0):
            raise MethodError(
                f"`margin` must be a rate of at least zero [1/s]; got {self.margin:g}."
            )

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "dissipative"

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify one model.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.

        Returns
        -------
        fit : Fit
            Its remarks say what was checked, and what the constraint costs. No covariance: the
            estimate lies on the rim of a set.

        Raises
        ------
        MethodError
            If no coefficients dissipate as much as the margin asks for.
        """
        model = model.restricted_to(problem.vehicle.axes)
        triangle = self.equations.rows(problem).triangle()
        status = refused(problem, model, triangle)
        if status is not None:
            return empty_fit(problem, model, self.key, status)
        plain = [solve_axis(triangle, terms, axis) for axis, terms in enumerate(model.terms)]
        least = 1e-6 * np.linalg.norm(triangle.r[:, -6:], axis=0) / np.sqrt(triangle.n_samples)
        deviation = np.maximum([one.residual for one in plain], least)
        deviation[deviation == 0.0] = 1.0
        root, point = _ridged(triangle, model, deviation)
        free, box = problem.vehicle.free, self.box or operating_box(problem)
        reserve = self.margin * problem.vehicle.mass_matrix * np.outer(free, free)
        power = PowerRows(model)
        planes = Planes(
            power, box.restricted(free & (power.velocities | reserve.any(axis=0))), reserve
        )
        found = planes.nearest(root, point)
        seen = np.concatenate([np.any(triangle.columns(row), axis=0) for row in model.terms])
        return fitted(
            problem,
            model,
            self,
            np.where(seen, found.coefficients, 0.0),  # the solver leaves some 1e-16
            rank=sum(one.span.rank for one in plain),
            aliased=group_labels(enumerate(one.span.aliased for one in plain)),
            n_samples=triangle.n_samples,
            remarks=_remarks(planes, found, _price(triangle, model, deviation, found.coefficients)),
        )


@dataclass(frozen=True, eq=False)
class Dissipating:
    """Coefficients that dissipate as far as a search tells, and whether it came to an end."""

    coefficients: FloatArray
    rounds: int = 0
    done: bool = True


@dataclass(frozen=True, eq=False)
class Planes:
    """All coefficients with ``ν·τ(ν) ≤ −νᵀ reserve ν`` on a box, a plane for each velocity."""

    power: PowerRows
    box: OperatingBox
    reserve: FloatArray

    def nearest(self, root: FloatArray, wished: FloatArray, rounds: int = _ROUNDS) -> Dissipating:
        """Return coefficients that no search objects to, ``|root (κ − wished)|`` being least."""
        if not self.power.counted.any():
            return Dissipating(wished)
        scale = np.linalg.norm(root, axis=0)
        unit = float(np.abs(scale * wished).max()) / _SIZE or 1.0
        root, point, scale = root / scale, scale * wished / unit, scale / unit
        x, tighter = point, 0.0
        planes, bounds = np.zeros((0, len(point))), np.zeros(0)
        for done in range(rounds):
            new, limits, greatest = self._violated(x, scale)
            over = new @ x - limits
            if over.max() <= 0.0:
                return Dissipating(x / scale, done)
            if over.max() < _TOLERANCE * greatest:
                tighter += 2.0 * float(over.max())
            chosen = (over > -tighter) & np.any(new, axis=1)  # at rest there is no plane
            planes = np.vstack([planes, new[chosen]])
            bounds = np.append(bounds, limits[chosen])
            moved, pressing, feasible = _program(root, point, planes, bounds - tighter)
            if tighter > 0.0 and not (feasible and _worth(root, point, x, moved)):
                return Dissipating(x / scale, done)
            if not feasible:
                raise MethodError(_impossible(self.power.model))
            x = moved
            near = bounds - planes @ x < _SLACK * greatest
            kept = near | (pressing > _PRESSING * pressing.max())
            planes, bounds = planes[kept], bounds[kept]
        return Dissipating(x / scale, rounds, False)

    def worst(self, coefficients: FloatArray) -> str:
        """Return the worst power found, and where."""
        return str(worst_found(lambda nu: self.power.power(coefficients, nu, self.box), self.box))

    def _violated(self, x: FloatArray, scale: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Return planes at velocities of locally greatest excess, and the greatest power."""

        def excess(velocity: FloatArray) -> FloatArray:
            power = self.power.power(x / scale, velocity, self.box)
            return power + self._reserved(velocity)

        def relative(velocity: FloatArray) -> FloatArray:
            return excess(velocity) / size(velocity, self.box)

        found = np.vstack([worst_places(measure, self.box) for measure in (excess, relative)])
        coarse = np.round(found / np.where(self.box.extent > 0.0, self.box.extent, 1.0), 3)
        velocity = found[np.unique(coarse, axis=0, return_index=True)[1]]
        length = size(velocity, self.box)
        speeds = self.power.worst_speeds(x / scale, velocity, self.box)
        rows = self.power.rows(velocity, speeds) / scale / length[:, None]
        greatest = float(np.abs(relative(spread(self.box))).max())
        return rows, -self._reserved(velocity) / length, greatest

    def _reserved(self, velocity: FloatArray) -> FloatArray:
        return np.asarray(np.sum((velocity @ self.reserve) * velocity, axis=1))


def _program(
    root: FloatArray, point: FloatArray, planes: FloatArray, bounds: FloatArray
) -> tuple[FloatArray, FloatArray, bool]:
    """Return x of least ``|root (x − point)|`` with ``planes x ≤ bounds``, and the pressures.

    Least distance programming of Lawson and Hanson (1974, chapter 23). With z = root (x − point)
    and G z ≥ h, non-negative least squares of [G h]ᵀ u = (0, 1) leaves r over, and z = −r / r_last;
    where it leaves nothing over, no x satisfies the planes.
    """
    given = -solve_triangular(root, planes.T, trans="T").T
    missing = planes @ point - bounds
    length = np.linalg.norm(given, axis=1)
    size = float(np.abs(missing / length).max()) or 1.0
    table = np.vstack([(given / length[:, None]).T, missing / length / size])
    target = np.zeros(len(table))
    target[-1] = 1.0
    pressing, _ = nnls(table, target, maxiter=100 * len(planes))
    left = target - table @ pressing
    if left[-1] < _INFEASIBLE:
        return point, pressing, False
    return point - solve_triangular(root, size * left[:-1] / left[-1]), pressing, True


def _worth(root: FloatArray, point: FloatArray, before: FloatArray, after: FloatArray) -> bool:
    """Tell whether a step is worth a violation that hardly shows."""
    distance = float(np.linalg.norm(root @ (before - point)))
    least = _TOLERANCE * float(np.linalg.norm(root @ point))
    return float(np.linalg.norm(root @ (after - point))) <= max(_WORTH * distance, least)


def _ridged(
    triangle: Triangle, model: DampingModel, deviation: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the root of the squared residual of all axes, and where it is least."""
    roots, points = [], []
    for axis, terms in enumerate(model.terms):
        unit, n = 1.0 / (deviation[axis] * np.sqrt(triangle.n_samples)), len(terms)
        design, target = unit * triangle.columns(terms), unit * triangle.target(axis)
        length = np.linalg.norm(design, axis=0)
        length[length == 0.0] = 1.0
        rows = np.vstack([design / length, _RIDGE * np.eye(n)])
        points.append(np.linalg.lstsq(rows, np.append(target, np.zeros(n)))[0] / length)
        roots.append(np.linalg.qr(rows, mode="r") * length)
    return block_diag(*roots), np.concatenate(points)


def _price(
    triangle: Triangle, model: DampingModel, deviation: FloatArray, coefficients: FloatArray
) -> str:
    """Say how much the residual grows over that of least squares."""
    ends = np.cumsum([len(terms) for terms in model.terms])[:-1]
    growth = {}
    for axis, part in enumerate(np.split(coefficients, ends)):
        if len(part):
            rest = triangle.columns(model.terms[axis]) @ part - triangle.target(axis)
            size = np.sqrt(triangle.n_samples) * deviation[axis]
            growth[AXES[axis]] = float(np.linalg.norm(rest) / size) - 1.0
    total = float(np.sqrt(np.mean((np.array([*growth.values()]) + 1.0) ** 2))) - 1.0
    if not total > _NOTHING:
        return "The constraint costs nothing: least squares dissipates already."
    shares = ", ".join(f"{k} {100.0 * v:.2g} %" for k, v in growth.items() if v > _NOTHING)
    return f"The constraint costs {100.0 * total:.2g} % of RMS residual ({shares})."


def _remarks(planes: Planes, found: Dissipating, price: str) -> tuple[str, ...]:
    """Say what was checked, what it costs and what was left free."""
    counted = planes.power.counted
    if not counted.any():
        return ("No term is damping: there was nothing to constrain.",)
    ended = "" if found.done else ", and were stopped there"
    checked = (
        f"Checked by search, not proven: the worst power found on {planes.box}, absolute values in "
        f"products varied apart, is {planes.worst(found.coefficients)}, after {found.rounds} "
        f"rounds of cutting planes{ended}."
    )
    n_free = int(np.count_nonzero(~counted))
    free = (
        f"Left free, for they are no damping: {n_free} coefficients of terms with commands, "
        "weight, constants or (eta-1)."
    )
    return (checked, price, *([free] if n_free else []))


def _impossible(model: DampingModel) -> str:
    own = [f"{axis}_{velocity}" for axis, velocity in zip(AXES, VELOCITIES, strict=True)]
    lacking = next((label for label in own if label not in model.labels), own[0])
    return (
        f"no coefficients of model '{model.key}' take as much power as `margin` asks for at "
        "every velocity of the operating box: lower `margin`, give a `box` that keeps "
        f"further away from rest, or add a term of its own velocity (such as {lacking}) to "
        "each axis."
    )
