"""The robust identifier's part of the C core."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.kernels.arguments import at_least, check_samples, floats, spans
from hydrodamp.kernels.core import (
    _entries,
    _history,
    _plant,
    _record,
    _sample,
    _track,
)
from hydrodamp.kernels.fitting import fitting
from hydrodamp.kernels.inputs import Inputs, Sample
from hydrodamp.kernels.library import INTERFACE, C, pointer, room
from hydrodamp.kernels.plant import Plant
from hydrodamp.kernels.robustness import Adapting, Robustness, RobustRun


def robust_step(
    plant: Plant, robustness: Robustness, adapting: Adapting, previous: Sample, current: Sample
) -> Adapting:
    """Take one step of the robust identifier."""
    moved, duration = _moving(plant, robustness, adapting), np.array([adapting.duration])
    check_samples(plant, previous, current)
    C.hd_robust_step(
        _plant(plant),
        _entries(robustness.entries),
        _robust(robustness),
        _adapting(moved, duration),
        _sample(previous),
        _sample(current),
        _robust_work(plant, robustness),
    )
    return Adapting(moved.coefficients, moved.error, moved.total, float(duration[0]))


def robust_run(
    plant: Plant,
    robustness: Robustness,
    coefficients: FloatArray,
    inputs: Inputs,
    segments: IntArray,
    mean_from: int = 0,
    every: int = 0,
) -> RobustRun:
    """Run the robust identifier over a record."""
    entries = robustness.entries
    given = Adapting.at(floats(coefficients, (entries.n,), "coefficients"))
    moved, duration = _moving(plant, robustness, given), np.zeros(1)
    record, rows = _record(plant, inputs), spans(segments, inputs.n)
    at_least("mean_from", mean_from, 0)
    track = _track(rows, 1, every, entries.n)
    C.hd_robust_run(
        _plant(plant),
        _entries(entries),
        _robust(robustness),
        _adapting(moved, duration),
        mean_from,
        record,
        pointer(rows),
        len(rows),
        _history(every, track),
        _robust_work(plant, robustness),
    )
    done = Adapting(moved.coefficients, moved.error, moved.total, float(duration[0]))
    return RobustRun(done, track)


def _moving(plant: Plant, robustness: Robustness, given: Adapting) -> Adapting:
    fitting(plant, robustness.entries, given.coefficients)
    n = robustness.entries.n
    coefficients = floats(given.coefficients, (n,), "coefficients").copy()
    error = floats(given.error, (6,), "error").copy()
    return Adapting(coefficients, error, floats(given.total, (n,), "total").copy(), 0.0)


def _adapting(moving: Adapting, duration: FloatArray) -> Any:
    numbers = (moving.coefficients, moving.error, moving.total, duration)
    return INTERFACE.new("hd_adapting *", [pointer(array) for array in numbers])


@functools.lru_cache(maxsize=32)
def _robust(robustness: Robustness) -> Any:
    lower, upper = robustness.bounds
    numbers = (robustness.a, robustness.gains, robustness.led_to, lower, upper)
    pointers = [pointer(array) for array in numbers]
    return INTERFACE.new("hd_robust *", [*pointers, robustness.leakage, robustness.dead_zone])


def _robust_work(plant: Plant, robustness: Robustness) -> Any:
    entries = _entries(robustness.entries)
    return room(C.hd_robust_work(entries, plant.n_terms, plant.n_channels))
