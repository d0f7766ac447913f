"""The functions of the C core on arrays: shapes are checked here, once, because C cannot."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray, IndexArray, IntArray
from hydrodamp.kernels.adapted import Adapted
from hydrodamp.kernels.arguments import (
    at_least,
    check_samples,
    destination,
    floats,
    matching,
    places,
    positive,
    rows_of,
    spans,
)
from hydrodamp.kernels.entries import Entries
from hydrodamp.kernels.fitting import fitting
from hydrodamp.kernels.inputs import PACKED, Inputs, Sample
from hydrodamp.kernels.library import INTERFACE, C, pointer, room
from hydrodamp.kernels.plant import Plant, checked_factors
from hydrodamp.kernels.recursion import Estimate, Recurred, Recursion, block_size
from hydrodamp.kernels.track import Track


@functools.lru_cache(maxsize=32)
def _plant(plant: Plant) -> Any:
    fields = [plant.n_terms, plant.n_channels, pointer(plant.factors), pointer(plant.mass_columns)]
    return INTERFACE.new("hd_plant *", [*fields, pointer(plant.free)])


@functools.lru_cache(maxsize=32)
def _entries(entries: Entries) -> Any:
    return INTERFACE.new(
        "hd_entries *", [pointer(entries.starts), pointer(entries.rows), pointer(entries.known)]
    )


def _record(plant: Plant, inputs: Inputs) -> Any:
    matching(plant, inputs)
    arrays = (inputs.time, inputs.velocity, inputs.down, inputs.wrench, inputs.channels)
    pointers = [pointer(array) for array in (*arrays, inputs.propulsion)]
    return INTERFACE.new("hd_record *", [inputs.n, inputs.n_channels, *pointers])


def _sample(sample: Sample) -> Any:
    at, (opening, closing) = pointer(sample.values), sample.values[16:PACKED]
    fields = [sample.values[0], at + 1, at + 7, at + 10, at + PACKED, opening, closing]
    return INTERFACE.new("hd_sample *", fields)


def _history(every: int, track: Track) -> Any:
    pointers = [pointer(array) for array in (track.time, track.by_axis, track.coefficients)]
    return INTERFACE.new("hd_history *", [every, *pointers])


def _estimate(recursion: Recursion, estimate: Estimate) -> Any:
    numbers = (estimate.coefficients, estimate.information, estimate.noise, estimate.rows)
    pointers = [pointer(array) for array in numbers]
    return INTERFACE.new(
        "hd_estimate *", [pointer(recursion.unit), recursion.forgetting, *pointers]
    )


def regressor(
    factors: IndexArray,
    velocity: FloatArray,
    down: FloatArray,
    channels: FloatArray,
    propulsion_speed: FloatArray,
    out: FloatArray | None = None,
) -> FloatArray:
    """Return every term at every sample, shape (n, n_terms); into ``out`` of any strides."""
    n = len(velocity)
    held = rows_of(channels, n, "channels")
    table = checked_factors(factors, held.shape[1])
    xi = destination(out, n, len(table))
    moving = pointer(floats(velocity, (n, 6), "velocity")), pointer(floats(down, (n, 3), "down"))
    speed = pointer(floats(propulsion_speed, (n,), "propulsion_speed"))
    fields = [
        n,
        held.shape[1],
        INTERFACE.NULL,
        *moving,
        INTERFACE.NULL,
        pointer(held),
        INTERFACE.NULL,
    ]
    record, to = INTERFACE.new("hd_record *", fields), INTERFACE.cast("double *", xi.ctypes.data)
    work = room(C.hd_atom_count(held.shape[1]) * C.HD_BLOCK)
    row, column = (stride // 8 for stride in xi.strides)
    C.hd_regressor(pointer(table), len(table), record, speed, to, row, column, work)
    return xi


def coriolis(mass_matrix: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return the wrench H(M nu) nu of the moving frame at n velocities, shape (n, 6).

    With p = M nu it is [p1 x w ; p1 x v + p2 x w]: eq. 1, second term.
    """
    mass = floats(np.transpose(mass_matrix), (6, 6), "mass_matrix")
    nu = floats(velocity, (len(velocity), 6), "velocity")
    wrench = np.empty(nu.shape)
    C.hd_coriolis_rows(pointer(mass), pointer(nu), len(nu), pointer(wrench))
    return wrench


