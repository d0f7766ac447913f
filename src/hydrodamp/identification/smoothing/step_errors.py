"""The covariance of what the steps leave unexplained, factored once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky_banded, lapack

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.smoothing.noise import Noise
from hydrodamp.identification.smoothing.transition import Transitions


@dataclass(frozen=True, eq=False)
class StepErrors:
    """Covariance ``L Lᵀ`` of all rows of all steps."""

    factor: FloatArray

    @classmethod
    def of(cls, linear: Transitions, noise: Noise) -> StepErrors:
        """Factor the covariance of some transitions."""
        if not np.all(np.isfinite(linear.defect)):
            raise np.linalg.LinAlgError("a step is not finite")
        steps, variance = linear.steps, noise.of_samples(linear.steps)
        scaled = linear.before * variance
        diagonal = scaled @ linear.before.swapaxes(1, 2)
        diagonal += (linear.after * variance) @ linear.after.swapaxes(1, 2)
        own = np.arange(len(steps.free))
        diagonal[:, own, own] += noise.of_steps(steps) / steps.length[:, None]
        below = scaled[1:] @ linear.after[:-1].swapaxes(1, 2) * steps.joined[:, None, None]
        return cls(cholesky_banded(_banded(diagonal, below), lower=True, check_finite=False))

    @property
    def log_determinant(self) -> float:
        """Of the covariance."""
        return float(2.0 * np.log(self.factor[0]).sum())

    def whiten(
        self, rows: FloatArray, start: int = 0, previous: FloatArray | None = None
    ) -> FloatArray:
        """Return rows with unit covariance, ``L⁻¹`` times the rows given."""
        white = np.array(rows, order="F")
        if previous is not None:
            reach = min(len(self.factor) - 1, len(previous))
            white[:reach] -= self._coupling(start, reach)[: len(white)] @ previous[-reach:]
        part = self.factor[:, start : start + len(white)]
        return _solved(part, white)

    def weigh(self, rows: FloatArray) -> FloatArray:
        """Return the inverse of the covariance times all rows."""
        return _solved(self.factor, self.whiten(rows), transposed=True)

    def _coupling(self, start: int, reach: int) -> FloatArray:
        """Return the block of L that leads from the rows before ``start`` to those after."""
        row, column = np.indices((reach, reach))
        place = row + reach - column
        inside = place < len(self.factor)
        return np.where(
            inside, self.factor[np.where(inside, place, 0), start - reach + column], 0.0
        )


def _solved(factor: FloatArray, rows: FloatArray, *, transposed: bool = False) -> FloatArray:
    solution: FloatArray
    solution, info = lapack.dtbtrs(
        factor, rows, uplo=b"L", trans=b"T" if transposed else b"N", overwrite_b=True
    )
    if info != 0:
        raise np.linalg.LinAlgError(f"LAPACK dtbtrs: {info}")
    return solution


def _banded(diagonal: FloatArray, below: FloatArray) -> FloatArray:
    """Lower banded form of the blocks on and below the diagonal."""
    n_steps, width, _ = diagonal.shape
    banded = np.zeros((2 * width, n_steps, width))
    for column in range(width):
        banded[: width - column, :, column] = diagonal[:, column:, column].T
        banded[width - column : 2 * width - column, :-1, column] = below[:, :, column].T
    return banded.reshape(2 * width, n_steps * width)
