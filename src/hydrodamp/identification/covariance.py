"""How far to trust the coefficients of a linear estimate on coloured, overlapping rows.

The covariance counts all that a model leaves over: noise and what its form cannot follow.
For a model whose form fits the two are one. For one whose form does not, such as the linear
model of a vehicle with quadratic drag, intervals are wide: other manoeuvres would give
other coefficients.

Beside it stands the part from noise alone: sailed again through the same manoeuvres, what
would the same estimator say? There noise is what a reference regression leaves over on the
same rows, one with the model's own terms and more (A. Abadie, G. W. Imbens and F. Zheng,
"Inference for Misspecified Models With Fixed Regressors", 2014,
doi:10.1080/01621459.2014.928218). It leaves out sensor noise times misfit, which for a wrong
model may be most of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import MethodError
from hydrodamp.identification.equations import Equations, Rows
from hydrodamp.identification.influence import Influence, directions, least_squares_influence
from hydrodamp.identification.long_run import block_length
from hydrodamp.identification.reference import with_reference
from hydrodamp.identification.tapered_blocks import Blocks, blocks_of
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

_WIDER = 1.5
"""From here on a median ratio of standard errors is told."""

_OUTSIDE = 1e-6
"""A direction that lies outside others by less than this share is within them."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """How far to trust some coefficients.

    Attributes
    ----------
    covariance : ndarray, shape (n, n)
        Of the coefficients, from all that the model leaves over.
    degrees_of_freedom : float
        How well it is known: intervals use Student's t with this many.
    method : str
        How it was found, in words.
    noise : ndarray, shape (n, n), or None
        The same from noise alone; None where the method does not tell them apart.
    block : float or None
        Length of the blocks [s]; None where there are none.
    n_blocks : int
        How many fit side by side.

    Raises
    ------
    MethodError
        If a covariance is not square, their shapes differ, or the degrees of freedom are
        not positive.

    Examples
    --------
    >>> found = Uncertainty(np.diag([4.0, 9.0]), degrees_of_freedom=np.inf, method="by hand")
    >>> found.standard_errors.tolist(), found.interval([10.0, 20.0])[0].round(2).tolist()
    ([2.0, 3.0], [6.08, 13.92])
    """

    covariance: FloatArray
    degrees_of_freedom: float
    method: str
    noise: FloatArray | None = None
    block: float | None = None
    n_blocks: int = 0

    def __post_init__(self) -> None:
        """Copy the arrays and check them."""
        n = len(np.atleast_1d(self.covariance))
        for name in ("covariance", "noise"):
            if getattr(self, name) is not None:
                try:
                    values = frozen(getattr(self, name), (n, n), name)
                except ValueError as error:
                    raise MethodError(f"{error}; give one row and column a coefficient") from error
                object.__setattr__(self, name, values)
        if not self.degrees_of_freedom > 0.0:
            raise MethodError(
                f"`degrees_of_freedom` must be positive; got {self.degrees_of_freedom}"
            )

    @property
    def standard_errors(self) -> FloatArray:
        """Standard error of each coefficient, shape (n,)."""
        return np.sqrt(np.diag(self.covariance))

    def reach(self, level: float = 0.95) -> float:
        """Return how many standard errors an interval reaches to either side.

        Parameters
        ----------
        level : float
            Share of repetitions in which the interval holds what is sought.

        Returns
        -------
        reach : float
            Quantile of Student's t; 1.96 for many degrees of freedom.

        Raises
        ------
        MethodError
            If the level is not between 0 and 1.
        """
        if not 0.0 < level < 1.0:
            raise MethodError(f"`level` must lie between 0 and 1; got {level}")
        return float(student.ppf(0.5 + level / 2.0, self.degrees_of_freedom))

    def interval(self, coefficients: FloatArray, level: float = 0.95) -> FloatArray:
        """Return the interval of each coefficient.

        Parameters
        ----------
        coefficients : array_like, shape (n,)
            The estimate.
        level : float
            As in :meth:`reach`.

        Returns
        -------
        interval : ndarray, shape (n, 2)
            Lower and upper end.

        Raises
        ------
        MethodError
            If the level is not between 0 and 1.
        """
        half = self.reach(level) * self.standard_errors
        centre = np.asarray(coefficients, dtype=np.float64)
        return np.column_stack([centre - half, centre + half])

    def __str__(self) -> str:
        """Return one sentence, or two."""
        if self.block is None:
            return f"Standard errors are from {self.method}."
        return (
            f"Standard errors are from {self.method}, in {self.n_blocks} blocks of "
            f"{self.block:.3g} s; intervals have {self.degrees_of_freedom:.0f} degrees of freedom."
            + self._misfit()
        )

    def _misfit(self) -> str:
        if self.noise is None:
            return ""
        own, noise = np.diag(self.covariance), np.diag(self.noise)
        known = (own > 0.0) & (noise > 0.0)
        ratio = float(np.sqrt(np.median(own[known] / noise[known]))) if known.any() else 1.0
        if ratio < _WIDER:
            return ""
        return (
            f" They are {ratio:.2g} times those of noise alone: most of the errors are the "
            "model's form, and other manoeuvres would give other coefficients."
        )


def rows_covariance(
    rows: Rows,
    influence: Influence,
    model: DampingModel,
    reference: DampingModel | None = None,
    block: float | None = None,
) -> Uncertainty:
    """Return the covariance of a linear estimate, all axes together.

    Parameters
    ----------
    rows : Rows
        Those of the estimate, with columns for the terms of both models.
    influence : Influence
        What each row contributes, on the terms of the model.
    model : DampingModel
        Restricted to the free axes.
    reference : DampingModel, optional
        What it leaves over is noise alone; it needs all terms of the model. By default the
        model itself.
    block : float, optional
        Length of a block [s]; from the correlation of the scores by default.

    Returns
    -------
    uncertainty : Uncertainty
        The variance that the regression takes from its residuals is put back, see
        :meth:`hydrodamp.identification.tapered_blocks.Blocks.taken`.

    Raises
    ------
    MethodError
        If the block is not positive, or the rows leave the reference nothing over: too few
        for its terms.

    Notes
    -----
    Noise of the velocities that enters the regressor is part of the residuals. What it does
    to the estimate of a wrong model through the size of the misfit is not.
    """
    if not influence.axes:
        return Uncertainty(np.zeros((0, 0)), np.inf, "no coefficients")
    own = _on_reference(rows, influence, model)
    errors = _left_over(rows, own)
    length = block or block_length(own.scores(errors), rows.segment, rows.time)
    blocks = blocks_of(rows.segment, rows.time, length)
    covariance = _restored(own, errors, blocks)
    if reference is not None:
        wide = _on_reference(rows, influence, reference)
    return Uncertainty(
        covariance=covariance,
        noise=None if reference is None else _restored(wide, _left_over(rows, wide), blocks),
        degrees_of_freedom=blocks.degrees_of_freedom,
        method="the scores of the model's residuals",
        block=blocks.length,
        n_blocks=blocks.n,
    )


def reference_rows(
    problem: Problem, equations: Equations, model: DampingModel
) -> tuple[Rows, DampingModel]:
    """Return rows with the columns of a model and of its reference.

    Parameters
    ----------
    problem : Problem
        Vehicle and log.
    equations : Equations
        Where rows come from; one that chooses a setting from the terms is to have it fixed,
        so that the rows are those of the estimate.
    model : DampingModel
        Restricted to the free axes.

    Returns
    -------
    rows : Rows
        For :func:`rows_covariance`.
    reference : DampingModel
        The model's own terms and those of Gertler and Hagen.
    """
    wide = with_reference(problem, model)
    return equations.rows(wide), wide.models[1]


def least_squares_uncertainty(
    problem: Problem, equations: Equations, model: DampingModel, block: float | None = None
) -> Uncertainty:
    """Return how far to trust ordinary least squares on some rows.

    Parameters
    ----------
    problem : Problem
        Vehicle and log.
    equations : Equations
        Where the rows of the estimate came from.
    model : DampingModel
        Which terms.
    block : float, optional
        Length of a block [s].

    Returns
    -------
    uncertainty : Uncertainty
        In the order of the labels of the model restricted to the free axes.

    Raises
    ------
    MethodError
        As :func:`rows_covariance`.

    Examples
    --------
    >>> from hydrodamp.identification.equations import Differenced
    >>> from hydrodamp.models.catalog import catalog
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> from hydrodamp.simulation.problem import prepare
    >>> campaign, fossen = reenact(duration=20.0), catalog["fossen"]
    >>> problem = prepare(campaign.vehicle, campaign.train, fossen)
    >>> least_squares_uncertainty(problem, Differenced(), fossen).standard_errors.shape
    (12,)
    """
    free = model.restricted_to(problem.vehicle.axes)
    rows, reference = reference_rows(problem, equations, free)
    return rows_covariance(rows, least_squares_influence(rows, free), free, reference, block)


def noise_uncertainty(
    problem: Problem, equations: Equations, model: DampingModel
) -> Uncertainty | None:
    """Return how far to trust least squares, or None where its rows cannot tell.

    Parameters
    ----------
    problem : Problem
        Vehicle and log.
    equations : Equations
        Where the rows of the estimate came from.
    model : DampingModel
        Which terms.

    Returns
    -------
    uncertainty : Uncertainty or None
        As :func:`least_squares_uncertainty`; None where the rows are too few for the
        reference.
    """
    try:
        return least_squares_uncertainty(problem, equations, model)
    except MethodError:
        return None


def _on_reference(rows: Rows, influence: Influence, reference: DampingModel) -> Influence:
    """Return the influence on all directions of the reference, and on its own where it has more."""
    pairs = zip(directions(rows, reference, influence.axes), influence.directions, strict=True)
    return influence.on([_joined(wide, own) for wide, own in pairs])


def _joined(wide: FloatArray, own: FloatArray) -> FloatArray:
    """Return orthonormal directions of both; the first where it holds the second."""
    rest = own - wide @ (wide.T @ own)
    left, singular, _ = np.linalg.svd(rest, full_matrices=False)
    return np.hstack([wide, left[:, singular > _OUTSIDE]])


def _left_over(rows: Rows, influence: Influence) -> FloatArray:
    errors = rows.target.copy()
    for axis, unit in zip(influence.axes, influence.directions, strict=True):
        if rows.n <= unit.shape[1]:
            raise MethodError(
                f"{rows.n} rows are too few for a reference regression of {unit.shape[1]} terms, "
                "so there is no noise to measure: give a longer log"
            )
        errors[:, axis] -= unit @ (unit.T @ errors[:, axis])
    return errors


def _restored(influence: Influence, errors: FloatArray, blocks: Blocks) -> FloatArray:
    return blocks.covariance(influence.scores(errors, blocks))
