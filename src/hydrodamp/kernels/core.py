"""Typed wrappers of the C core: regressor, RK4 replay, adaptive identifier, recursive estimator.

Array shapes are checked here, because C cannot.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, IndexArray, IntArray, as_shape, freeze
from hydrodamp.errors import ProblemError
from hydrodamp.kernels.library import DOUBLES, C, call, ffi, struct, to_c
from hydrodamp.kernels.plant import PACKED, Inputs, Plant, PlantSlopes, Sample


def _floats(values: npt.ArrayLike, shape: tuple[int, ...], name: str) -> FloatArray:
    return as_shape(values, shape, name, ProblemError)


def regressor(
    factors: IndexArray,
    velocity: FloatArray,
    down: FloatArray,
    channels: FloatArray,
    propulsion_speed: FloatArray,
    out: FloatArray | None = None,
) -> FloatArray:
    """Return the value of every term at every sample, shape (n, n_terms)."""
    table = np.ascontiguousarray(factors, dtype=np.int32)
    n, m = len(velocity), np.shape(channels)[-1]
    xi = np.empty((n, len(table)), order="F") if out is None else out
    moving = _floats(velocity, (n, 6), "velocity"), _floats(down, (n, 3), "down")
    inputs = _floats(channels, (n, m), "channels")
    record = struct("hd_record", n, m, None, *moving, None, inputs)
    speed = _floats(propulsion_speed, (n,), "propulsion_speed")
    to, (row, column) = ffi.cast("double *", xi.ctypes.data), xi.strides
    work = np.empty(C.hd_atom_count(m) * C.HD_BLOCK)
    call("hd_regressor", table, len(table), record, speed, to, row // 8, column // 8, work)
    return xi


def coriolis(mass_matrix: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return the wrench H(M nu) nu of the moving frame at n velocities, shape (n, 6).

    With p = M nu it is [p1 x w ; p1 x v + p2 x w]: eq. 1, second term.
    """
    mass = _floats(np.transpose(mass_matrix), (6, 6), "mass_matrix")
    nu = _floats(velocity, (len(velocity), 6), "velocity")
    wrench = np.empty(nu.shape)
    call("hd_coriolis_rows", mass, nu, len(nu), wrench)
    return wrench


def mass_inverse(plant: Plant) -> FloatArray:
    """Return the inverse of the mass matrix on the free axes, zero on the locked ones."""
    inverse = np.empty((6, 6))
    call("hd_mass_inverse", plant_of(plant), inverse)
    return inverse


