"""Least squares weighted by the residual covariance, all axes coupled."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.linalg import solve_triangular

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, fitted, trusted
from hydrodamp.identification.refusal import refused
from hydrodamp.identification.regression.coupled import Coupled
from hydrodamp.identification.regression.covariance import linear_uncertainty
from hydrodamp.identification.regression.influence import weighted_influence
from hydrodamp.identification.regression.weighting import (
    Whitening,
    checked_covariance,
    given_whitening,
    whitening,
)
from hydrodamp.identification.rows.equations import Equations
from hydrodamp.identification.rows.triangle import Triangle
from hydrodamp.identification.rows.weak_equations import WeakEquations
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

_SETTLED = 1e-7
"""Weights have settled when a round moves the fit by less than this share of the noise."""


@dataclass(frozen=True, eq=False)
class GeneralisedLeastSquares:
    """Least squares on all axes at once, weighted by the covariance of the residuals.

    Parameters
    ----------
    equations : Equations, optional
        Where the rows come from.
    weighting : array_like, shape (6, 6), optional
        Covariance of the residual wrench X Y Z [N], K M N [N m], where it is known; by
        default that of the residuals, renewed round by round.
    rounds : int
        How often it is renewed at most. One is Zellner's two-step estimate.

    Raises
    ------
    MethodError
        If the weighting is no symmetric matrix of six axes, is singular on the axes of
        the model (when it is used), or there is no round.

    Examples
    --------
    >>> GeneralisedLeastSquares().key
    'gls'
    """

    equations: Equations = field(default_factory=WeakEquations)
    weighting: FloatArray | None = None
    rounds: int = 100

    def __post_init__(self) -> None:
        """Check and copy the weighting."""
        if self.weighting is not None:
            object.__setattr__(self, "weighting", checked_covariance(self.weighting))
        if self.rounds < 1:
            raise MethodError(f"`rounds` must be at least 1; got {self.rounds}")

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "gls"

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
            With rank, aliased labels and standard errors for coloured noise, between axes
            too; where the rows are too few for those, for rows that are white in time.
        """
        return self.identify_all(problem, (model,))[0]

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
            In the order of the models.
        """
        triangle = self.equations.triangle(problem)
        return tuple(self._trusted(triangle, problem, model) for model in models)

    def solve(self, triangle: Triangle, problem: Problem, model: DampingModel) -> Fit:
        """Solve one model from a triangle, without the data.

        Parameters
        ----------
        triangle : Triangle
            Of the problem, or merged from parts of it.
        problem : Problem
            Names the vehicle and the log.
        model : DampingModel
            Which terms; restricted to the vehicle's free axes.

        Returns
        -------
        fit : Fit
            As :meth:`identify`, but with the covariance of rows that are white in time.
        """
        return self._solved(triangle, problem, model)[0]

    def _trusted(self, triangle: Triangle, problem: Problem, model: DampingModel) -> Fit:
        fit, weights = self._solved(triangle, problem, model)
        if weights is None:
            return fit
        influence = partial(weighted_influence, whitening=weights.matrix)
        return trusted(fit, linear_uncertainty(problem, self.equations, fit.model, influence))

    def _solved(
        self, triangle: Triangle, problem: Problem, model: DampingModel
    ) -> tuple[Fit, Whitening | None]:
        """Return the fit and the weights it was found with; None where there is no fit."""
        free = model.restricted_to(problem.vehicle.axes)
        refusal = refused(problem, free, self.key, triangle)
        if refusal is not None:
            return refusal, None
        coupled = Coupled.of(triangle, free)
        amounts, weights, rounds = self._weighted(coupled)
        back = coupled.back()
        fit = fitted(
            problem,
            free,
            self,
            back @ amounts,
            covariance=back @ _covariance(coupled, weights, amounts) @ back.T,
            rank=coupled.rank,
            aliased=coupled.aliased,
            n_samples=triangle.n_samples,
            remarks=(*_correlation(coupled, amounts), *self._course(weights, rounds)),
        )
        return fit, weights

    def _weighted(self, coupled: Coupled) -> tuple[FloatArray, Whitening, int]:
        """Return the amounts, the weights they were found with and the rounds it took."""
        if self.weighting is not None:
            weights = given_whitening(self.weighting, coupled.axes)
            return _solved(coupled, weights), weights, 0
        amounts = coupled.alone()
        noise = _SETTLED * np.sqrt(coupled.n_samples)
        for done in range(1, self.rounds + 1):
            weights, before = _found(coupled, amounts), amounts
            amounts = _solved(coupled, weights)
            if np.linalg.norm(coupled.stacked(weights.matrix) @ (amounts - before)) < noise:
                return amounts, weights, done
        return amounts, weights, self.rounds + 1

    def _course(self, weights: Whitening, rounds: int) -> tuple[str, ...]:
        said = []
        if self.weighting is None and self.rounds > 1:
            settled = rounds <= self.rounds
            said.append(
                f"The weights settled in round {rounds}."
                if settled
                else f"The weights had not settled after {self.rounds} rounds."
            )
        if weights.floored:
            said.append(
                "The residual covariance is singular (an axis leaves nothing over, or axes leave "
                "over the same): its smallest deviations were raised to a floor."
            )
        return tuple(said)


def _found(coupled: Coupled, amounts: FloatArray) -> Whitening:
    size = np.linalg.norm(coupled.target, axis=0)
    return whitening(coupled.left_over(amounts), coupled.freedom, size)


def _solved(coupled: Coupled, weights: Whitening) -> FloatArray:
    q, r = np.linalg.qr(coupled.stacked(weights.matrix))
    amounts: FloatArray = solve_triangular(r, q.T @ (weights.matrix @ coupled.target.T).ravel())
    return amounts


def _covariance(coupled: Coupled, weights: Whitening, amounts: FloatArray) -> FloatArray:
    """Return the covariance of the amounts for rows white in time, whatever the weights."""
    q, r = np.linalg.qr(coupled.stacked(weights.matrix))
    inverse = solve_triangular(r, q.T)
    left_over = coupled.left_over(amounts) / np.sqrt(coupled.freedom)
    root = np.linalg.qr(left_over @ weights.matrix.T)[1]
    blocks = inverse.reshape(len(inverse), len(coupled.axes), -1)
    half = np.einsum("iah,ba->ibh", blocks, root).reshape(len(inverse), -1)
    covariance: FloatArray = half @ half.T
    return covariance


def _correlation(coupled: Coupled, amounts: FloatArray) -> tuple[str, ...]:
    """Name the two axes whose residuals are most alike."""
    left_over = coupled.left_over(amounts)
    size = np.linalg.norm(left_over, axis=0)
    if len(size) < 2 or not np.all(size > 0.0):
        return ()
    cosines = np.triu((left_over / size).T @ (left_over / size), 1)
    one, other = np.unravel_index(int(np.abs(cosines).argmax()), cosines.shape)
    return (
        f"Residuals of {AXES[coupled.axes[one]]} and {AXES[coupled.axes[other]]} are the most "
        f"alike, with a correlation of {cosines[one, other]:.2f}.",
    )
