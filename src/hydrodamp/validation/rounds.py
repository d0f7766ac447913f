"""One round of a selection: stable terms, elimination, size, and the replay of the result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.dissipation.operating_box import operating_box
from hydrodamp.identification.dissipation.power import PowerRows, spread, worst_power
from hydrodamp.identification.regression.ridge import Ridge
from hydrodamp.identification.replays.replay_blocks import replay_blocks
from hydrodamp.identification.search import climb
from hydrodamp.identification.selection.candidates import drag, kept, picked
from hydrodamp.identification.selection.error_reduction import Path, forward, nested, solved
from hydrodamp.identification.selection.stability import frequencies
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.replay import replay
from hydrodamp.simulation.score import score
from hydrodamp.validation.selection import Entered, Round, Size
from hydrodamp.validation.sizing import sized

#: Blocks below which nothing can be left out.
_FEWEST = 4

#: Gauss-Newton steps at the most on windows of one length.
_STEPS = 12

#: Terms chosen on each half sample.
_DRAWN = 40


@dataclass(frozen=True)
class Stability:
    """What makes a term a stable one."""

    most: int
    frequency: float
    pairs: int
    seed: int


def next_round(
    problem: Problem, offered: DampingModel, around: Damping, window: float, asked: Stability
) -> tuple[Round, Damping]:
    """Select around a small model, and fit what was selected."""
    blocks = _blocks(problem, offered, around, window)
    held, groups, box = np.flatnonzero(kept(offered)), drag(offered), operating_box(problem)
    total = blocks.sum(axis=0)
    path = forward(total, asked.most, held.tolist())
    often = frequencies(blocks, _DRAWN, asked.pairs, asked.seed, held.tolist())
    pool = _pool(path.order, often >= asked.frequency, held, groups)
    sets = nested(total, pool, held, groups)
    size = sized(blocks, sets, PowerRows(offered).rows(spread(box)))
    chosen = sets[size.place]
    model = picked(offered, chosen)
    starts = [solved(total, chosen), Ridge().identify(problem, model).damping.coefficients]
    damping, rms = refit(problem, model, starts, (window, np.inf))
    made = Round(
        window=window,
        n_candidates=offered.n_coefficients,
        entered=_entered(offered, path, often),
        sizes=tuple(map(Size, map(len, sets), size.error.tolist())),
        model=model,
        words=size.words,
        rms=rms,
        push=worst_power(damping, box).power,
    )
    return made, damping


def _blocks(problem: Problem, offered: DampingModel, around: Damping, window: float) -> FloatArray:
    linear = replay_blocks(problem, offered, around, window)
    found = len(linear.blocks)
    if found < _FEWEST:
        raise MethodError(
            f"only {found} of {found + linear.lost} blocks of the log can be replayed, and a "
            f"selection needs {_FEWEST}: give a longer log, or check its signs and the vehicle's "
            "mass and actuators."
        )
    return linear.blocks


def _pool(
    order: IntArray, stable: BoolArray, held: IntArray, groups: Sequence[IntArray]
) -> IntArray:
    """Return what is chosen stably, what is held, and a term that brakes each axis."""
    pool = [*order[stable[order]].tolist(), *held.tolist()]
    for group in groups:
        if len(group) and not np.isin(group, pool).any():
            met = order[np.isin(order, group)]
            pool.append(int((met if len(met) else group)[0]))
    return np.unique(np.array(pool, dtype=np.int64))


def refit(
    problem: Problem, model: DampingModel, starts: Sequence[FloatArray], windows: tuple[float, ...]
) -> tuple[Damping, float | None]:
    """Fit the replay from several starts, each by itself, and keep the nearest."""
    found = [
        Damping(model, climb(problem, model, [start], windows, _STEPS).coefficients)
        for start in starts
    ]
    errors = [score(replay(problem, each), problem.vehicle.axes).rms for each in found]
    nearest = int(np.argmin([np.inf if error is None else error for error in errors]))
    return found[nearest], errors[nearest]


def _entered(offered: DampingModel, path: Path, often: FloatArray) -> tuple[Entered, ...]:
    return tuple(
        Entered(offered.labels[place], float(ratio), float(often[place]))
        for place, ratio in zip(path.order.tolist(), path.ratio, strict=True)
    )
