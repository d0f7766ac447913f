"""What each row contributes to each coefficient of a linear estimate.

Least squares, ridge and weighted least squares are linear in what they explain: the
coefficients are ``Σᵢ Bᵢ Uᵢᵀ σᵢ`` over the axes, with Uᵢ the orthonormal directions that the
columns of axis i span. Directions come from the scaled design itself, through the same
rank-revealing factorisation that solves it; the Gram matrix is never formed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.regression.coupled import stacked
from hydrodamp.identification.regression.shrinkage import column_size, shrunk
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.rows.rank import Span, spanned
from hydrodamp.identification.uncertainty.tapered_blocks import Blocks
from hydrodamp.models.model import DampingModel


@dataclass(frozen=True, eq=False)
class Influence:
    """A linear estimate, axis by axis.

    Attributes
    ----------
    axes : tuple of int
        The k axes it looks at, 0 (X) to 5 (N).
    directions : tuple of k ndarrays, shape (m, r_i)
        Orthonormal; in the formula Uᵢ.
    amounts : tuple of k ndarrays, shape (n_coefficients, r_i)
        What a unit of each direction adds to each coefficient; in the formula Bᵢ.
    """

    axes: tuple[int, ...]
    directions: tuple[FloatArray, ...]
    amounts: tuple[FloatArray, ...]

    def coefficients(self, target: FloatArray) -> FloatArray:
        """Return the estimate.

        Parameters
        ----------
        target : ndarray, shape (m, 6)
            Wrench to explain, X Y Z [N], K M N [N m], body frame.

        Returns
        -------
        coefficients : ndarray, shape (n_coefficients,)
            In the order of the model's labels.
        """
        coefficients = np.zeros(len(self.amounts[0]))
        for axis, unit, amounts in zip(self.axes, self.directions, self.amounts, strict=True):
            coefficients += amounts @ (unit.T @ target[:, axis])
        return coefficients

    def scores(self, errors: FloatArray, blocks: Blocks | None = None) -> FloatArray:
        """Return what the error of each row adds to each coefficient.

        Parameters
        ----------
        errors : ndarray, shape (m, 6)
            What a fit on these very directions leaves over, force [N] and moment [N m].
        blocks : Blocks, optional
            Where the fit's share of the variance is to be put back, see
            :meth:`hydrodamp.identification.uncertainty.tapered_blocks.Blocks.restoring`.

        Returns
        -------
        scores : ndarray, shape (m, n_coefficients)
            One row a row.
        """
        scores = np.zeros((len(errors), len(self.amounts[0])))
        for axis, unit, amounts in zip(self.axes, self.directions, self.amounts, strict=True):
            made = amounts if blocks is None else amounts @ blocks.restoring(unit)
            scores += (unit * errors[:, [axis]]) @ made.T
        return scores

    def on(self, wider: Sequence[FloatArray]) -> Influence:
        """Return the same estimate on directions that contain its own.

        Parameters
        ----------
        wider : sequence of k ndarrays, shape (m, s_i)
            Orthonormal directions, one set an axis.

        Returns
        -------
        influence : Influence
            The same coefficients from the same rows.
        """
        parts = zip(self.directions, self.amounts, wider, strict=True)
        amounts = tuple(made @ (unit.T @ wide) for unit, made, wide in parts)
        return Influence(self.axes, tuple(wider), amounts)


def least_squares_influence(rows: Rows, model: DampingModel) -> Influence:
    """Return the influence of rows on ordinary least squares.

    Parameters
    ----------
    rows : Rows
        With columns for all terms of the model.
    model : DampingModel
        Restricted to the free axes.

    Returns
    -------
    influence : Influence
        The coefficients of :func:`hydrodamp.identification.rows.rank.solve_axis`.
    """
    axes, spans = _spans(rows, model)
    return _alone(axes, spans, [np.ones(span.rank) for span in spans])


def ridge_influence(rows: Rows, model: DampingModel, strength: FloatArray) -> Influence:
    """Return the influence of rows on ridge regression of given strength.

    Parameters
    ----------
    rows : Rows
        With columns for all terms of the model.
    model : DampingModel
        Restricted to the free axes.
    strength : ndarray, shape (6,)
        Of each axis, without unit, as in :class:`hydrodamp.identification.regression.ridge.Ridge`;
        how it was chosen is not part of the influence.

    Returns
    -------
    influence : Influence
        The coefficients of :func:`hydrodamp.identification.regression.ridge.solve_ridge`.
    """
    triangle = rows.triangle()
    sizes = {axis: column_size(triangle, terms) for axis, terms in enumerate(model.terms) if terms}
    axes, spans = _spans(rows, model, sizes)
    shares = [
        shrunk(span.singular, strength[axis], rows.n)
        for axis, span in zip(axes, spans, strict=True)
    ]
    return _alone(axes, spans, shares)


def weighted_influence(rows: Rows, model: DampingModel, whitening: FloatArray) -> Influence:
    """Return the influence of rows on least squares weighted across axes.

    Parameters
    ----------
    rows : Rows
        With columns for all terms of the model.
    model : DampingModel
        Restricted to the free axes.
    whitening : ndarray, shape (k, k)
        Makes the errors of the k axes that have terms white, in 1/N and 1/(N m). How it was
        found is not part of the influence.

    Returns
    -------
    influence : Influence
        The coefficients of :class:`hydrodamp.identification.regression.generalised.
        GeneralisedLeastSquares`. Every axis looks at the directions of all.
    """
    axes, spans = _spans(rows, model)
    common = spanned(np.hstack([span.directions for span in spans]), range(_ranks(spans)))
    unit = common.directions
    design = stacked(whitening, [unit.T @ span.directions for span in spans])
    q, r = np.linalg.qr(design)
    inverse = solve_triangular(r, q.T).reshape(design.shape[1], len(axes), common.rank)
    back = _back(spans)
    weighted = np.einsum("iah,ab->bih", inverse, whitening)
    return Influence(axes, (unit,) * len(axes), tuple(back @ part for part in weighted))


def directions(rows: Rows, model: DampingModel, axes: Sequence[int]) -> tuple[FloatArray, ...]:
    """Return what the columns of a model span on some axes.

    Parameters
    ----------
    rows : Rows
        With columns for all terms of the model.
    model : DampingModel
        Restricted to the free axes.
    axes : sequence of int
        Which axes, 0 (X) to 5 (N).

    Returns
    -------
    directions : tuple of ndarray, shape (m, r_i)
        Orthonormal, one set an axis.
    """
    return tuple(_span(rows, model, axis).directions for axis in axes)


def _spans(
    rows: Rows, model: DampingModel, sizes: dict[int, FloatArray] | None = None
) -> tuple[tuple[int, ...], list[Span[int]]]:
    axes = tuple(axis for axis, terms in enumerate(model.terms) if terms)
    return axes, [_span(rows, model, axis, (sizes or {}).get(axis)) for axis in axes]


def _span(rows: Rows, model: DampingModel, axis: int, scale: FloatArray | None = None) -> Span[int]:
    columns = [rows.basis.index(term) for term in model.terms[axis]]
    return spanned(rows.design[:, columns], columns, scale)


def _alone(axes: tuple[int, ...], spans: list[Span[int]], shares: list[FloatArray]) -> Influence:
    """Return the influence of axes solved one by one, each direction times its share."""
    ends = np.cumsum([span.rank for span in spans])
    amounts = np.split(_back(spans), ends, axis=1)[:-1]
    return Influence(
        axes,
        tuple(span.directions for span in spans),
        tuple(made * share for made, share in zip(amounts, shares, strict=True)),
    )


def _back(spans: list[Span[int]]) -> FloatArray:
    """Return the coefficients of each direction, shape (n_coefficients, sum of ranks)."""
    made: FloatArray = block_diag(*[span.coefficients for span in spans])
    return made


def _ranks(spans: list[Span[int]]) -> int:
    return sum(span.rank for span in spans)
