"""Least squares that starts from what was known: a normal prior and the rows of a log."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, fitted
from hydrodamp.identification.linear import LinearEstimator, Regression, Solver
from hydrodamp.identification.rows import Equations
from hydrodamp.identification.triangle import (
    Triangle,
    column_size,
    group_labels,
    solve_axis,
    spanned,
)
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.models.damping import Damping, warn_if_foreign
from hydrodamp.models.model import DampingModel, read_label
from hydrodamp.simulation.problem import Problem, stamp

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
    >>> Prior(known, relative=0.05, rotary=0.1).deviations()
    {'Y_v': 1.0, 'N_r': 0.4}
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

    def deviations(self) -> dict[str, float]:
        """Return the standard deviation of each coefficient that the set has, by label."""
        if self.relative is None:
            variance = dict(
                zip(self.damping.model.labels, np.diag(self._covariance()), strict=True)
            )
            return {label: float(np.sqrt(max(variance[label], 0.0))) for label in self.known}
        return {
            label: self._share(label, self.relative) * abs(value)
            for label, value in self.known.items()
        }

    def rows(self, labels: tuple[str, ...], wide: Mapping[str, float]) -> Belief:
        """Return the prior as rows of a regression.

        Parameters
        ----------
        labels : tuple of n str
            Of the model to be identified.
        wide : mapping of str to float
            For each label the size of a coefficient that alone would make the axis's
            wrench; not finite where its column is zero.

        Returns
        -------
        belief : Belief
            Mean and root on those labels.
        """
        place = {label: i for i, label in enumerate(labels)}
        shared = [label for label in self.known if label in place]
        mean = np.zeros(len(labels))
        mean[[place[label] for label in shared]] = [self.known[label] for label in shared]
        spread = np.array([self.wide * wide[label] for label in labels])
        loose = np.array([label not in self.known and np.isfinite(wide[label]) for label in labels])
        free = np.diag(1.0 / np.where(loose, spread, 1.0))[loose]
        sure = np.zeros((0, len(labels)))
        if shared:
            part = self._root(shared)
            sure = np.zeros((len(part), len(labels)))
            sure[:, [place[label] for label in shared]] = part
        return Belief(mean, np.vstack([sure, free]), len(shared))

    def _share(self, label: str, relative: float) -> float:
        _, term = read_label(label)
        turns = any(factor.strip("|") in ("p", "q", "r") for factor in term.factors)
        return self.rotary if turns and self.rotary is not None else relative

    def _covariance(self) -> FloatArray:
        n = self.damping.model.n_coefficients
        return np.zeros((n, n)) if self.damping.covariance is None else self.damping.covariance

    def _root(self, shared: list[str]) -> FloatArray:
        """Return R with RᵀR the inverse covariance of some coefficients."""
        deviation = self.deviations()
        scale = np.array([deviation[label] for label in shared])
        scale[scale == 0.0] = 1.0
        if self.relative is not None:
            return np.diag(1.0 / scale)
        places = [self.damping.model.index(label) for label in shared]
        covariance = self._covariance()[np.ix_(places, places)]
        values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
        kept = values > _NO_VARIANCE * max(values[-1], 0.0)
        root: FloatArray = vectors[:, kept].T / np.sqrt(values[kept])[:, None] / scale
        return root


@dataclass(frozen=True)
class Belief:
    """A normal prior on the coefficients of a model, as rows ``root κ = root mean``."""

    mean: FloatArray
    root: FloatArray
    n_known: int

    @property
    def deviation(self) -> FloatArray:
        """Standard deviation of each coefficient, infinite where it is free, shape (n,)."""
        free = np.full(len(self.mean), np.inf)
        if not len(self.root):
            return free
        size = np.linalg.norm(self.root, axis=0)
        size[size == 0.0] = 1.0
        inverse = np.linalg.pinv(self.root / size) / size[:, None]
        held = np.diag(inverse @ self.root) > 1.0 - 1e-6
        return np.where(held, np.sqrt(np.sum(inverse * inverse, axis=1)), free)


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

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "prior"

    def identify_all(self, problem: Problem, models: Iterable[DampingModel]) -> tuple[Fit, ...]:
        """Identify several models from one triangle.

        Parameters
        ----------
        problem : Problem
            Prepared for the terms of all models.
        models : iterable of DampingModel
            Which terms.

        Returns
        -------
        fits : tuple of Fit
            In the order of the models, with the posterior covariance; rank and aliases are
            those of the data alone. Remarks say what the data moved and what they leave to the
            prior.

        Warns
        -----
        ForeignVehicleWarning
            If the set belongs to a vehicle of another mass, weight or buoyancy.
        """
        warn_if_foreign(self.prior.damping, stamp(problem.vehicle))
        return super().identify_all(problem, models)

    def _solver(self, regression: Regression) -> Solver:
        triangle = regression.triangle

        def solve(model: DampingModel) -> Fit:
            belief = self.prior.rows(model.labels, _wide(triangle, model))
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

        return solve

    def _said(
        self, labels: tuple[str, ...], belief: Belief, mean: FloatArray, covariance: FloatArray
    ) -> tuple[str, ...]:
        deviation, known = belief.deviation, set(self.prior.known)
        moved = np.abs(mean - belief.mean) > _FAR * deviation
        kept = (np.sqrt(np.diag(covariance)) > _UNTOUCHED * deviation) & ~moved
        surprised = [label for label, far in zip(labels, moved, strict=True) if far]
        return (
            f"Prior '{self.prior.damping.model.key}' has {belief.n_known} of {len(labels)} "
            "coefficients; the others start at zero.",
            *_listed(
                f"Moved by more than {_FAR:g} prior deviations",
                [label for label in surprised if label in known],
            ),
            *_listed(
                "The data say next to nothing about",
                [label for label, same in zip(labels, kept, strict=True) if same],
            ),
        )


def posterior(
    design: FloatArray, target: FloatArray, belief: Belief
) -> tuple[FloatArray, FloatArray]:
    """Return mean and covariance of coefficients after white rows were seen."""
    span = spanned(np.vstack([design, belief.root]), range(len(belief.mean)))
    change = np.concatenate([target - design @ belief.mean, np.zeros(len(belief.root))])
    mean = belief.mean + span.coefficients @ (span.directions.T @ change)
    return mean, span.coefficients @ span.coefficients.T


def _wide(triangle: Triangle, model: DampingModel) -> dict[str, float]:
    """Return for each coefficient the size at which it alone makes its axis's wrench."""
    sizes = {}
    norms = np.linalg.norm(triangle.r[:, len(triangle.basis) :], axis=0)
    wrenches = (norms / np.sqrt(triangle.n_samples)).tolist()
    for axis, (terms, wrench) in enumerate(zip(model.terms, wrenches, strict=True)):
        for term, size in zip(terms, column_size(triangle, terms), strict=True):
            seen = wrench > 0.0 and bool(np.any(triangle.columns([term])))
            sizes[f"{AXES[axis]}_{term}"] = wrench / float(size) if seen else np.inf
    return sizes


def _listed(head: str, labels: list[str]) -> list[str]:
    """Return a remark naming labels, or none."""
    if not len(labels):
        return []
    more = f" and {len(labels) - _NAMED} more" if len(labels) > _NAMED else ""
    return [f"{head}: {' '.join(labels[:_NAMED])}{more}."]
