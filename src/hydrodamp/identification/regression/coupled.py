"""All axes of a model as one regression, from a triangle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import Term
from hydrodamp.identification.rows.rank import Span, group_labels, spanned
from hydrodamp.identification.rows.triangle import Triangle
from hydrodamp.models.model import DampingModel


def stacked(whitening: FloatArray, blocks: Sequence[FloatArray]) -> FloatArray:
    """Return the design of all axes, one below the other, after whitening across axes."""
    columns = [np.kron(whitening[:, [axis]], block) for axis, block in enumerate(blocks)]
    return np.hstack(columns)


@dataclass(frozen=True)
class Coupled:
    """The axes that a model has terms on, each as the directions its columns span."""

    axes: tuple[int, ...]
    spans: tuple[Span[Term], ...]
    target: FloatArray
    n_samples: int

    @classmethod
    def of(cls, triangle: Triangle, model: DampingModel) -> Coupled:
        """Return the regression of a model."""
        axes = tuple(axis for axis, terms in enumerate(model.terms) if terms)
        columns = [triangle.basis.index(term) for term in model.basis]
        targets = [len(triangle.basis) + axis for axis in axes]
        r = np.linalg.qr(triangle.r[:, columns + targets])[1]
        spans = [spanned(r[:, model.rows[axis]], model.terms[axis]) for axis in axes]
        return cls(axes, tuple(spans), r[:, len(columns) :], triangle.n_samples)

    @property
    def freedom(self) -> FloatArray:
        """Degrees of freedom of each axis, at least one, shape (k,)."""
        return np.array([max(self.n_samples - span.rank, 1.0) for span in self.spans])

    @property
    def rank(self) -> int:
        """Directions that the data determine, summed over axes."""
        return sum(span.rank for span in self.spans)

    @property
    def aliased(self) -> tuple[tuple[str, ...], ...]:
        """Labels that the data cannot tell apart, group by group."""
        groups = (span.aliased for span in self.spans)
        return group_labels(zip(self.axes, groups, strict=True))

    def back(self) -> FloatArray:
        """Return the coefficients of each direction, shape (n_coefficients, rank)."""
        made: FloatArray = block_diag(*[span.coefficients for span in self.spans])
        return made

    def alone(self) -> FloatArray:
        """Return the directions' amounts by least squares axis by axis, shape (rank,)."""
        pairs = zip(self.spans, self.target.T, strict=True)
        return np.concatenate([span.directions.T @ target for span, target in pairs])

    def stacked(self, whitening: FloatArray) -> FloatArray:
        """Return the whitened design of all directions, shape (k h, rank)."""
        return stacked(whitening, [span.directions for span in self.spans])

    def left_over(self, amounts: FloatArray) -> FloatArray:
        """Return what some amounts of the directions leave over, shape (h, k)."""
        ends = np.cumsum([span.rank for span in self.spans])[:-1]
        parts = zip(self.spans, np.split(amounts, ends), strict=True)
        return self.target - np.column_stack([span.directions @ part for span, part in parts])
