"""Extended Kalman filter along a replay: pushes and coloured errors of the sensors, in C."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, as_shape, freeze
from hydrodamp.errors import ProblemError
from hydrodamp.kernels.core import plant_of, record_of, segment_rows, slopes_of
from hydrodamp.kernels.library import C, call, struct
from hydrodamp.kernels.plant import Inputs, Plant, PlantSlopes


@dataclass(frozen=True, eq=False)
class Noise:
    """Pushes on the vehicle and errors of its measured velocities, (6,) each.

    Standard deviations ``push`` [N, N m] of Ornstein-Uhlenbeck processes with one time constant
    [s], ``sensor`` [m/s, rad/s] of AR(1) errors whose ``correlation`` is over a ``step`` [s].
    """

    push: FloatArray
    sensor: FloatArray
    correlation: FloatArray
    time_constant: float
    step: float

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        freeze(self, push=(6,), sensor=(6,), correlation=(6,))


#: Rows and columns of no coefficient.
NO_ENTRIES = np.empty(0, dtype=np.int32), np.empty(0, dtype=np.int32)


def filter_replay(
    plant: Plant,
    matrix: FloatArray,
    inputs: Inputs,
    measured: FloatArray,
    segments: IntArray,
    noise: Noise,
    entries: tuple[np.ndarray, np.ndarray] = NO_ENTRIES,
    *,
    max_step: float = 0.05,
    limit: float = 50.0,
    slopes: PlantSlopes | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Replay segments with an extended Kalman filter that corrects the state at every sample.

    Return the innovations (n, 6) over the Cholesky factor of their covariance, NaN as the
    velocities of an open-loop replay; the logarithms (n, 6) of its diagonal; and the slopes
    (n, 6, p + 6) of the predicted outputs, over the factor too, on the coefficients, on
    the parameters of ``slopes``, which count in p too, and on the first velocity.
    """
    rows, system = segment_rows(segments, inputs.n), plant_of(plant)
    table = as_shape(matrix, (plant.n_terms, 6), "matrix", ProblemError)
    outputs = as_shape(measured, (inputs.n, 6), "measured", ProblemError)
    chosen = np.column_stack(entries).astype(np.int32)
    p = len(chosen) + (slopes.n if slopes else 0)
    n_rows = int(np.diff(rows).sum())
    innovations, log_std = np.empty((inputs.n, 6)), np.zeros((inputs.n, 6))
    jacobian, diverged_at = np.empty((n_rows, 6, p + 6)), np.empty(len(rows), dtype=np.int64)
    arrays = noise.push, noise.sensor, noise.correlation
    model = struct("hd_noise", *arrays, noise.time_constant, noise.step)
    state = np.empty(C.hd_filter_work(p))
    kalman = struct("hd_filter", model, outputs, log_std, p, state)
    record, work = record_of(plant, inputs), np.zeros(C.hd_replay_work(system, p))
    settings = max_step, limit, slopes_of(slopes)
    motion = struct("hd_motion", system, table, record, inputs.down_slope, None, *settings)
    to = innovations, jacobian, diverged_at, work
    call("hd_replay", motion, rows, len(rows), chosen, p, 1, kalman, *to)
    return innovations, log_std, jacobian
