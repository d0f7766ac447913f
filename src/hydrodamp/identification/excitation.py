"""On which axes a log holds a response to motion, and on which noise alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import BoolArray, FloatArray, frozen
from hydrodamp.basis.atoms import AXES
from hydrodamp.identification.covariance import reference
from hydrodamp.identification.rows import Rows, Split, folds
from hydrodamp.identification.triangle import solve_axis
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Least share of the response that must be predicted: a correlation of one half between the
#: response predicted and the response seen.
EXCITED = 0.25

#: Length of the test functions [s]: some time constants of a small vehicle, so that noise of the
#: velocities, which dominates accelerations from sample to sample, is averaged out.
SPAN = 8.0

#: Shortest fold, in test functions.
_FOLD = 5.0

#: Test functions over an instant.
_OVERLAP = 4

#: Folds a long log is divided into.
_MOST_FOLDS = 10


@dataclass(frozen=True, eq=False)
class Excitation:
    """What the motion of a log tells, axis by axis."""

    model: DampingModel
    axes: tuple[str, ...]
    rows: Rows
    quiet: FloatArray
    share: FloatArray
    response: FloatArray

    @property
    def excited(self) -> BoolArray:
        """On which axes enough of the response is predicted; shape (6,)."""
        return self.share >= EXCITED


def excitation(problem: Problem, model: DampingModel) -> Excitation:
    """Find how much of the motion on each axis equation 1 accounts for."""
    free = model.restricted_to(problem.vehicle.axes)
    rich = zip(AXES, reference(problem.vehicle.axes).terms, strict=True)
    both = free.with_terms({axis: " ".join(map(str, terms)) for axis, terms in rich if terms})
    wide = problem.covering(both)
    equations = WeakEquations(min(SPAN, _longest(wide)), _OVERLAP, windows=())
    rows = equations.rows(wide)
    response = equations.rows(_without_momentum(wide)).target
    variance = response.var(axis=0)
    share = _share(rows, (free, both), variance)
    quiet = equations.rows(_held(wide, share < EXCITED)).design
    return Excitation(
        model=free,
        axes=problem.vehicle.axes,
        rows=rows,
        quiet=quiet,
        share=frozen(share),
        response=frozen(np.sqrt(share * variance)),
    )


def _longest(problem: Problem) -> float:
    time, last = problem.inputs.time, problem.segments[:, 1] - 1
    return float(np.max(time[last] - time[problem.segments[:, 0]]))


def _without_momentum(problem: Problem) -> Problem:
    """Cancel the momentum term by a wrench, so that targets are responses."""
    inputs = problem.inputs
    momentum = kernels.coriolis(problem.vehicle.mass_matrix, inputs.velocity)
    wrench = (inputs.wrench - momentum) * problem.vehicle.free
    return replace(problem, inputs=replace(inputs, wrench=wrench))


def _held(problem: Problem, held: BoolArray) -> Problem:
    """Hold some velocities at their mean."""
    velocity = problem.inputs.velocity
    quiet = np.where(held, velocity.mean(axis=0), velocity)
    return replace(problem, inputs=replace(problem.inputs, velocity=quiet))


def _share(rows: Rows, models: tuple[DampingModel, ...], variance: FloatArray) -> FloatArray:
    """Cross-validate each axis of each model, and take the better model."""
    length = sum(np.ptp(rows.time[rows.segment == one]) for one in np.unique(rows.segment))
    wanted = int(np.clip(length / (_FOLD * SPAN), 2, _MOST_FOLDS))
    splits = folds(rows, wanted, gap=SPAN).splits(rows)
    error = np.min([_missed(splits, model) for model in models], axis=0)
    moved = variance > 0.0
    return np.where(moved, np.clip(1.0 - error / np.where(moved, variance, 1.0), 0.0, 1.0), 0.0)


def _missed(splits: tuple[Split, ...], model: DampingModel) -> FloatArray:
    """Return the mean square of what each axis leaves of the folds held out."""
    squares = np.zeros(6)
    for split in splits:
        for axis, terms in enumerate(model.terms):
            found = solve_axis(split.train, terms, axis).coefficients
            columns = [split.test.basis.index(term) for term in terms]
            target = split.test.r[:, len(split.test.basis) + axis]
            squares[axis] += np.sum((target - split.test.r[:, columns] @ found) ** 2)
    return squares / sum(split.test.n_samples for split in splits)
