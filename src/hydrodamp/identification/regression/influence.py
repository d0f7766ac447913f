"""What each row contributes to each coefficient of a linear estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.regression.shrinkage import column_size, shrunk
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.rows.rank import Span, spanned
from hydrodamp.identification.uncertainty.tapered_blocks import Blocks
from hydrodamp.models.model import DampingModel


@dataclass(frozen=True, eq=False)
class Influence:
    """A linear estimate, axis by axis."""

    axes: tuple[int, ...]
    directions: tuple[FloatArray, ...]
    amounts: tuple[FloatArray, ...]

    def coefficients(self, target: FloatArray) -> FloatArray:
        """Return the estimate."""
        coefficients = np.zeros(len(self.amounts[0]))
        for axis, unit, amounts in zip(self.axes, self.directions, self.amounts, strict=True):
            coefficients += amounts @ (unit.T @ target[:, axis])
        return coefficients

    def scores(self, errors: FloatArray, blocks: Blocks | None = None) -> FloatArray:
        """Return what the error of each row adds to each coefficient."""
        scores = np.zeros((len(errors), len(self.amounts[0])))
        for axis, unit, amounts in zip(self.axes, self.directions, self.amounts, strict=True):
            made = amounts if blocks is None else amounts @ blocks.restoring(unit)
            scores += (unit * errors[:, [axis]]) @ made.T
        return scores

    def on(self, wider: Sequence[FloatArray]) -> Influence:
        """Return the same estimate on directions that contain its own."""
        parts = zip(self.directions, self.amounts, wider, strict=True)
        amounts = tuple(made @ (unit.T @ wide) for unit, made, wide in parts)
        return Influence(self.axes, tuple(wider), amounts)


def least_squares_influence(rows: Rows, model: DampingModel) -> Influence:
    """Return the influence of rows on ordinary least squares."""
    axes, spans = _spans(rows, model)
    return _alone(axes, spans, [np.ones(span.rank) for span in spans])


def ridge_influence(rows: Rows, model: DampingModel, strength: FloatArray) -> Influence:
    """Return the influence of rows on ridge regression of given strength."""
    triangle = rows.triangle()
    sizes = {axis: column_size(triangle, terms) for axis, terms in enumerate(model.terms) if terms}
    axes, spans = _spans(rows, model, sizes)
    shares = [
        shrunk(span.singular, strength[axis], rows.n)
        for axis, span in zip(axes, spans, strict=True)
    ]
    return _alone(axes, spans, shares)


def directions(rows: Rows, model: DampingModel, axes: Sequence[int]) -> tuple[FloatArray, ...]:
    """Return what the columns of a model span on some axes."""
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