def acceleration(
    plant: Plant,
    matrix: FloatArray,
    velocity: FloatArray,
    down: FloatArray,
    wrench: FloatArray,
    channels: FloatArray,
    propulsion_speed: float,
) -> FloatArray:
    """Return the body-frame acceleration of eq. 1 at one sample, zero on locked axes."""
    rate, inverse = np.empty(6), room(36)
    moving = np.where(plant.free, floats(velocity, (6,), "velocity"), 0.0)
    table = floats(matrix, (plant.n_terms, 6), "matrix")
    around = [floats(down, (3,), "down"), floats(wrench, (6,), "wrench")]
    around.append(floats(channels, (plant.n_channels,), "channels"))
    work = room(C.hd_atom_count(plant.n_channels) + plant.n_terms)
    C.hd_mass_inverse(_plant(plant), inverse)
    pointers = [pointer(array) for array in (table, moving, *around)]
    C.hd_acceleration(_plant(plant), inverse, *pointers, propulsion_speed, pointer(rate), work)
    return rate


def replay(
    plant: Plant,
    matrix: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    attitude: FloatArray | None = None,
    max_step: float = 0.05,
    limit: float = 50.0,
) -> tuple[FloatArray, IntArray]:
    """Integrate eq. 1 open loop by RK4 from the first sample of every segment.

    Wrench and recorded down vector are interpolated linearly, channels and u_c held; with
    quaternions (n, 4) in ``attitude`` the attitude is integrated too. No sub-step is longer than
    ``max_step`` [s]. Velocity (n, 6) is NaN outside the segments and from where one passed
    ``limit``; that sample, or -1, is the second result.
    """
    record, rows = _record(plant, inputs), spans(segments, inputs.n)
    table = floats(matrix, (plant.n_terms, 6), "matrix")
    poses = None if attitude is None else floats(attitude, (inputs.n, 4), "attitude")
    velocity, diverged_at = np.empty((inputs.n, 6)), np.empty(len(rows), dtype=np.int64)
    C.hd_replay(
        _plant(plant),
        pointer(table),
        record,
        pointer(rows),
        len(rows),
        INTERFACE.NULL if poses is None else pointer(poses),
        positive(max_step, "max_step"),
        positive(limit, "limit"),
        pointer(velocity),
        pointer(diverged_at),
        room(C.hd_atom_count(plant.n_channels) + plant.n_terms),
    )
    return velocity, diverged_at


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
    """Replay, and differentiate the replay on coefficients and initial velocity.

    ``parameters`` are p places (row, column) in ``matrix``; the Jacobian has shape (n, 6, p + 6).
    """
    record, rows = _record(plant, inputs), spans(segments, inputs.n)
    table = floats(matrix, (plant.n_terms, 6), "matrix")
    poses = None if attitude is None else floats(attitude, (inputs.n, 4), "attitude")
    chosen = places(plant, parameters)
    velocity, jacobian = np.empty((inputs.n, 6)), np.empty((inputs.n, 6, len(chosen) + 6))
    C.hd_sensitivities(
        _plant(plant),
        pointer(table),
        pointer(chosen),
        len(chosen),
        record,
        pointer(rows),
        len(rows),
        INTERFACE.NULL if poses is None else pointer(poses),
        positive(max_step, "max_step"),
        positive(limit, "limit"),
        pointer(velocity),
        pointer(jacobian),
        room(C.hd_sensitivity_work(plant.n_terms, plant.n_channels, len(chosen))),
    )
    return velocity, jacobian


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
    """Run the adaptive identifier of eqs. 15-16 over a record: the fold of :func:`adapt_step`."""
    record, rows = _record(plant, inputs), spans(segments, inputs.n)
    estimate = floats(matrix, (plant.n_terms, 6), "matrix").copy()
    settings = floats(a, (6,), "a"), floats(gamma, (plant.n_terms, 6), "gamma")
    at_least("passes", passes, 1)
    track = _track(rows, passes, every, 6 * plant.n_terms)
    error = np.zeros(6)
    C.hd_adapt(
        _plant(plant),
        *[pointer(array) for array in (*settings, estimate, error)],
        record,
        pointer(rows),
        len(rows),
        passes,
        _history(every, track),
        room(C.hd_adapt_work(plant.n_terms, plant.n_channels)),
    )
    tables = track.coefficients.reshape(-1, plant.n_terms, 6)
    return Adapted(estimate, error, track.time, track.by_axis, tables)


