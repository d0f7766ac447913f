"""The covariance of what the steps leave unexplained, factored once.

Errors of a sample enter the step that ends there and the one that begins there,
a disturbance enters one step alone. So the covariance is block-tridiagonal, and
its banded Cholesky factor whitens any rows in time linear in their number. This
is the extended Rauch-Tung-Striebel smoother in another order of elimination
(Bell 1994): it needs no inverse of any noise level, so they may be tiny.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky_banded, lapack

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.smoothing.noise import Noise
from hydrodamp.identification.smoothing.transition import Transitions


@dataclass(frozen=True, eq=False)
class StepErrors:
    """Covariance ``L Lᵀ`` of all rows of all steps.

    Attributes
    ----------
    factor : ndarray, shape (2 width, n_steps width)
        L, lower, in the banded form of LAPACK.
    """

    factor: FloatArray

    @classmethod
    def of(cls, linear: Transitions, noise: Noise) -> StepErrors:
        """Factor the covariance of some transitions.

        Parameters
        ----------
        linear : Transitions
            How steps answer to errors of samples.
        noise : Noise
            How large those are, and disturbances.

        Returns
        -------
        errors : StepErrors
            Ready to whiten.

        Raises
        ------
        numpy.linalg.LinAlgError
            If a step ran away, or answers so strongly that no factor is found.
        """
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
        """Return rows with unit covariance, ``L⁻¹`` times the rows given.

        Parameters
        ----------
        rows : ndarray, shape (m, k)
            Some rows of all steps, a whole number of steps.
        start : int
            Which row is the first.
        previous : ndarray, shape (_, k), optional
            Whitened rows just before; needed unless the first row is row 0.

        Returns
        -------
        white : ndarray, shape (m, k)
            Those rows whitened.
        """
        white = np.array(rows, order="F")
        if previous is not None:
            reach = min(len(self.factor) - 1, len(previous))
            white[:reach] -= self._coupling(start, reach)[: len(white)] @ previous[-reach:]
        part = self.factor[:, start : start + len(white)]
        return _solved(part, white)

    def weigh(self, rows: FloatArray) -> FloatArray:
        """Return the inverse of the covariance times all rows.

        Parameters
        ----------
        rows : ndarray, shape (n_steps width, k)
            All of them.

        Returns
        -------
        weights : ndarray, shape (n_steps width, k)
            ``(L Lᵀ)⁻¹`` times the rows.
        """
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
