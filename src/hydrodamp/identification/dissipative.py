"""Least squares with dissipative damping, by cutting planes and least distance programming.

Minimises ``|R (κ − κ_LS)|`` subject to ``ν·τ(ν; κ) ≤ 0`` for every velocity ν of an operating box.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import block_diag, solve_triangular
from scipy.optimize import nnls

from hydrodamp.arrays import FloatArray, factorisation
from hydrodamp.identification.dissipativity import (
    OperatingBox,
    PowerRegressor,
    local_maxima,
    max_damping_power,
    operating_box,
    relative_square,
    sample_box,
)
from hydrodamp.identification.fit import Fit, empty_fit, make_fit
from hydrodamp.identification.least_squares import rank_status
from hydrodamp.identification.regression import RegressionForm, Triangle, group_labels, solve_axis
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

# Ridge as a share of the length of each column: it makes aliased coefficients unique and changes
# determined ones by less than one part in a million.
_RIDGE = 1e-6

# Maximum number of cutting-plane iterations.
_MAX_ITERATIONS = 40

# Violations below this share of the greatest power tighten all planes by a margin. The margin may
# increase the distance by at most the factor: for a set without interior it would grow forever.
_TOLERANCE, _MAX_DISTANCE_RATIO = 2e-5, 2.0

# Planes with a multiplier below this share of the largest, and a slack above that share of the
# greatest power, are dropped.
_MIN_MULTIPLIER, _MAX_SLACK = 1e-9, 1e-3

# Largest scaled coefficient of a program, suited to the tolerances of the solver.
_SCALE = 100.0

# Residual of the least distance program, also relative to the largest multiplier, below which the
# planes are infeasible.
_INFEASIBLE = 1e-10

# Relative growth of the residual below which it is rounding of the solver.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Dissipative:
    """Least squares constrained to dissipative damping at every velocity of a box.

    Each iteration searches for the velocities of greatest injected power, adds them as linear
    constraints, and solves the quadratic program again, until none violates the constraint. In
    products such as v|r| the absolute value counts as an independent speed within the box, a
    stricter condition that keeps replays of large models bounded. The maximum is found by search;
    it is not proven to be global.

    Terms with commands, weight, constants or (eta-1) are unconstrained.
    The constraint does not apply outside the box.

    Parameters
    ----------
    equations : Equations
        Rows of the regression; the weak form by default.
    box : OperatingBox, optional
        Velocities at which the damping must be dissipative; by default from the quantiles of
        the log, see :func:`~hydrodamp.identification.dissipativity.operating_box`.

    Examples
    --------
    >>> Dissipative().key
    'dissipative'
    """

    equations: RegressionForm = field(default_factory=WeakRegression)
    box: OperatingBox | None = None

    key = "dissipative"

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify one model; remarks give the greatest power and the cost of the constraint.

        There is no covariance: the estimate may lie on the boundary of the feasible set.
        """
        model = model.restricted_to(problem.vehicle.axes)
        triangle = self.equations.rows(problem).triangle()
        if (status := rank_status(problem, model, triangle)) is not None:
            return empty_fit(problem, model, self.key, status)
        solutions = [solve_axis(triangle, terms, axis) for axis, terms in enumerate(model.terms)]
        floor = 1e-6 * np.linalg.norm(triangle.r[:, -6:], axis=0) / np.sqrt(triangle.n_samples)
        deviation = np.maximum([solution.residual for solution in solutions], floor)
        deviation[deviation == 0.0] = 1.0
        root, point = _quadratic_form(triangle, model, deviation)
        power = PowerRegressor(model)
        box = self.box or operating_box(problem)
        box = box.restrict(problem.vehicle.free & power.velocities)
        coefficients, iterations = project_dissipative(power, box, root, point)
        nonzero = np.concatenate([np.any(triangle.columns(row), axis=0) for row in model.terms])
        coefficients = np.where(nonzero, coefficients, 0.0)  # rounding makes about 1e-16
        remarks = ("The model has no damping term: there is no constraint.",)
        if power.counted.any():
            worst = max_damping_power(Damping(model, coefficients), box)
            cost = _constraint_cost(root @ (coefficients - point), sum(map(bool, model.terms)))
            remarks = (
                f"Dissipative by search, not proven: the maximum damping power on {box} is "
                f"{worst.power:.3g} W, after {iterations} cutting-plane iterations"
                f"{' (the maximum)' if iterations == _MAX_ITERATIONS else ''}. "
                f"{cost} Terms with commands, weight, constants or (eta-1) are unconstrained.",
            )
        return make_fit(
            problem,
            model,
            self,
            coefficients,
            rank=sum(solution.span.rank for solution in solutions),
            aliased=group_labels(solution.span.aliased for solution in solutions),
            n_samples=triangle.n_samples,
            remarks=remarks,
        )


