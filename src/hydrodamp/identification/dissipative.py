"""Least squares whose damping takes power everywhere the vehicle operates."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import block_diag, solve_triangular
from scipy.optimize import nnls

from hydrodamp.arrays import FloatArray, factorisation
from hydrodamp.identification.dissipativity import (
    OperatingBox,
    PowerRows,
    local_maxima,
    max_damping_power,
    operating_box,
    relative_square,
    sample_box,
)
from hydrodamp.identification.fit import Fit, empty_fit, make_fit
from hydrodamp.identification.least_squares import rank_status
from hydrodamp.identification.qr_factor import Triangle, group_labels, solve_axis
from hydrodamp.identification.regression_rows import RegressionForm
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.models.damping import Damping
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

# A share left over, or of the pressure that rounds it, below which no coefficients satisfy all
# planes.
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

    Examples
    --------
    >>> Dissipative().key
    'dissipative'
    """

    equations: RegressionForm = field(default_factory=WeakRegression)
    box: OperatingBox | None = None

    key = "dissipative"

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
        """
        model = model.restricted_to(problem.vehicle.axes)
        triangle = self.equations.rows(problem).triangle()
        if (status := rank_status(problem, model, triangle)) is not None:
            return empty_fit(problem, model, self.key, status)
        plain = [solve_axis(triangle, terms, axis) for axis, terms in enumerate(model.terms)]
        least = 1e-6 * np.linalg.norm(triangle.r[:, -6:], axis=0) / np.sqrt(triangle.n_samples)
        deviation = np.maximum([one.residual for one in plain], least)
        deviation[deviation == 0.0] = 1.0
        root, point = _ridged(triangle, model, deviation)
        power = PowerRows(model)
        box = self.box or operating_box(problem)
        box = box.restrict(problem.vehicle.free & power.velocities)
        found, rounds = project_dissipative(power, box, root, point)
        seen = np.concatenate([np.any(triangle.columns(row), axis=0) for row in model.terms])
        found = np.where(seen, found, 0.0)  # the solver leaves some 1e-16
        remarks = ("No term is damping: there was nothing to constrain.",)
        if power.counted.any():
            worst = max_damping_power(Damping(model, found), box)
            price = _price(root @ (found - point), sum(map(bool, model.terms)))
            remarks = (
                f"Checked by search, not proven: the worst power found on {box} is "
                f"{worst.power:.3g} W, after {rounds} rounds of cutting planes"
                f"{', and were stopped there' if rounds == _ROUNDS else ''}. "
                f"{price} Terms with commands, weight, constants or (eta-1) are left free.",
            )
        return make_fit(
            problem,
            model,
            self,
            found,
            rank=sum(one.span.rank for one in plain),
            aliased=group_labels(one.span.aliased for one in plain),
            n_samples=triangle.n_samples,
            remarks=remarks,
        )


def project_dissipative(
    power: PowerRows, box: OperatingBox, root: FloatArray, wished: FloatArray
) -> tuple[FloatArray, int]:
    """Return coefficients that no search of a box objects to, and the rounds that it took.

    ``|root (κ − wished)|`` is least among those that take power at the velocities found.
    """
    if not power.counted.any():
        return wished, 0
    scale = np.linalg.norm(root, axis=0)
    unit = float(np.abs(scale * wished).max()) / _SIZE or 1.0
    root, point, scale = root / scale, scale * wished / unit, scale / unit
    x, tighter, planes = point, 0.0, np.zeros((0, len(point)))
    for done in range(_ROUNDS):
        new, greatest = _pushing(power, box, x, scale)
        over = new @ x
        if over.max() <= 0.0:
            return x / scale, done
        if over.max() < _TOLERANCE * greatest:
            tighter += 2.0 * float(over.max())
        chosen = (over > -tighter) & np.any(new, axis=1)  # at rest there is no plane
        planes = np.vstack([planes, new[chosen]])
        moved, pressing = _program(root, point, planes, tighter)
        if moved is None or (tighter > 0.0 and not _worth(root, point, x, moved)):
            return x / scale, done
        x = moved
        near = planes @ x > -_SLACK * greatest
        planes = planes[near | (pressing > _PRESSING * pressing.max())]
    return x / scale, _ROUNDS


def _pushing(
    power: PowerRows, box: OperatingBox, x: FloatArray, scale: FloatArray
) -> tuple[FloatArray, float]:
    """Return planes at velocities of locally greatest power, and the greatest power."""

    def pushed(velocity: FloatArray) -> FloatArray:
        return power.power(x / scale, velocity, box)

    def relative(velocity: FloatArray) -> FloatArray:
        return pushed(velocity) / relative_square(velocity, box)

    found = np.vstack([local_maxima(measure, box) for measure in (pushed, relative)])
    coarse = np.round(found / np.where(box.max_abs > 0.0, box.max_abs, 1.0), 3)
    velocity = found[np.unique(coarse, axis=0, return_index=True)[1]]
    speeds = power.worst_speeds(x / scale, velocity, box)
    rows = power.rows(velocity, speeds) / scale / relative_square(velocity, box)[:, None]
    return rows, float(np.abs(relative(sample_box(box))).max())


@factorisation("triangle of the rows")
def _program(
    root: FloatArray, point: FloatArray, planes: FloatArray, tighter: float
) -> tuple[FloatArray | None, FloatArray]:
    """Return x of least ``|root (x − point)|`` with ``planes x ≤ −tighter``, and the pressures.

    Least distance programming of Lawson and Hanson (1974, chapter 23). With z = root (x − point)
    and G z ≥ h, non-negative least squares of [G h]ᵀ u = (0, 1) leaves r over, and z = −r / r_last;
    where it leaves nothing over, no x satisfies the planes.
    """
    given = -solve_triangular(root, planes.T, trans="T").T
    missing = planes @ point + tighter
    length = np.linalg.norm(given, axis=1)
    size = float(np.abs(missing / length).max()) or 1.0
    table = np.vstack([(given / length[:, None]).T, missing / length / size])
    target = np.zeros(len(table))
    target[-1] = 1.0
    pressing, _ = nnls(table, target, maxiter=100 * len(planes))
    left = target - table @ pressing
    if left[-1] < _INFEASIBLE * max(1.0, pressing.max()):
        return None, pressing
    return point - solve_triangular(root, size * left[:-1] / left[-1]), pressing


def _worth(root: FloatArray, point: FloatArray, before: FloatArray, after: FloatArray) -> bool:
    """Tell whether a step is worth a violation that hardly shows."""
    distance = float(np.linalg.norm(root @ (before - point)))
    least = _TOLERANCE * float(np.linalg.norm(root @ point))
    return float(np.linalg.norm(root @ (after - point))) <= max(_WORTH * distance, least)


@factorisation("triangle of the rows")
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


def _price(away: FloatArray, n_axes: int) -> str:
    """Say how much the residual grows over that of least squares, which is one on each axis."""
    total = float(np.sqrt(1.0 + away @ away / n_axes)) - 1.0
    if not total > _NOTHING:
        return "The constraint costs nothing: least squares dissipates already."
    return f"The constraint costs {100.0 * total:.2g} % of RMS residual."
