"""The replay, linearised in every candidate, block by block of the log."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.search import searching
from hydrodamp.identification.shooting import Guess
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Blocks at the most: a normal matrix of 500 candidates takes 2 MB.
_BLOCKS = 40

#: A log is cut into at least this many windows.
_LEAST = 16


@dataclass(frozen=True, eq=False)
class ReplayBlocks:
    """Normal matrices of the linearised replay."""

    blocks: FloatArray
    lost: int


def replay_blocks(
    problem: Problem, model: DampingModel, around: Damping, length: float
) -> ReplayBlocks:
    """Linearise the replay in the coefficients of a large model around a small one."""
    search = searching(problem, model)
    shooting = search.shooting(min(length, problem.duration / _LEAST))
    guessed = around.onto(model)
    starts = shooting.measured_starts()
    spread = _spread(shooting.errors(Guess(guessed, starts)), search.noise)
    turn = np.eye(len(guessed) + 1)
    turn[:-1, -1] = guessed
    blocks, lost = [], 0
    for part in np.array_split(np.arange(len(starts)), min(_BLOCKS, len(starts))):
        here = replace(shooting, windows=shooting.windows[part])
        linear = here.linearised(Guess(guessed, starts[part]), spread)
        if linear is None:
            lost += 1
            continue
        rows = linear.triangle @ turn
        blocks.append(rows.T @ rows)
    return ReplayBlocks(np.array(blocks).reshape(-1, *turn.shape), lost)


def _spread(errors: FloatArray, noise: FloatArray) -> FloatArray:
    """Return the spread of each error beyond the noise of the state a window starts from."""
    finite = errors[np.all(np.isfinite(errors), axis=1)]
    own = np.mean(finite**2, axis=0) if len(finite) else np.zeros(len(noise))
    return np.sqrt(np.maximum(own - noise**2, noise**2))