def project_dissipative(
    power: PowerRegressor, box: OperatingBox, root: FloatArray, target: FloatArray
) -> tuple[FloatArray, int]:
    """Minimise ``|root (κ − target)|`` over dissipative κ; return κ and the iterations."""
    if not power.counted.any():
        return target, 0
    scale = np.linalg.norm(root, axis=0)
    unit = float(np.abs(scale * target).max()) / _SCALE or 1.0
    root, point, scale = root / scale, scale * target / unit, scale / unit
    x, margin, planes = point, 0.0, np.zeros((0, len(point)))
    for iteration in range(_MAX_ITERATIONS):
        new, greatest = _worst_planes(power, box, x, scale)
        violation = new @ x
        if violation.max() <= 0.0:
            return x / scale, iteration
        if violation.max() < _TOLERANCE * greatest:
            margin += 2.0 * float(violation.max())
        violated = (violation > -margin) & np.any(new, axis=1)  # zero velocity gives no plane
        planes = np.vstack([planes, new[violated]])
        solution, multipliers = _least_distance(root, point, planes, margin)
        if solution is None or (margin > 0.0 and not _is_near(root, point, x, solution)):
            return x / scale, iteration
        x = solution
        near = planes @ x > -_MAX_SLACK * greatest
        planes = planes[near | (multipliers > _MIN_MULTIPLIER * multipliers.max())]
    return x / scale, _MAX_ITERATIONS


def _worst_planes(
    power: PowerRegressor, box: OperatingBox, x: FloatArray, scale: FloatArray
) -> tuple[FloatArray, float]:
    """Return planes at the local maxima of power over the box, and the greatest power."""

    def injected(velocity: FloatArray) -> FloatArray:
        return power.power(x / scale, velocity, box)

    def relative(velocity: FloatArray) -> FloatArray:
        return injected(velocity) / relative_square(velocity, box)

    maxima = np.vstack([local_maxima(measure, box) for measure in (injected, relative)])
    coarse = np.round(maxima / np.where(box.max_abs > 0.0, box.max_abs, 1.0), 3)
    velocity = maxima[np.unique(coarse, axis=0, return_index=True)[1]]
    speeds = power.worst_speeds(x / scale, velocity, box)
    rows = power.rows(velocity, speeds) / scale / relative_square(velocity, box)[:, None]
    return rows, float(np.abs(relative(sample_box(box))).max())


@factorisation("triangle of the rows")
def _least_distance(
    root: FloatArray, point: FloatArray, planes: FloatArray, margin: float
) -> tuple[FloatArray | None, FloatArray]:
    """Minimise ``|root (x − point)|`` with ``planes x ≤ −margin``; return x and the multipliers.

    Least distance programming of Lawson and Hanson (1974, chapter 23). With z = root (x − point)
    and G z ≥ h, non-negative least squares of [G h]ᵀ u = (0, 1) has a residual r, and
    z = −r / r_last; where r is zero, the constraints are infeasible and x is None.
    """
    normals = -solve_triangular(root, planes.T, trans="T").T
    offsets = planes @ point + margin
    length = np.linalg.norm(normals, axis=1)
    size = float(np.abs(offsets / length).max()) or 1.0
    table = np.vstack([(normals / length[:, None]).T, offsets / length / size])
    target = np.zeros(len(table))
    target[-1] = 1.0
    multipliers, _ = nnls(table, target, maxiter=100 * len(planes))
    residual = target - table @ multipliers
    if residual[-1] < _INFEASIBLE * max(1.0, multipliers.max()):
        return None, multipliers
    return point - solve_triangular(root, size * residual[:-1] / residual[-1]), multipliers


def _is_near(root: FloatArray, point: FloatArray, before: FloatArray, after: FloatArray) -> bool:
    """Whether a step with a larger margin increases the distance only moderately."""
    distance = float(np.linalg.norm(root @ (before - point)))
    largest = max(_MAX_DISTANCE_RATIO * distance, _TOLERANCE * float(np.linalg.norm(root @ point)))
    return float(np.linalg.norm(root @ (after - point))) <= largest


@factorisation("triangle of the rows")
def _quadratic_form(
    triangle: Triangle, model: DampingModel, deviation: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the R factor of the ridge objective of all axes, and its minimiser."""
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


def _constraint_cost(distance: FloatArray, n_axes: int) -> str:
    """Describe the growth of the RMS residual over least squares, normalised to 1 on each axis."""
    growth = float(np.sqrt(1.0 + distance @ distance / n_axes)) - 1.0
    if not growth > _ROUNDING:
        return "The constraint is inactive: the least-squares damping is dissipative."
    return f"The constraint increases the RMS residual by {100.0 * growth:.2g} %."
