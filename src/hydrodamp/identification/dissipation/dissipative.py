"""Least squares whose damping takes power everywhere the vehicle operates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError
from hydrodamp.identification.dissipation.dissipative_set import Dissipating, DissipativeSet
from hydrodamp.identification.dissipation.operating_box import OperatingBox, operating_box
from hydrodamp.identification.dissipation.power import worst_found
from hydrodamp.identification.dissipation.price import Price, price
from hydrodamp.identification.fit import Fit, empty_fit, fitted
from hydrodamp.identification.linear import refused
from hydrodamp.identification.rows import Equations
from hydrodamp.identification.triangle import AxisSolution, Triangle, solve_axis
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

RIDGE = 1e-6
"""Pull towards zero, as a share of the length of each column: it settles what the data
leave open and moves nothing that they tell by more than one part in a million."""

_DEAR = 0.01
"""A proof that costs more than this share of the residual is compared with the least
price of any coefficients that dissipate."""

_FEW_ROUNDS = 6
"""Rounds of cutting planes for that comparison."""


@dataclass(frozen=True)
class Dissipative:
    """Least squares with damping that takes power at every velocity of a box.

    Where each term of the model is a velocity or a product of two, absolute or not, the
    constraint is a set of matrix inequalities at the corners of the box, and the fit
    carries a proof. Else the worst velocities are searched for and forbidden one by one,
    and the fit says what was checked. Clarabel solves both.

    Terms with commands, weight, constants or (eta-1) stay free: they are no damping.
    The constraint says nothing outside the box.

    Parameters
    ----------
    equations : Equations
        Rows of the regression; smoothed slopes by default.
    box : OperatingBox, optional
        Where the damping is to take power; by default from the quantiles of the log, see
        :func:`hydrodamp.identification.dissipation.operating_box.operating_box`.
    margin : float
        [1/s]. The power is to be at most ``−margin · νᵀMν``: damping alone then halves
        the speed within ``ln 2 / margin``. Zero asks for no more than no push.
    certify : bool
        Whether to look for a proof; cutting planes alone are often cheaper in residual.

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
    certify: bool = True

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
            Its remarks say what is proven or checked, and what the constraint costs. No
            covariance: the estimate lies on the rim of a set.

        Raises
        ------
        MethodError
            If no coefficients dissipate as much as the margin asks for.
        """
        free = model.restricted_to(problem.vehicle.axes)
        triangle = self.equations.rows(problem).triangle()
        status = refused(problem, free, triangle)
        if status is not None:
            return empty_fit(problem, free, self.key, status)
        wanted = self.wanted(problem, free)
        axes = [solve_axis(triangle, terms, axis) for axis, terms in enumerate(free.terms)]
        weights = inverse_variances(triangle, axes)
        found = dissipative_solution(triangle, weights, wanted)
        columns = [triangle.basis.index(term) for terms in free.terms for term in terms]
        seen = np.any(triangle.r[:, columns], axis=0)
        return fitted(
            problem,
            free,
            self,
            np.where(seen, found.coefficients, 0.0),  # the solver leaves some 1e-16
            rank=sum(axis.span.rank for axis in axes),
            aliased=_aliased(axes),
            n_samples=triangle.n_samples,
            remarks=_remarks(triangle, weights, wanted, found),
        )

    def wanted(self, problem: Problem, model: DampingModel) -> DissipativeSet:
        """Return the set that the coefficients are taken from.

        Parameters
        ----------
        problem : Problem
            Gives the box where none was given, and the mass matrix.
        model : DampingModel
            Restricted to the free axes.

        Returns
        -------
        wanted : DissipativeSet
            On the free axes.
        """
        box = self.box or operating_box(problem)
        free = problem.vehicle.free
        return DissipativeSet(
            model,
            OperatingBox(box.low * free, box.high * free),
            self.margin * problem.vehicle.mass_matrix * np.outer(free, free),
            self.certify,
        )


def dissipative_solution(
    triangle: Triangle, weights: FloatArray, wanted: DissipativeSet, rounds: int | None = None
) -> Dissipating:
    """Return the dissipative coefficients of least weighted residual."""
    roots, points = zip(
        *(
            _ridged(triangle, terms, axis, weights[axis])
            for axis, terms in enumerate(wanted.model.terms)
        ),
        strict=True,
    )
    root, point = block_diag(*roots), np.concatenate(points)
    return wanted.nearest(point, root) if rounds is None else wanted.nearest(point, root, rounds)


def inverse_variances(triangle: Triangle, axes: list[AxisSolution]) -> FloatArray:
    """Return one over the residual variance of each axis without the constraint."""
    targets = np.linalg.norm(triangle.r[:, len(triangle.basis) :], axis=0)
    least = 1e-6 * targets / np.sqrt(triangle.n_samples)
    deviation = np.maximum([axis.residual for axis in axes], least)
    return np.asarray(np.where(deviation > 0.0, deviation, 1.0) ** -2.0)


def _ridged(
    triangle: Triangle, terms: tuple[Term, ...], axis: int, weight: float
) -> tuple[FloatArray, FloatArray]:
    """Return the root of the squared residual of an axis, and where it is least."""
    if not terms:
        return np.zeros((0, 0)), np.zeros(0)
    chosen = [triangle.basis.index(term) for term in terms]
    unit = np.sqrt(weight / triangle.n_samples)
    design = unit * triangle.r[:, chosen]
    length = np.linalg.norm(design, axis=0)
    length[length == 0.0] = 1.0
    rows = np.vstack([design / length, RIDGE * np.eye(len(chosen))])
    target = np.append(unit * triangle.r[:, len(triangle.basis) + axis], np.zeros(len(chosen)))
    point = np.linalg.lstsq(rows, target, rcond=None)[0]
    return np.linalg.qr(rows, mode="r") * length, point / length


def _aliased(axes: list[AxisSolution]) -> tuple[tuple[str, ...], ...]:
    return tuple(
        tuple(f"{name}_{term}" for term in group)
        for name, axis in zip(AXES, axes, strict=True)
        for group in axis.span.aliased
    )


def _remarks(
    triangle: Triangle, weights: FloatArray, wanted: DissipativeSet, found: Dissipating
) -> tuple[str, ...]:
    """Say what is proven or checked, what it costs and what was left free."""
    if not wanted.power.counted.any():
        return ("No term is damping: there was nothing to constrain.",)
    if not np.all(np.isfinite(found.coefficients)):
        return ()
    cost = price(triangle, weights, wanted.model, found.coefficients)
    return (
        _known(wanted, found),
        str(cost),
        *_compared(triangle, weights, wanted, found, cost),
        *_left_free(wanted),
    )


def _known(wanted: DissipativeSet, found: Dissipating) -> str:
    worst = worst_found(lambda nu: wanted.power.power(found.coefficients, nu), wanted.searched)
    if found.certified:
        what = "inequality proves" if found.n_corners == 1 else "inequalities prove"
        rest = f", but for {found.bound:.1g} W of rounding" if found.bound > 0.0 else ""
        return (
            f"Certified: {found.n_corners} matrix {what} that the damping takes power "
            f"everywhere on {wanted.box}{rest}; the worst power found is {worst}."
        )
    ended = "" if found.done else ", and were stopped there"
    return (
        f"Checked, not proven: the worst power found on {wanted.box} is {worst}, after "
        f"{found.rounds} rounds of cutting planes{ended}."
    )


def _compared(
    triangle: Triangle,
    weights: FloatArray,
    wanted: DissipativeSet,
    found: Dissipating,
    cost: Price,
) -> Iterator[str]:
    """Say how much of a dear proof's price any dissipative coefficients would cost."""
    if not (found.certified and cost.total > _DEAR):
        return
    searched = replace(wanted, certify=False)
    other = dissipative_solution(triangle, weights, searched, _FEW_ROUNDS)
    least = price(triangle, weights, wanted.model, other.coefficients).total
    if least < 0.5 * cost.total:
        yield (
            f"Most of that is the price of the proof: without it {100.0 * least:.2g} % "
            f"{'is' if other.done else 'or little more may be'} enough (`certify=False`)."
        )


def _left_free(wanted: DissipativeSet) -> Iterator[str]:
    count = int(np.count_nonzero(~wanted.power.counted))
    if count:
        yield (
            f"Left free, for they are no damping: {count} coefficients of terms with commands, "
            "weight, constants or (eta-1)."
        )
