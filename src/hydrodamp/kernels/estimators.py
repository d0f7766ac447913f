"""The adaptive identifier and recursive least squares: over a record, and step by step."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import get_ident
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, IndexArray, IntArray, frozen
from hydrodamp.errors import ProblemError
from hydrodamp.kernels.core import ROOM, C, ffi, floats, plant_of, pointer, record_of, spans
from hydrodamp.kernels.plant import PACKED, Inputs, Plant, Sample


@dataclass(frozen=True, eq=False)
class Gains:
    """A plant and the gains of its adaptive identifier: ``a`` (6,), ``gamma`` (n_terms, 6)."""

    plant: Plant
    a: FloatArray
    gamma: FloatArray

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        object.__setattr__(self, "a", frozen(self.a, (6,), "a"))
        object.__setattr__(self, "gamma", frozen(self.gamma, (self.plant.n_terms, 6), "gamma"))


class Adapted(NamedTuple):
    """What a run of the adaptive identifier leaves: its last state, and its history."""

    matrix: FloatArray  # (n_terms, 6)
    error: FloatArray  # (6,), velocity error, estimate minus record
    history_time: FloatArray  # (k,), of each stored step's end [s]
    history_error: FloatArray  # (k, 6)
    history_matrix: FloatArray  # (k, n_terms, 6)


@dataclass(frozen=True, eq=False)
class Recursion:
    """A plant and recursive least squares with directional forgetting for it.

    Coefficients move at ``rows`` and ``axes`` of the table of equation 1, axis by axis; ``known``
    (n_terms, 6) is that table without them. ``unit`` is what each is scaled by (its prior deviation
    over that of the noise; 0 holds it), ``block`` the length of a block of time [s], and
    ``forgetting`` the share of what is known along a row that it replaces.
    """

    plant: Plant
    rows: IndexArray
    axes: IndexArray
    known: FloatArray
    unit: FloatArray
    block: float
    forgetting: float = 0.0
    starts: IndexArray = field(init=False)

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        starts = np.concatenate([[0], np.cumsum(np.bincount(self.axes, minlength=6))])
        for name, array in {"rows": self.rows, "axes": self.axes, "starts": starts}.items():
            narrow = np.array(array, dtype=np.int32)
            narrow.setflags(write=False)
            object.__setattr__(self, name, narrow)
        object.__setattr__(self, "known", frozen(self.known, (self.plant.n_terms, 6), "known"))
        object.__setattr__(self, "unit", frozen(self.unit, (len(self.rows),), "unit"))

    @property
    def n_squares(self) -> int:
        """How many numbers one square matrix an axis has, all together."""
        return int((np.diff(self.starts) ** 2).sum())

    def of(self, axis: int) -> slice:
        """Return where the coefficients of an axis stand among all."""
        return slice(int(self.starts[axis]), int(self.starts[axis + 1]))

    def squares(self, packed: FloatArray) -> list[FloatArray]:
        """Return six square matrices, one an axis, as views of an array that holds them."""
        sizes = np.diff(self.starts)
        ends = np.cumsum(sizes**2)
        return [packed[end - n * n : end].reshape(n, n) for n, end in zip(sizes, ends, strict=True)]

    def before(self, coefficients: FloatArray) -> Estimate:
        """Return what is known before any data."""
        return Estimate(frozen(coefficients), np.zeros(self.n_squares), np.zeros(6), np.zeros(6))


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
    plant, n_terms = gains.plant, gains.plant.n_terms
    rows, record = spans(segments, inputs.n), record_of(plant, inputs)
    estimate, error = floats(matrix, (n_terms, 6), "matrix").copy(), np.zeros(6)
    stored = passes * int((np.diff(rows) - 1).sum()) // every if every else 0
    kept = np.empty(stored), np.empty((stored, 6)), np.empty((stored, n_terms, 6))
    history = ffi.new("hd_history *", [every, *[pointer(array) for array in kept]])
    arrays = [pointer(array) for array in (gains.a, gains.gamma, estimate, error)]
    work = ffi.new(ROOM, C.hd_step_work(n_terms, plant.n_channels))
    run = record, pointer(rows), len(rows), passes, history, work
    C.hd_adapt_run(plant_of(plant), *arrays, *run)
    return Adapted(estimate, error, *kept)


def adapt_step(gains: Gains, state: FloatArray, previous: Sample, current: Sample) -> FloatArray:
    """Take the step from the previous sample to the current one.

    A state, shape (n_terms + 1, 6), is the coefficients and, last, the velocity error, which
    is zero at a segment's first sample. The one returned cannot be written.
    """
    return _stepped(_desk(gains, get_ident()), C.hd_adapt_online, state, previous, current)[0]


def new_block(plant: Plant) -> FloatArray:
    """Return the block of time at the start of a segment, for :func:`block_step`."""
    return np.zeros(C.hd_block_size(plant.n_terms))


def block_step(
    recursion: Recursion, block: FloatArray, previous: Sample, current: Sample
) -> tuple[FloatArray, FloatArray | None]:
    """Add the step between two samples to a block; return it, and a row where one is complete.

    The row holds the terms and what they are to explain on each axis, over two blocks.
    """
    return _stepped(_desk(recursion, get_ident()), C.hd_block_online, block, previous, current)


def absorb(recursion: Recursion, estimate: Estimate, row: FloatArray) -> Estimate:
    """Take in one row of :func:`block_step` by recursive least squares."""
    entries, n_terms = _entries(recursion), recursion.plant.n_terms
    moved, target = _estimate(recursion, estimate)
    line, work = floats(row, (n_terms + 6,), "row"), ffi.new(ROOM, C.hd_absorb_work(entries))
    C.hd_absorb(entries, target, n_terms, pointer(line), work)
    return moved


def recur(recursion: Recursion, estimate: Estimate, inputs: Inputs, segments: IntArray) -> Estimate:
    """Run recursive least squares over a record: the fold of ``block_step`` and ``absorb``."""
    plant, rows, entries = recursion.plant, spans(segments, inputs.n), _entries(recursion)
    record, (moved, target) = record_of(plant, inputs), _estimate(recursion, estimate)
    work = ffi.new(ROOM, C.hd_recur_work(entries, plant.n_terms, plant.n_channels))
    C.hd_recur_run(
        plant_of(plant), entries, target, recursion.block, record, pointer(rows), len(rows), work
    )
    return moved


class _Desk:
    """The memory of a run of steps; one that goes on from the last copies only a sample in."""

    def __init__(self, plant: Plant, shape: tuple[int, ...], settings: dict[str, Any]) -> None:
        self.state, self.row = np.zeros(shape), np.zeros(plant.n_terms + 6)
        self.before, self.now = np.zeros((2, PACKED + plant.n_channels))
        self.left: FloatArray | None = None
        self.sample: Sample | None = None
        arrays = {"state": self.state, "row": self.row, "previous": self.before}
        pointers = {name: pointer(array) for name, array in arrays.items()}
        self.work = ffi.new(ROOM, C.hd_step_work(plant.n_terms, plant.n_channels))
        fields = settings | pointers | {"plant": plant_of(plant), "current": pointer(self.now)}
        self.online, self.settings = ffi.new("hd_online *", fields), settings
        C.hd_walk_begin(plant_of(plant), ffi.addressof(self.online.walk), self.work)

    def lay_out(self, state: FloatArray, previous: Sample) -> None:
        """Copy in what the last step did not leave."""
        self.left = None
        if state.shape != self.state.shape or len(previous.values) != len(self.before):
            raise ProblemError(
                f"a state must have shape {self.state.shape}, a sample {len(self.now) - PACKED} "
                f"channels; got {state.shape} and {len(previous.values) - PACKED}"
            )
        self.state[...], self.before[:] = state, previous.values
        self.online.walk.fresh = 0


def _stepped(
    desk: _Desk, advance: Callable[[Any], int], state: FloatArray, previous: Sample, current: Sample
) -> tuple[FloatArray, FloatArray | None]:
    """Return the next state, which cannot be written, and the row that a full block leaves."""
    if state is not desk.left or previous is not desk.sample:
        desk.lay_out(state, previous)
    values = current.values
    if len(values) != len(desk.now):
        desk.lay_out(state, current)
    desk.now[:], desk.left = values, None
    outcome = advance(desk.online)
    if not outcome:
        raise ProblemError(
            f"time must advance from {previous.time} s, got {current.time} s; after a gap or "
            "a new clock use `state.restarted(sample)`."
        )
    row = desk.row.copy() if outcome > 1 else None
    left = desk.left = desk.state.copy()
    left.setflags(write=False)  # unchanged, it need not be copied in again
    desk.sample = current
    return left, row


# Structures and settings of values that never change are kept, as plants are.


@functools.lru_cache(maxsize=32)
def _entries(recursion: Recursion) -> Any:
    arrays = recursion.starts, recursion.rows, recursion.known
    return ffi.new("hd_entries *", [pointer(array) for array in arrays])


@functools.lru_cache(maxsize=32)
def _desk(bound: Gains | Recursion, thread: int) -> _Desk:
    """Return the desk of a thread."""
    n_terms = bound.plant.n_terms
    if isinstance(bound, Gains):
        gains = {"a": pointer(bound.a), "gamma": pointer(bound.gamma)}
        return _Desk(bound.plant, (n_terms + 1, 6), gains)
    settings = {"known": pointer(bound.known), "length": bound.block}
    return _Desk(bound.plant, (C.hd_block_size(n_terms),), settings)


def _estimate(recursion: Recursion, estimate: Estimate) -> tuple[Estimate, Any]:
    """Return a copy of an estimate, and the structure by which C moves it."""
    sizes = {"coefficients": len(recursion.rows), "information": recursion.n_squares}
    shapes = {**sizes, "noise": 6, "rows": 6}
    arrays = [floats(getattr(estimate, name), (n,), name).copy() for name, n in shapes.items()]
    fields = [pointer(recursion.unit), recursion.forgetting, *[pointer(array) for array in arrays]]
    return Estimate(*arrays), ffi.new("hd_estimate *", fields)
