"""What a run of the adaptive identifier leaves behind."""

from __future__ import annotations

from dataclasses import dataclass

from hydrodamp.arrays import FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Adapted:
    """The last estimate and, on request, its history.

    Attributes
    ----------
    matrix : ndarray, shape (n_terms, 6)
        Estimated coefficients; the transpose of the paper's K-hat.
    error : ndarray, shape (6,)
        Last velocity error [m/s, rad/s], estimate minus record.
    history_time : ndarray, shape (k,)
        Time of each stored step's end [s].
    history_error : ndarray, shape (k, 6)
        Velocity error after each stored step [m/s, rad/s].
    history_matrix : ndarray, shape (k, n_terms, 6)
        Coefficients after each stored step.
    """

    matrix: FloatArray
    error: FloatArray
    history_time: FloatArray
    history_error: FloatArray
    history_matrix: FloatArray
