"""Typed wrapper of the composite adaptive identifier of the C core."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, as_shape, freeze
from hydrodamp.errors import ProblemError
from hydrodamp.kernels.core import (
    OnlineStep,
    Recursion,
    entries_of,
    plant_of,
    record_of,
    segment_rows,
    take_step,
)
from hydrodamp.kernels.library import C, call, struct
from hydrodamp.kernels.plant import PACKED, Inputs, Sample


@dataclass(frozen=True, eq=False, kw_only=True)
class CompositeLaw(Recursion):
    """A plant and the settings of the composite adaptive identifier.

    The error gains ``a`` (6,) and adaptation gains ``gamma`` (6,), the ``rate`` of the filter [1/s]
    and the weight ``kappa`` of the memory join the entries, units and blocks of time.
    """

    a: FloatArray
    gamma: FloatArray
    rate: float
    kappa: float

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        super().__post_init__()
        freeze(self, a=(6,), gamma=(6,))

    def initial_state(self, coefficients: FloatArray) -> FloatArray:
        """Return the state before any data."""
        entries, n_terms = entries_of(self), self.plant.n_terms
        state = np.empty(C.hd_composite_size(entries, n_terms))
        start = as_shape(coefficients, self.rows.shape, "coefficients", ProblemError)
        call("hd_composite_start", entries, n_terms, start, state)
        return state

    def begin_segment(self, state: FloatArray) -> FloatArray:
        """Return the state at a segment's first sample: same coefficients and memory."""
        result = state.copy()
        call("hd_composite_begin_segment", self.plant.n_terms, result)
        return result

    def information(self, axis: int, state: FloatArray) -> FloatArray:
        """Return the information S of an axis at the last block of time."""
        sizes = np.diff(self.starts).tolist()
        later = sum(n + 3 * n * n for n in sizes[axis:])
        n = sizes[axis]
        start = len(state) - later + n + n * n
        return state[start : start + n * n].reshape(n, n)

    def n_blocks(self, state: FloatArray) -> int:
        """Return the number of complete blocks of time."""
        return int(state[7 * self.plant.n_terms + 13])


def composite_run(
    law: CompositeLaw, state: FloatArray, inputs: Inputs, segments: IntArray
) -> FloatArray:
    """Run the composite adaptive identifier over a record: repeated :func:`composite_step`."""
    plant, rows, entries = law.plant, segment_rows(segments, inputs.n), entries_of(law)
    work_size = C.hd_step_work(plant.n_terms, plant.n_channels) + C.hd_composite_work(entries)
    result, work, system = state.copy(), np.zeros(work_size), plant_of(plant)
    record, settings = record_of(plant, inputs), law_of(law)
    call("hd_composite_run", system, entries, settings, result, record, rows, len(rows), work)
    return result


def composite_step(
    law: CompositeLaw, state: FloatArray, previous: Sample, current: Sample
) -> FloatArray:
    """Advance the composite identifier from the previous sample to the current one."""
    return take_step(_online(law), state, previous, current)[0]


@functools.lru_cache(maxsize=32)
def law_of(law: CompositeLaw) -> Any:
    gains = law.a, law.gamma, law.unit
    return struct("hd_composite", *gains, law.rate, law.block, law.kappa, law.forgetting)


@functools.lru_cache(maxsize=32)
def _online(law: CompositeLaw) -> OnlineStep:
    plant, entries = law.plant, entries_of(law)
    settings = struct("hd_online", plant_of(plant), None, None, None, 0.0, entries, law_of(law))
    shape, row = (C.hd_composite_size(entries, plant.n_terms),), C.hd_composite_work(entries)
    work_size = C.hd_step_work(plant.n_terms, plant.n_channels)
    return settings, shape, PACKED + plant.n_channels, work_size, row