def adapt_step(
    plant: Plant,
    a: FloatArray,
    gamma: FloatArray,
    matrix: FloatArray,
    error: FloatArray,
    previous: Sample,
    current: Sample,
) -> tuple[FloatArray, FloatArray]:
    """Take the step from the previous sample to the current one; the results are new arrays."""
    table = floats(matrix, (plant.n_terms, 6), "matrix").copy()
    error = floats(error, (6,), "error").copy()
    settings = floats(a, (6,), "a"), floats(gamma, (plant.n_terms, 6), "gamma")
    check_samples(plant, previous, current)
    work = room(C.hd_adapt_work(plant.n_terms, plant.n_channels))
    pointers = [pointer(array) for array in (*settings, table, error)]
    C.hd_adapt_step(_plant(plant), *pointers, _sample(previous), _sample(current), work)
    return table, error


def block_step(
    plant: Plant,
    entries: Entries,
    length: float,
    block: FloatArray,
    previous: Sample,
    current: Sample,
) -> tuple[FloatArray, FloatArray | None]:
    """Add the step between two samples to a block; return it, and a row where one is complete.

    A row holds the terms, and behind them what they are to explain on each axis.
    """
    fitting(plant, entries, np.zeros(entries.n))
    positive(length, "length")
    block = floats(block, (block_size(plant.n_terms),), "block").copy()
    check_samples(plant, previous, current)
    row, work = np.empty(plant.n_terms + 6), room(C.hd_walk_work(plant.n_terms, plant.n_channels))
    ends = _sample(previous), _sample(current)
    complete = C.hd_block_step(
        _plant(plant), _entries(entries), length, pointer(block), pointer(row), *ends, work
    )
    return block, row if complete else None


def absorb(recursion: Recursion, estimate: Estimate, row: FloatArray) -> Estimate:
    """Take in one row of :func:`block_step` by recursive least squares."""
    entries, found = recursion.entries, _copied(recursion, estimate)
    row = floats(row, (len(entries.known) + 6,), "row")
    work = room(C.hd_absorb_work(_entries(entries)))
    target = _estimate(recursion, found)
    C.hd_absorb(_entries(entries), target, len(entries.known), pointer(row), work)
    return found


def recur(
    plant: Plant,
    recursion: Recursion,
    estimate: Estimate,
    inputs: Inputs,
    segments: IntArray,
    every: int = 0,
) -> Recurred:
    """Run recursive least squares over a record: the fold of ``block_step`` and ``absorb``."""
    entries = recursion.entries
    fitting(plant, entries, np.zeros(entries.n))
    record, rows = _record(plant, inputs), spans(segments, inputs.n)
    found, block = _copied(recursion, estimate), np.zeros(block_size(plant.n_terms))
    track = _track(rows, 1, every, entries.n)
    C.hd_recur(
        _plant(plant),
        _entries(entries),
        _estimate(recursion, found),
        recursion.block,
        pointer(block),
        record,
        pointer(rows),
        len(rows),
        _history(every, track),
        room(C.hd_recur_work(_entries(entries), plant.n_terms, plant.n_channels)),
    )
    return Recurred(found, block, track)


def _track(rows: IntArray, passes: int, every: int, n: int) -> Track:
    """Return room for every ``every``-th step of some passes over segments."""
    at_least("every", every, 0)
    steps = int((np.diff(rows, axis=1) - 1).sum()) * passes
    return Track.empty(steps // every if every else 0, n)


def _copied(recursion: Recursion, estimate: Estimate) -> Estimate:
    entries = recursion.entries
    return Estimate(
        floats(estimate.coefficients, (entries.n,), "estimate.coefficients").copy(),
        floats(estimate.information, (entries.n_squares,), "estimate.information").copy(),
        floats(estimate.noise, (6,), "estimate.noise").copy(),
        floats(estimate.rows, (6,), "estimate.rows").copy(),
    )
