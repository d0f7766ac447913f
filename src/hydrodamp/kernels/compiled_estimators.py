"""The compiled core's robust identifier and recursive least squares.

As in :mod:`hydrodamp.kernels.compiled`: same names, arguments and results as the
reference, whose docstrings tell what each one does.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.kernels import _core, reference
from hydrodamp.kernels.arguments import (
    at_least,
    check_samples,
    floats,
    matching,
    positive,
    spans,
)
from hydrodamp.kernels.entries import Entries
from hydrodamp.kernels.fitting import fitting, steps_in
from hydrodamp.kernels.inputs import Inputs, Sample
from hydrodamp.kernels.plant import Plant
from hydrodamp.kernels.recursion import Estimate, Recurred, Recursion, block_size
from hydrodamp.kernels.robustness import Adapting, Robustness, RobustRun
from hydrodamp.kernels.track import Track
from hydrodamp.kernels.views import (
    core_entries,
    core_plant,
    core_record,
    core_robust,
    documented_by,
)


@documented_by(reference.robust_step)
def robust_step(
    plant: Plant,
    robustness: Robustness,
    adapting: Adapting,
    previous: Sample,
    current: Sample,
) -> Adapting:
    """Run the core's twin of the reference."""
    coefficients = np.array(adapting.coefficients, dtype=np.float64)
    error = np.array(adapting.error, dtype=np.float64)
    total = np.array(adapting.total, dtype=np.float64)
    duration = np.array([adapting.duration])
    try:
        _core.robust_step(
            core_plant(plant),
            core_entries(robustness.entries),
            core_robust(robustness),
            coefficients,
            error,
            total,
            duration,
            previous.values,
            current.values,
        )
    except (TypeError, ValueError):  # the checks cost as much as the step: only now
        fitting(plant, robustness.entries, adapting.coefficients)
        check_samples(plant, previous, current)
        raise
    return Adapting(coefficients, error, total, float(duration[0]))


@documented_by(reference.robust_run)
def robust_run(
    plant: Plant,
    robustness: Robustness,
    coefficients: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    mean_from: int = 0,
    every: int = 0,
) -> RobustRun:
    """Run the core's twin of the reference."""
    entries = robustness.entries
    state = Adapting.at(fitting(plant, entries, coefficients))
    matching(plant, inputs)
    rows = spans(segments, inputs.n)
    at_least("mean_from", mean_from, 0)
    at_least("every", every, 0)
    track = Track.empty(steps_in(rows) // every if every else 0, entries.n)
    duration = np.zeros(1)
    _core.robust_run(
        core_plant(plant),
        core_entries(entries),
        core_robust(robustness),
        state.coefficients,
        state.error,
        state.total,
        duration,
        mean_from,
        core_record(inputs),
        rows,
        every,
        track.time,
        track.by_axis,
        track.coefficients,
    )
    done = Adapting(state.coefficients, state.error, state.total, float(duration[0]))
    return RobustRun(done, track)


@documented_by(reference.block_step)
def block_step(
    plant: Plant,
    entries: Entries,
    length: float,
    block: FloatArray,
    previous: Sample,
    current: Sample,
) -> tuple[FloatArray, FloatArray | None]:
    """Run the core's twin of the reference."""
    block = np.array(block, dtype=np.float64)
    row = np.empty(plant.n_terms + 6)
    try:
        complete = _core.block_step(
            core_plant(plant),
            core_entries(entries),
            length,
            block,
            row,
            previous.values,
            current.values,
        )
    except (TypeError, ValueError):
        fitting(plant, entries, np.zeros(entries.n))
        positive(length, "length")
        floats(block, (block_size(plant.n_terms),), "block")
        check_samples(plant, previous, current)
        raise
    return block, row if complete else None


def _copied(estimate: Estimate) -> Estimate:
    return Estimate(
        np.array(estimate.coefficients, dtype=np.float64),
        np.array(estimate.information, dtype=np.float64),
        np.array(estimate.noise, dtype=np.float64),
        np.array(estimate.rows, dtype=np.float64),
    )


@documented_by(reference.absorb)
def absorb(recursion: Recursion, estimate: Estimate, row: FloatArray) -> Estimate:
    """Run the core's twin of the reference."""
    entries = recursion.entries
    found = _copied(estimate)
    _core.absorb(
        core_entries(entries),
        recursion.unit,
        recursion.forgetting,
        floats(found.coefficients, (entries.n,), "estimate.coefficients"),
        floats(found.information, (entries.n_squares,), "estimate.information"),
        found.noise,
        found.rows,
        floats(row, (len(entries.known) + 6,), "row"),
    )
    return found


@documented_by(reference.recur)
def recur(
    plant: Plant,
    recursion: Recursion,
    estimate: Estimate,
    inputs: Inputs,
    segments: IntArray,
    every: int = 0,
) -> Recurred:
    """Run the core's twin of the reference."""
    entries = recursion.entries
    fitting(plant, entries, estimate.coefficients)
    matching(plant, inputs)
    rows = spans(segments, inputs.n)
    at_least("every", every, 0)
    found, block = _copied(estimate), np.zeros(block_size(plant.n_terms))
    track = Track.empty(steps_in(rows) // every if every else 0, entries.n)
    _core.recur(
        core_plant(plant),
        core_entries(entries),
        recursion.unit,
        recursion.forgetting,
        found.coefficients,
        floats(found.information, (entries.n_squares,), "estimate.information"),
        found.noise,
        found.rows,
        recursion.block,
        block,
        core_record(inputs),
        rows,
        every,
        track.time,
        track.by_axis,
        track.coefficients,
    )
    return Recurred(found, block, track)
