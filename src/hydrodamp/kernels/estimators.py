"""The adaptive identifier and recursive least squares: over a record, and step by step."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.errors import ProblemError
from hydrodamp.kernels.core import ROOM, C, ffi, floats, plant_of, pointer, record_of, spans
from hydrodamp.kernels.inputs import PACKED, Inputs, Sample
from hydrodamp.kernels.plant import Entries, Plant


@dataclass(frozen=True, eq=False)
class Gains:
    """A plant and the gains of its adaptive identifier: ``a`` (6,), ``gamma`` (n_terms, 6)."""

    plant: Plant
    a: FloatArray
    gamma: FloatArray


class Adapted(NamedTuple):
    """What a run of the adaptive identifier leaves: its last state, and its history."""

    matrix: FloatArray  # (n_terms, 6)
    error: FloatArray  # (6,), velocity error, estimate minus record
    history_time: FloatArray  # (k,), of each stored step's end [s]
    history_error: FloatArray  # (k, 6)
    history_matrix: FloatArray  # (k, n_terms, 6)


@dataclass(frozen=True, eq=False)
class Recursion:
    """The settings of recursive least squares with directional forgetting.

    ``unit`` is the standard deviation of each coefficient before any data, over that of the
    noise of a row (zero holds it); ``block`` the length of a block [s], two of which make a
    row; ``forgetting`` the share of the information along a row that the row replaces.
    """

    entries: Entries
    unit: FloatArray
    block: float
    forgetting: float = 0.0

    def __post_init__(self) -> None:
        """Copy and freeze the array."""
        object.__setattr__(self, "unit", frozen(self.unit, (self.entries.n,), "unit"))


@dataclass(frozen=True, eq=False, slots=True)
class Estimate:
    """What recursive least squares knows.

    ``information`` is what the data tell, one matrix an axis, packed, in the unit of each
    coefficient, without the prior's identity; ``noise`` the running variance of what rows
    leave over, [N s]^2 or [N m s]^2, and ``rows`` their number, both by axis.
    """

    coefficients: FloatArray
    information: FloatArray
    noise: FloatArray
    rows: FloatArray

    @classmethod
    def before(cls, entries: Entries, coefficients: FloatArray) -> Estimate:
        """Return what is known before any data."""
        estimate = np.array(coefficients, dtype=np.float64)
        return cls(estimate, np.zeros(entries.n_squares), np.zeros(6), np.zeros(6))


def adapt(
    gains: Gains,
    matrix: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    passes: int = 1,
    every: int = 0,
) -> Adapted:
    """Run the adaptive identifier of eqs. 15-16 over a record: the fold of :func:`adapt_step`.

    The velocity error starts at zero in every segment of every pass. ``every`` > 0 keeps the
    state after each so many steps.
    """
    (settings, desks), n_terms = _online(gains), gains.plant.n_terms
    rows, record = spans(segments, inputs.n), record_of(gains.plant, inputs)
    estimate, error = floats(matrix, (n_terms, 6), "matrix").copy(), np.zeros(6)
    stored = passes * int((np.diff(rows) - 1).sum()) // every if every else 0
    kept = np.empty(stored), np.empty((stored, 6)), np.empty((stored, n_terms, 6))
    history = ffi.new("hd_history *", [every, *[pointer(array) for array in kept]])
    run = record, pointer(rows), len(rows), passes, history, ffi.new(ROOM, desks.n_work)
    C.hd_adapt_run(*settings, pointer(estimate), pointer(error), *run)
    return Adapted(estimate, error, *kept)


def adapt_step(gains: Gains, state: FloatArray, previous: Sample, current: Sample) -> FloatArray:
    """Take the step from the previous sample to the current one.

    A state, shape (n_terms + 1, 6), is the coefficients and, last, the velocity error, which
    is zero at a segment's first sample. The one returned cannot be written.
    """
    settings, desks = _online(gains)
    desk = desks.take()
    before, now = desk.begin(state, previous, current)
    if not C.hd_adapt_packed(*settings, desk.at, before, now, desk.work):
        raise _no_step(previous, current)
    return desk.end()


def new_block(plant: Plant) -> FloatArray:
    """Return the block of time at the start of a segment, for :func:`block_step`."""
    return np.zeros(C.hd_block_size(plant.n_terms))


def block_step(
    plant: Plant, recursion: Recursion, block: FloatArray, previous: Sample, current: Sample
) -> tuple[FloatArray, FloatArray | None]:
    """Add the step between two samples to a block; return it, and a row where one is complete.

    A row holds the terms, and behind them what they are to explain on each axis.
    """
    settings, desks = _blocks(plant, recursion)
    desk = desks.take()
    before, now = desk.begin(block, previous, current)
    outcome = C.hd_block_packed(*settings, desk.at, before, now, desk.work)
    if outcome < 0:
        raise _no_step(previous, current)
    # the row lies at the beginning of the workspace
    row = np.array(ffi.unpack(desk.work, plant.n_terms + 6)) if outcome else None
    return desk.end(), row


def absorb(recursion: Recursion, estimate: Estimate, row: FloatArray) -> Estimate:
    """Take in one row of :func:`block_step` by recursive least squares."""
    entries, n_terms = _entries(recursion.entries), len(recursion.entries.known)
    moved, target = _estimate(recursion, estimate)
    line, work = floats(row, (n_terms + 6,), "row"), ffi.new(ROOM, C.hd_absorb_work(entries))
    C.hd_absorb(entries, target, n_terms, pointer(line), work)
    return moved


def recur(
    plant: Plant, recursion: Recursion, estimate: Estimate, inputs: Inputs, segments: IntArray
) -> Estimate:
    """Run recursive least squares over a record: the fold of ``block_step`` and ``absorb``."""
    rows, record = spans(segments, inputs.n), record_of(plant, inputs)
    (moved, target), entries = _estimate(recursion, estimate), _entries(recursion.entries)
    (system, _, length), _ = _blocks(plant, recursion)
    work = ffi.new(ROOM, C.hd_recur_work(entries, plant.n_terms, plant.n_channels))
    C.hd_recur_run(system, entries, target, length, record, pointer(rows), len(rows), work)
    return moved


class _Desk:
    """The memory of a run of steps; one that goes on from the last copies nothing in."""

    def __init__(self, desks: _Desks) -> None:
        self.desks, self.state = desks, np.zeros(desks.shape)
        self.at, self.work = pointer(self.state), ffi.new(ROOM, desks.n_work)
        self.left: FloatArray | None = None
        self.sample: Sample | None = None
        self.sample_at: Any = None

    def begin(self, state: FloatArray, previous: Sample, current: Sample) -> tuple[Any, Any]:
        """Lay out a step; return where its samples are."""
        values = current.values
        if state is not self.left or len(values) != self.desks.n_sample:
            self.desks.check(state, previous, current)
            self.state[...] = state
        before = self.sample_at if previous is self.sample else pointer(previous.values)
        now = self.sample_at = ffi.from_buffer(ROOM, values)
        self.sample = current
        return before, now

    def end(self) -> FloatArray:
        """Return the state, and leave the desk to the next step."""
        left = self.left = self.state.copy()
        left.setflags(write=False)  # unchanged, it need not be copied in again
        self.desks.free.append(self)
        return left


class _Desks:
    """The desks of some settings: as many as threads step at once."""

    def __init__(self, shape: tuple[int, ...], n_channels: int, n_work: int) -> None:
        self.shape, self.n_sample, self.n_work = shape, PACKED + n_channels, n_work
        self.free: list[_Desk] = []

    def take(self) -> _Desk:
        """Return a desk that nobody uses."""
        try:
            return self.free.pop()
        except IndexError:
            return _Desk(self)

    def check(self, state: FloatArray, *samples: Sample) -> None:
        """Refuse what does not fit."""
        lengths = [len(sample.values) for sample in samples]
        if state.shape != self.shape or set(lengths) != {self.n_sample}:
            raise ProblemError(
                f"a state must have shape {self.shape}, a sample {self.n_sample - PACKED} "
                f"channels; got {state.shape} and {[length - PACKED for length in lengths]}"
            )


def _no_step(previous: Sample, current: Sample) -> ProblemError:
    return ProblemError(
        f"time must advance from {previous.time} s, got {current.time} s; after a gap or "
        "a new clock use `state.restarted(sample)`."
    )


# Structures and settings of values that never change are kept, as plants are.


@functools.lru_cache(maxsize=32)
def _entries(entries: Entries) -> Any:
    return ffi.new(
        "hd_entries *", [pointer(entries.starts), pointer(entries.rows), pointer(entries.known)]
    )


@functools.lru_cache(maxsize=32)
def _online(gains: Gains) -> tuple[tuple[Any, ...], _Desks]:
    plant, n, m = gains.plant, gains.plant.n_terms, gains.plant.n_channels
    a, gamma = floats(gains.a, (6,), "a"), floats(gains.gamma, (n, 6), "gamma")
    return (plant_of(plant), pointer(a), pointer(gamma)), _Desks(
        (n + 1, 6), m, C.hd_step_work(n, m)
    )


@functools.lru_cache(maxsize=32)
def _blocks(plant: Plant, recursion: Recursion) -> tuple[tuple[Any, ...], _Desks]:
    n, m = plant.n_terms, plant.n_channels
    known = floats(recursion.entries.known, (n, 6), "entries.known")
    desks = _Desks((C.hd_block_size(n),), m, n + 6 + C.hd_step_work(n, m))
    return (plant_of(plant), pointer(known), recursion.block), desks


def _estimate(recursion: Recursion, estimate: Estimate) -> tuple[Estimate, Any]:
    """Return a copy of an estimate, and the structure by which C moves it."""
    sizes = {"coefficients": recursion.entries.n, "information": recursion.entries.n_squares}
    shapes = {**sizes, "noise": 6, "rows": 6}
    arrays = [floats(getattr(estimate, name), (n,), name).copy() for name, n in shapes.items()]
    fields = [pointer(recursion.unit), recursion.forgetting, *[pointer(array) for array in arrays]]
    return Estimate(*arrays), ffi.new("hd_estimate *", fields)
