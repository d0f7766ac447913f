"""The kernels of the compiled C99 core: same names, arguments and results as the reference.

Results are allocated here and filled by the core; batches release the GIL.
The docstrings of :mod:`hydrodamp.kernels.reference` tell what each one does.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IndexArray, IntArray
from hydrodamp.kernels import _core, reference
from hydrodamp.kernels.adapted import Adapted
from hydrodamp.kernels.arguments import (
    at_least,
    check_step,
    coefficients,
    destination,
    floats,
    matching,
    places,
    positive,
    rows_of,
    spans,
)
from hydrodamp.kernels.compiled_estimators import (
    absorb,
    block_step,
    recur,
    robust_run,
    robust_step,
)
from hydrodamp.kernels.inputs import Inputs, Sample
from hydrodamp.kernels.plant import Plant, checked_factors
from hydrodamp.kernels.views import NO_ATTITUDE, core_plant, core_record, documented_by

__all__ = [
    "absorb",
    "acceleration",
    "adapt",
    "adapt_step",
    "block_step",
    "coriolis",
    "recur",
    "regressor",
    "replay",
    "robust_run",
    "robust_step",
    "sensitivities",
]


@documented_by(reference.regressor)
def regressor(
    factors: IndexArray,
    velocity: FloatArray,
    down: FloatArray,
    channels: FloatArray,
    propulsion_speed: FloatArray,
    out: FloatArray | None = None,
) -> FloatArray:
    """Run the core's twin of the reference."""
    n = len(velocity)
    held = rows_of(channels, n, "channels")
    table = checked_factors(factors, held.shape[1])
    out = destination(out, n, len(table))
    _core.regressor(
        table,
        floats(velocity, (n, 6), "velocity"),
        floats(down, (n, 3), "down"),
        held,
        floats(propulsion_speed, (n,), "propulsion_speed"),
        out,
    )
    return out


@documented_by(reference.coriolis)
def coriolis(mass_matrix: FloatArray, velocity: FloatArray) -> FloatArray:
    """Run the core's twin of the reference."""
    wrench = np.empty((len(velocity), 6))
    columns = floats(np.transpose(mass_matrix), (6, 6), "mass_matrix")
    _core.coriolis(columns, floats(velocity, wrench.shape, "velocity"), wrench)
    return wrench


@documented_by(reference.acceleration)
def acceleration(
    plant: Plant,
    matrix: FloatArray,
    velocity: FloatArray,
    down: FloatArray,
    wrench: FloatArray,
    channels: FloatArray,
    propulsion_speed: float,
) -> FloatArray:
    """Run the core's twin of the reference."""
    rate = np.empty(6)
    _core.acceleration(
        core_plant(plant),
        coefficients(plant, matrix),
        floats(velocity, (6,), "velocity"),
        floats(down, (3,), "down"),
        floats(wrench, (6,), "wrench"),
        floats(channels, (plant.n_channels,), "channels"),
        propulsion_speed,
        rate,
    )
    return rate


@documented_by(reference.replay)
def replay(
    plant: Plant,
    matrix: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    attitude: FloatArray | None = None,
    max_step: float = 0.05,
    limit: float = 50.0,
) -> tuple[FloatArray, IntArray]:
    """Run the core's twin of the reference."""
    matching(plant, inputs)
    rows = spans(segments, inputs.n)
    velocity = np.empty((inputs.n, 6))
    diverged_at = np.empty(len(rows), dtype=np.int64)
    _core.replay(
        core_plant(plant),
        coefficients(plant, matrix),
        core_record(inputs),
        rows,
        NO_ATTITUDE if attitude is None else floats(attitude, (inputs.n, 4), "attitude"),
        positive(max_step, "max_step"),
        positive(limit, "limit"),
        velocity,
        diverged_at,
    )
    return velocity, diverged_at


@documented_by(reference.sensitivities)
def sensitivities(
    plant: Plant,
    matrix: FloatArray,
    parameters: IndexArray,
    inputs: Inputs,
    segments: IntArray,
    attitude: FloatArray | None = None,
    max_step: float = 0.05,
    limit: float = 50.0,
) -> tuple[FloatArray, FloatArray]:
    """Run the core's twin of the reference."""
    matching(plant, inputs)
    chosen = places(plant, parameters)
    velocity = np.empty((inputs.n, 6))
    jacobian = np.empty((inputs.n, 6, len(chosen) + 6))
    _core.sensitivities(
        core_plant(plant),
        coefficients(plant, matrix),
        chosen,
        core_record(inputs),
        spans(segments, inputs.n),
        NO_ATTITUDE if attitude is None else floats(attitude, (inputs.n, 4), "attitude"),
        positive(max_step, "max_step"),
        positive(limit, "limit"),
        velocity,
        jacobian,
    )
    return velocity, jacobian


@documented_by(reference.adapt)
def adapt(
    plant: Plant,
    a: FloatArray,
    gamma: FloatArray,
    matrix: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    passes: int = 1,
    every: int = 0,
) -> Adapted:
    """Run the core's twin of the reference."""
    matching(plant, inputs)
    rows = spans(segments, inputs.n)
    at_least("passes", passes, 1)
    at_least("every", every, 0)
    steps = int((rows[:, 1] - rows[:, 0] - 1).sum()) * passes
    stored = steps // every if every else 0
    adapted = Adapted(
        matrix=coefficients(plant, matrix).copy(),
        error=np.zeros(6),
        history_time=np.empty(stored),
        history_error=np.empty((stored, 6)),
        history_matrix=np.empty((stored, plant.n_terms, 6)),
    )
    _core.adapt(
        core_plant(plant),
        floats(a, (6,), "a"),
        coefficients(plant, gamma, "gamma"),
        adapted.matrix,
        adapted.error,
        core_record(inputs),
        rows,
        passes,
        every,
        adapted.history_time,
        adapted.history_error,
        adapted.history_matrix,
    )
    return adapted


@documented_by(reference.adapt_step)
def adapt_step(
    plant: Plant,
    a: FloatArray,
    gamma: FloatArray,
    matrix: FloatArray,
    error: FloatArray,
    previous: Sample,
    current: Sample,
) -> tuple[FloatArray, FloatArray]:
    """Run the core's twin of the reference."""
    matrix = np.array(matrix, dtype=np.float64, order="C")
    error = np.array(error, dtype=np.float64, order="C")
    try:
        _core.adapt_step(
            core_plant(plant), a, gamma, matrix, error, previous.values, current.values
        )
    except (TypeError, ValueError):  # the checks cost as much as the step: only now
        check_step(plant, a, gamma, matrix, error, previous, current)
        raise
    return matrix, error