def replay(
    plant: Plant,
    matrix: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    entries: tuple[np.ndarray, np.ndarray] | None = None,
    *,
    attitude: FloatArray | None = None,
    max_step: float = 0.05,
    limit: float = 50.0,
    block: int = 1,
    slopes: PlantSlopes | None = None,
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Integrate eq. 1 open loop by RK4 from the first sample of every segment, and differentiate.

    The wrench is interpolated linearly, the recorded down vector by the cubic with its slopes at
    the samples; channels and u_c are held. With quaternions (n, 4) in ``attitude`` the attitude is
    integrated too. No sub-step is longer than ``max_step`` [s]. Velocity (n, 6) is NaN outside the
    segments and from where one passed ``limit``; that sample, or -1, is the second result. The
    third are slopes on coefficients at p ``entries`` (rows, columns) of ``matrix``, on the
    parameters of ``slopes``, which count in p too, and on the initial velocity: a row (6, p + 6) a
    block of samples, segment by segment, their sum over the root of their number.
    """
    rows, n, system = segment_rows(segments, inputs.n), inputs.n, plant_of(plant)
    table = _floats(matrix, (plant.n_terms, 6), "matrix")
    poses = None if attitude is None else _floats(attitude, (n, 4), "attitude")
    chosen = np.column_stack(entries or ((), ())).astype(np.int32)
    blocks = 0 if entries is None else int(np.sum(-(-np.diff(rows) // block)))
    p = len(chosen) + (slopes.n if slopes else 0)
    jacobian = np.empty((blocks, 6, p + 6))
    velocity, diverged_at = np.empty((n, 6)), np.empty(len(rows), dtype=np.int64)
    record, work = record_of(plant, inputs), np.zeros(C.hd_replay_work(system, p))
    settings = max_step, limit, slopes_of(slopes)
    motion = struct("hd_motion", system, table, record, inputs.down_slope, poses, *settings)
    to = velocity, None if entries is None else jacobian, diverged_at, work
    call("hd_replay", motion, rows, len(rows), chosen, p, block, None, *to)
    return velocity, diverged_at, jacobian


def segment_rows(segments: npt.ArrayLike, n: int) -> IntArray:
    """Return segments as int64 rows (start, stop) inside ``n`` samples."""
    rows = np.ascontiguousarray(segments, dtype=np.int64)
    wrong = (rows[:, 0] < 0) | (rows[:, 0] >= rows[:, 1]) | (rows[:, 1] > n)
    if wrong.any():
        raise ProblemError(
            f"`segments` must hold rows 0 <= start < stop <= {n}; got {rows[wrong][0].tolist()}"
        )
    return rows


@functools.lru_cache(maxsize=32)
def plant_of(plant: Plant) -> Any:
    arrays = plant.factors, np.ascontiguousarray(plant.mass_matrix.T), plant.free
    return struct("hd_plant", plant.n_terms, plant.n_channels, *arrays)


def slopes_of(slopes: PlantSlopes | None) -> Any:
    if slopes is None:
        return None
    arrays = slopes.mass_matrix, slopes.known, slopes.wrench, slopes.channels
    return struct("hd_plant_slopes", slopes.n, slopes.known.shape[1], *arrays)


def record_of(plant: Plant, inputs: Inputs) -> Any:
    if inputs.n_channels != plant.n_channels:
        raise ProblemError(
            f"`inputs.channels` must have {plant.n_channels} columns, as the plant has channels; "
            f"got {inputs.n_channels}"
        )
    arrays = inputs.time, inputs.velocity, inputs.down, inputs.wrench, inputs.channels
    return struct("hd_record", inputs.n, inputs.n_channels, *arrays, inputs.propulsion)


@dataclass(frozen=True, eq=False)
class Gains:
    """A plant and the gains of its adaptive identifier: ``a`` (6,), ``gamma`` (n_terms, 6)."""

    plant: Plant
    a: FloatArray
    gamma: FloatArray

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        freeze(self, a=(6,), gamma=(self.plant.n_terms, 6))


class AdaptationRun(NamedTuple):
    """Final state and history of a run of the adaptive identifier."""

    matrix: FloatArray  # (n_terms, 6)
    error: FloatArray  # (6,), velocity error, estimate minus record
    history_time: FloatArray  # (k,), of each stored step's end [s]
    history_error: FloatArray  # (k, 6)
    history_matrix: FloatArray  # (k, n_terms, 6)


@dataclass(frozen=True, eq=False)
class Recursion:
    """A plant and the settings of recursive least squares with directional forgetting.

    Coefficients at ``rows`` and ``axes`` of the table of equation 1 are estimated, axis by axis;
    ``known`` (n_terms, 6) is that table without them. ``unit`` scales each (its prior standard
    deviation over that of the noise; 0 fixes it), ``block`` is the length of a block of time [s],
    and ``forgetting`` the share of the information along a row that the row replaces.
    """

    plant: Plant
    rows: IndexArray
    axes: IndexArray
    known: FloatArray
    unit: FloatArray
    block: float
    forgetting: float = 0.0

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        freeze(self, dtype=np.int32, rows=(None,), axes=(len(self.rows),))
        freeze(self, known=(self.plant.n_terms, 6), unit=(len(self.rows),))

    @functools.cached_property
    def starts(self) -> IndexArray:
        """Index of the first coefficient of each axis, and one past the last of all."""
        return np.cumsum([0, *np.bincount(self.axes, minlength=6)], dtype=np.int32)

    def axis_block(self, axis: int, packed: FloatArray) -> tuple[slice, FloatArray]:
        """Return the slice of the coefficients of an axis, and its block of the packed matrices."""
        ends = np.cumsum(np.diff(self.starts) ** 2).tolist()
        block = slice(*self.starts[axis : axis + 2].tolist())
        n = block.stop - block.start
        return block, packed[ends[axis] - n * n : ends[axis]].reshape(n, n)

    @functools.cached_property
    def iv_offsets(self) -> list[int]:
        """Offset of the instrumental-variable state of each axis, and the total size."""
        sizes = [C.hd_iv_size(n) for n in np.diff(self.starts).tolist()]
        return [0, *itertools.accumulate(sizes)]

    def iv_statistics(self, axis: int, packed: FloatArray) -> IVStatistics:
        """Return the instrumental-variable state of an axis; see ``hd_iv_size`` in onboard.h."""
        n = int(self.starts[axis + 1] - self.starts[axis])
        state = packed[self.iv_offsets[axis] : self.iv_offsets[axis + 1]]
        products, first = C.HD_IV_PRODUCTS, C.HD_IV_ESTIMATE
        moments, rows = first + n, first + n + n * n
        count, lag_products = int(state[0]), state[products : products + N_LAGS]
        innovations, last = state[1 : 1 + min(count, N_LAGS)], state[rows : rows + n + 1]
        square = state[moments:rows].reshape(n, n)
        return IVStatistics(count, innovations, lag_products, state[first:moments], square, last)

    def last_row(self, axis: int, packed: FloatArray) -> tuple[FloatArray, float, bool]:
        """Return the regressors of an axis's last row, in units, its target, and if it is first."""
        statistics = self.iv_statistics(axis, packed)
        return statistics.last_row[:-1], float(statistics.last_row[-1]), statistics.n_rows < 2

    def initial_estimate(self, coefficients: FloatArray) -> Estimate:
        """Return the estimate before any data."""
        squares = np.empty(int(np.sum(np.diff(self.starts) ** 2)))
        iv_state = np.empty(self.iv_offsets[-1])
        start = _floats(coefficients, self.rows.shape, "coefficients")
        estimate = Estimate(np.empty(len(start)), squares, np.empty(6), np.empty(6), iv_state)
        call("hd_recur_start", entries_of(self), _estimate_struct(self, estimate), start)
        return estimate


#: Lags of the products of innovations.
N_LAGS: int = C.HD_IV_LAGS


class IVStatistics(NamedTuple):
    """Instrumental-variable state of one axis."""

    n_rows: int  # of the present segment, at most 7
    innovations: FloatArray  # the last four at most, newest first, over the root of 1 + leverage
    lag_products: FloatArray  # (4,), running means of products of innovations
    estimate: FloatArray  # (n,), in units of ``Recursion.unit``
    moments: FloatArray  # (n, n)
    last_row: FloatArray  # (n + 1,): regressors in units, and their target


class Estimate(NamedTuple):
    """State of recursive least squares.

    ``information`` is that of the data, one matrix per axis, packed, in the unit of each
    coefficient, without the prior's identity; ``noise`` the running variance of the normalised
    innovations, [N s]^2 or [N m s]^2, and ``rows`` their number, both by axis. ``iv_state`` is the
    packed state of ``instrumental_variables.c``; see :meth:`Recursion.iv_statistics`.
    """

    coefficients: FloatArray
    information: FloatArray
    noise: FloatArray
    rows: FloatArray
    iv_state: FloatArray


def adapt(
    gains: Gains,
    matrix: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    passes: int = 1,
    every: int = 0,
) -> AdaptationRun:
    """Run the adaptive identifier of eqs. 15-16 over a record: repeated :func:`adapt_step`.

    The velocity error starts at zero in every segment of every pass. ``every`` > 0
    stores the state after every so many steps.
    """
    plant, n_terms, rows = gains.plant, gains.plant.n_terms, segment_rows(segments, inputs.n)
    estimate, error = _floats(matrix, (n_terms, 6), "matrix").copy(), np.zeros(6)
    stored = passes * int((np.diff(rows) - 1).sum()) // every if every else 0
    history_arrays = np.empty(stored), np.empty((stored, 6)), np.empty((stored, n_terms, 6))
    record, history = record_of(plant, inputs), struct("hd_history", every, *history_arrays)
    state, work = (estimate, error), np.zeros(C.hd_step_work(n_terms, plant.n_channels))
    arguments = gains.a, gains.gamma, *state, record, rows, len(rows), passes, history, work
    call("hd_adapt_run", plant_of(plant), *arguments)
    return AdaptationRun(estimate, error, *history_arrays)


def adapt_step(gains: Gains, state: FloatArray, previous: Sample, current: Sample) -> FloatArray:
    """Advance the adaptive identifier from the previous sample to the current one.

    A state, shape (n_terms + 1, 6), holds the coefficients and, last, the velocity error, which
    is zero at a segment's first sample. The state returned is read-only.
    """
    return take_step(_online(gains), state, previous, current)[0]


def new_block(plant: Plant) -> FloatArray:
    """Return the block of time at the start of a segment, for :func:`block_step`."""
    return np.zeros(C.hd_block_size(plant.n_terms))


def block_step(
    recursion: Recursion, block: FloatArray, previous: Sample, current: Sample
) -> tuple[FloatArray, FloatArray | None]:
    """Add the step between two samples to a block; return it, and a row where one is complete.

    The row holds the regressors and the target of each axis, over two blocks.
    """
    return take_step(_online(recursion), block, previous, current)


def absorb(recursion: Recursion, estimate: Estimate, row: FloatArray) -> Estimate:
    """Update the estimate with one row of :func:`block_step`."""
    entries, n_terms = entries_of(recursion), recursion.plant.n_terms
    result, line = _copy_estimate(estimate), _floats(row, (n_terms + 6,), "row")
    work = np.zeros(C.hd_absorb_work(entries))
    call("hd_absorb", entries, _estimate_struct(recursion, result), n_terms, line, work)
    return result


def recur(recursion: Recursion, estimate: Estimate, inputs: Inputs, segments: IntArray) -> Estimate:
    """Run recursive least squares over a record: repeated ``block_step`` and ``absorb``."""
    plant, rows, entries = recursion.plant, segment_rows(segments, inputs.n), entries_of(recursion)
    result, record = _copy_estimate(estimate), record_of(plant, inputs)
    work = np.zeros(C.hd_recur_work(entries, plant.n_terms, plant.n_channels))
    settings = entries, _estimate_struct(recursion, result), recursion.block
    call("hd_recur_run", plant_of(plant), *settings, record, rows, len(rows), work)
    return result


def begin_segment(recursion: Recursion, estimate: Estimate) -> Estimate:
    """Return the estimate with the next row marked as the first of a segment."""
    result = _copy_estimate(estimate)
    call("hd_iv_begin_segment", entries_of(recursion), result.iv_state)
    return result


def _copy_estimate(estimate: Estimate) -> Estimate:
    return Estimate(*(array.copy() for array in estimate))


@functools.lru_cache(maxsize=32)
def entries_of(recursion: Recursion) -> Any:
    return struct("hd_entries", recursion.starts, recursion.rows, recursion.known)


def _estimate_struct(recursion: Recursion, estimate: Estimate) -> Any:
    values = recursion.unit, recursion.forgetting, *estimate  # which the caller keeps
    return ffi.new("hd_estimate *", [*map(to_c, values)])


#: Settings, shape of a state, and sizes of sample, workspace and row of online steps.
OnlineStep = tuple[Any, tuple[int, ...], int, int, int]


@functools.lru_cache(maxsize=32)
def _online(bound: Gains | Recursion) -> OnlineStep:
    """Return settings, shape of a state, and sizes of sample, workspace and row of online steps."""
    plant = bound.plant
    arguments: tuple[Any, ...] = (bound.a, bound.gamma) if isinstance(bound, Gains) else ()
    shape: tuple[int, ...] = (plant.n_terms + 1, 6)
    if isinstance(bound, Recursion):
        arguments = None, None, bound.known, bound.block
        shape = (C.hd_block_size(plant.n_terms),)
    work_size = C.hd_step_work(plant.n_terms, plant.n_channels)
    settings = struct("hd_online", plant_of(plant), *arguments)
    return settings, shape, PACKED + plant.n_channels, work_size, plant.n_terms + 6


def take_step(
    online: OnlineStep, state: FloatArray, previous: Sample, current: Sample
) -> tuple[FloatArray, FloatArray | None]:
    """Return the next state, read-only, and the row where a block is complete."""
    settings, shape, size, work_size, row = online
    before, now = previous.values, current.values
    if state.shape != shape or not len(before) == len(now) == size:
        got = state.shape, len(before) - PACKED, len(now) - PACKED
        raise ProblemError(
            f"a state must have shape {shape}, a sample {size - PACKED} channels; got {got}"
        )
    result, work, doubles = state.copy(), ffi.new(DOUBLES, work_size + row), ffi.from_buffer
    first, second, to = doubles(DOUBLES, before), doubles(DOUBLES, now), doubles(DOUBLES, result)
    outcome = C.hd_online_step(settings, first, second, to, work)
    if not outcome:
        raise ProblemError(
            f"time must advance from {previous.time} s, got {current.time} s; after a gap or "
            "a new clock use `state.restart(sample)`."
        )
    result.setflags(write=False)
    return result, np.frombuffer(ffi.buffer(work))[work_size:] if outcome > 1 else None
