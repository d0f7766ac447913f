"""Least squares that starts from what was known: a normal prior and the rows of a log."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, fitted
from hydrodamp.identification.linear import LinearEstimator, Regression
from hydrodamp.identification.rows import Equations
from hydrodamp.identification.triangle import Triangle, group_labels, solve_axis, spanned
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.models.damping import Damping, warn_if_foreign
from hydrodamp.models.model import DampingModel, read_label
from hydrodamp.simulation.problem import stamp

# Eigenvalues of a correlation matrix below this share of the largest are zero: directions that a
# fit could not determine, or surer ones than its covariance can hold.
_NO_VARIANCE = 1e-12

# Residuals below this share of the target are rounding, not noise.
_ROUNDING = 1e-9

# Prior standard deviations from which on a coefficient counts as moved by the data, the share of
# its own that it keeps where data say little, and how many labels a remark names.
_FAR, _UNTOUCHED, _NAMED = 2.0, 0.9, 8


@dataclass(frozen=True, eq=False)
class Prior:
    """A published coefficient set, or an earlier fit, as a normal prior.

    Parameters
    ----------
    damping : Damping
        Its coefficients are the mean. One that is zero or not finite counts as lacking.
    relative : float, optional
        Standard deviation as a share of each coefficient, such as 0.05. By default the
        covariance of the set is taken; directions it gives no variance, as those a fit
        could not determine, are left free.
    rotary : float, optional
        The same for terms with an angular velocity in them, ``relative`` by default.
        Roddy (1990, DTRC/SHD-1298-08, appendix C) states 4 to 5 % for the static and
        10 % for the rotary coefficients of a captive model test.
    wide : float
        Standard deviation of a coefficient that the set lacks, around zero: how large
        its part of the wrench may be, as a share of the root mean square on its axis.

    Raises
    ------
    MethodError
        If a share is not positive, or there are neither shares nor a covariance.

    Examples
    --------
    >>> known = Damping.from_dict(None, {"Y_v": -20.0, "N_r": -4.0})
    >>> Prior(known, relative=0.05, rotary=0.1).known
    {'Y_v': -20.0, 'N_r': -4.0}
    """

    damping: Damping
    relative: float | None = None
    rotary: float | None = None
    wide: float = 1.0

    def __post_init__(self) -> None:
        """Refuse a prior that says nothing or is absurdly sure."""
        shares = {"relative": self.relative, "rotary": self.rotary, "wide": self.wide}
        for name, share in shares.items():
            if share is not None and not (np.isfinite(share) and share > 0.0):
                raise MethodError(f"`{name}` must be a positive share, such as 0.1; got {share}")
        if self.relative is None and self.damping.covariance is None:
            raise MethodError(
                f"the coefficients of '{self.damping.model.key}' have no covariance: state how "
                "sure they are, such as `relative=0.1`"
            )
        if self.relative is None and self.rotary is not None:
            raise MethodError("`rotary` goes with `relative`: give both, or none")

    @property
    def known(self) -> dict[str, float]:
        """The coefficients that the set has, by label."""
        values = self.damping.as_dict()
        return {k: value for k, value in values.items() if value != 0.0 and np.isfinite(value)}

    def belief(self, labels: tuple[str, ...], wide: FloatArray) -> Belief:
        """Return the prior on some labels; one that is lacking may be as large as ``wide`` says."""
        known = self.known
        here = [place for place, label in enumerate(labels) if label in known]
        mean = np.array([known.get(label, 0.0) for label in labels])
        deviation, correlation = self.wide * wide, np.eye(len(labels))
        if self.relative is not None:
            deviation[here] = [self._share(labels[place]) * abs(mean[place]) for place in here]
        elif self.damping.covariance is not None:
            there = [self.damping.model.index(labels[place]) for place in here]
            covariance = self.damping.covariance[np.ix_(there, there)]
            deviation[here] = np.sqrt(np.maximum(np.diag(covariance), 0.0))
            scale = np.where(deviation[here] > 0.0, deviation[here], 1.0)
            correlation[np.ix_(here, here)] = covariance / np.outer(scale, scale)
        held = np.flatnonzero(np.isfinite(deviation))
        scale = np.where(deviation[held] > 0.0, deviation[held], 1.0)
        values, vectors = np.linalg.eigh(correlation[np.ix_(held, held)])
        sure = values > _NO_VARIANCE * values.max(initial=0.0)
        root = np.zeros((int(sure.sum()), len(labels)))
        root[:, held] = vectors[:, sure].T / np.sqrt(values[sure])[:, None] / scale
        whole = np.sum(vectors[:, sure] ** 2, axis=1) > 1.0 - 1e-6
        deviation[held] = np.where(whole, deviation[held], np.inf)
        return Belief(mean, deviation, root)

    def _share(self, label: str) -> float:
        _, term = read_label(label)
        turns = any(factor.strip("|") in ("p", "q", "r") for factor in term.factors)
        share = self.rotary if turns and self.rotary is not None else self.relative
        assert share is not None
        return share


@dataclass(frozen=True, eq=False)
class Belief:
    """A normal prior as rows ``root κ = root mean``; deviations are infinite where it is free."""

    mean: FloatArray
    deviation: FloatArray
    root: FloatArray


@dataclass(frozen=True, eq=False)
class PriorLeastSquares(LinearEstimator):
    """Least squares with a prior from a published set or an earlier fit.

    Each axis weighs its rows by the residuals of ordinary least squares, taken as white
    in time: coloured rows count for more than they should beside the prior.

    Parameters
    ----------
    prior : Prior
        The coefficients known and how sure they are.
    equations : Equations, optional
        Where the rows come from.

    Examples
    --------
    >>> from hydrodamp.models.published import published
    >>> PriorLeastSquares(Prior(published["vt690-sname2022"], relative=0.3)).key
    'prior'
    """

    prior: Prior
    equations: Equations = field(default_factory=WeakEquations)

    def __post_init__(self) -> None:
        """Refuse what is no prior, such as a bare damping."""
        if not isinstance(self.prior, Prior):
            raise MethodError(
                "`prior` must be a Prior, such as Prior(damping, relative=0.1); got "
                f"{type(self.prior).__name__}"
            )

    key = "prior"

    def _solved(self, regression: Regression, model: DampingModel) -> Fit:
        """Return the posterior; rank and aliases are those of the data alone."""
        triangle = regression.triangle
        warn_if_foreign(self.prior.damping, stamp(regression.problem.vehicle))
        belief = self.prior.belief(model.labels, _wide(triangle, model))
        solved = [solve_axis(triangle, terms, axis) for axis, terms in enumerate(model.terms)]
        seen, found = [], []
        for axis, (terms, one) in enumerate(zip(model.terms, solved, strict=True)):
            # What the data say as white rows, one for each direction they determine.
            target, back = triangle.target(axis), one.span.directions.T
            size = np.linalg.norm(target)
            left_over = max(np.linalg.norm(target - back.T @ (back @ target)), _ROUNDING * size)
            weight = np.sqrt(max(triangle.n_samples - one.span.rank, 1.0)) / (left_over or 1.0)
            seen.append(weight * (back @ triangle.columns(terms)))
            found.append(weight * (back @ target))
        mean, covariance = posterior(block_diag(*seen), np.concatenate(found), belief)
        return fitted(
            regression.problem,
            model,
            self,
            mean,
            covariance=covariance,
            rank=sum(one.span.rank for one in solved),
            aliased=group_labels(enumerate(one.span.aliased for one in solved)),
            n_samples=triangle.n_samples,
            remarks=self._said(model.labels, belief, mean, covariance),
        )

    def _said(
        self, labels: tuple[str, ...], belief: Belief, mean: FloatArray, covariance: FloatArray
    ) -> tuple[str, ...]:
        known = [label in self.prior.known for label in labels]
        moved = np.abs(mean - belief.mean) > _FAR * belief.deviation
        kept = (np.sqrt(np.diag(covariance)) > _UNTOUCHED * belief.deviation) & ~moved
        told = [
            f"Prior '{self.prior.damping.model.key}' has {sum(known)} of {len(labels)} "
            "coefficients; the others start at zero."
        ]
        for head, chosen in (
            (f"Moved by more than {_FAR:g} prior deviations", moved & known),
            ("The data say next to nothing about", kept),
        ):
            named = [label for label, this in zip(labels, chosen, strict=True) if this]
            more = f" and {len(named) - _NAMED} more" if len(named) > _NAMED else ""
            told += [f"{head}: {' '.join(named[:_NAMED])}{more}."] if named else []
        return tuple(told)


def posterior(
    design: FloatArray, target: FloatArray, belief: Belief
) -> tuple[FloatArray, FloatArray]:
    """Return mean and covariance of coefficients after white rows were seen."""
    span = spanned(np.vstack([design, belief.root]), range(len(belief.mean)))
    change = np.concatenate([target - design @ belief.mean, np.zeros(len(belief.root))])
    mean = belief.mean + span.coefficients @ (span.directions.T @ change)
    return mean, span.coefficients @ span.coefficients.T


def _wide(triangle: Triangle, model: DampingModel) -> FloatArray:
    """Return the size at which each coefficient alone makes its axis's wrench; else infinity."""
    wide = []
    for axis, terms in enumerate(model.terms):
        wrench = np.linalg.norm(triangle.target(axis))
        column = np.linalg.norm(triangle.columns(terms), axis=0)
        seen = (column > 0.0) & (wrench > 0.0)
        wide.append(np.divide(wrench, column, out=np.full(len(terms), np.inf), where=seen))
    return np.concatenate(wide)
