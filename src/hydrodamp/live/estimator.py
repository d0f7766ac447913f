"""The identifier at work, without any I/O: a row in, a state out; estimates of a state."""

from __future__ import annotations

import hashlib
import math
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.data.channels import SEGMENT
from hydrodamp.data.checks import MAX_VELOCITY
from hydrodamp.errors import HydrodampError, MethodError
from hydrodamp.identification import adaptive, recursive
from hydrodamp.identification.recursive import TYPICAL_VELOCITY
from hydrodamp.kernels.plant import Sample
from hydrodamp.live.change_detection import Alarm, update_alarm
from hydrodamp.live.evidence import grade_axes
from hydrodamp.live.ranges import ranges_of
from hydrodamp.live.sample_validation import BEGIN, LEFT_OUT, TAKEN, SampleValidator, classify
from hydrodamp.live.samples import (
    Row,
    make_sample,
    read_inputs,
    read_number,
    read_velocity,
    sample_equations,
)
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle

#: Methods that run on board.
METHODS = ("rls", "ai")


class LiveState(NamedTuple):
    """Where a live run stands.

    Recursive least squares always runs: beside the adaptive identifier it tells what is excited,
    and what has not settled.
    """

    rls: recursive.RecursiveState
    ai: adaptive.State | None
    validator: SampleValidator
    n_rows: int  # rows of the source
    counts: dict[str, int]  # taken, left out by kind, runs by what began them
    alarm: Alarm = Alarm()

    @property
    def coefficients(self) -> FloatArray:
        """The present estimate, in the order of the model's labels."""
        if self.ai is None:
            return self.rls.estimate.coefficients
        return np.asarray(self.ai.matrix[self.ai.adaptation.entries])

    @property
    def digest(self) -> str:
        """What tells whether a state is of this vehicle, model and method."""
        columns, recursion = self.rls.adaptation.equations, self.rls.adaptation.recursion
        plant = columns.plant
        seen = hashlib.sha256(repr((self.rls.adaptation.model.labels, columns.channels)).encode())
        arrays = [plant.mass_matrix, plant.free, plant.factors, recursion.known, recursion.unit]
        arrays += [] if self.ai is None else [self.ai.adaptation.gains.a]
        arrays += [] if self.ai is None else [self.ai.adaptation.gains.gamma]
        for array in arrays:
            seen.update(np.ascontiguousarray(array).data)
        seen.update(repr((recursion.block, recursion.forgetting)).encode())
        return seen.hexdigest()


_RLS, _AI = (
    recursive.RecursiveLeastSquares(typical_velocity=TYPICAL_VELOCITY),
    adaptive.AdaptiveIdentifier(),
)


def start(vehicle: Vehicle, model: DampingModel, method: str, row: Row) -> LiveState:
    """Return the state before a first row, which tells what is measured; it is not taken yet."""
    if method not in METHODS:
        raise MethodError(f"`--method` must be one of {', '.join(METHODS)}; got '{method}'.")
    columns = sample_equations(vehicle, model, row)
    sample = make_sample(columns, row, read_velocity(row, vehicle.free.tolist()), None)
    ai = _AI.init(columns, model, sample) if method == "ai" else None
    return LiveState(_RLS.init(columns, model, sample), ai, SampleValidator(), 0, {TAKEN: 0})


def update(state: LiveState, row: Row) -> tuple[LiveState, str]:
    """Return the state after a row, and what became of it."""
    if not row:
        return _counted(state, "unreadable"), "unreadable"
    columns, last = state.rls.adaptation.equations, state.rls.last
    velocity = read_velocity(row, columns.vehicle.free.tolist())
    segment = str(row.get(SEGMENT, ""))
    ranges = ranges_of(columns)
    inputs = read_inputs(row, ranges.names)
    screen, told = classify(
        state.validator, read_number(row, "time"), velocity, segment, inputs, ranges
    )
    rls, ai, alarm = state.rls, state.ai, state.alarm
    if told not in LEFT_OUT:
        try:
            sample = make_sample(columns, row, velocity, None if told in BEGIN else last)
        except HydrodampError:
            screen, told = state.validator._replace(is_broken=True), "incomplete"
        else:
            if np.abs(sample.propulsion).max() > MAX_VELOCITY:
                return count_rejected(state, "absurd"), "absurd"
            rls, ai = _moved(rls, ai, sample, told in BEGIN)
            if not _is_finite(state, rls, ai):
                return count_rejected(state, "overflow"), "overflow"
            if told not in BEGIN and rls.estimate is not state.rls.estimate:
                alarm = update_alarm(alarm, state.rls, rls, screen.time)
    return _counted(LiveState(rls, ai, screen, state.n_rows, state.counts, alarm), told), told


def count_rejected(state: LiveState, told: str) -> LiveState:
    """Return the state after a sample that is left out; the next one taken begins a run."""
    return _counted(state._replace(validator=state.validator._replace(is_broken=True)), told)


def _is_finite(before: LiveState, rls: recursive.RecursiveState, ai: adaptive.State | None) -> bool:
    """Return whether all that a step changed is finite."""
    changed = [rls.block]
    if rls.estimate is not before.rls.estimate:
        changed += rls.estimate
    if ai is not None:
        changed.append(ai.table)
    return all(np.isfinite(values).all() for values in changed)


def _counted(state: LiveState, told: str) -> LiveState:
    counts = state.counts | {told: state.counts.get(told, 0) + 1}
    if told in BEGIN:
        counts[TAKEN] += 1
    return state._replace(n_rows=state.n_rows + 1, counts=counts)


def _moved(
    rls: recursive.RecursiveState, ai: adaptive.State | None, sample: Sample, begins: bool
) -> tuple[recursive.RecursiveState, adaptive.State | None]:
    if begins:
        return rls.restart(sample), None if ai is None else ai.restart(sample)
    return _RLS.step(rls, sample), None if ai is None else _AI.step(ai, sample)


def estimate_line(state: LiveState) -> dict[str, Any]:
    """Return what is told of a state: strict JSON, null where there is no number."""
    bound, settled = state.rls.adaptation, _settled(state)
    axes, evidence = bound.recursion.axes, [one.evidence for one in state.alarm.axes]
    model_form = np.array([one.has_model_form for one in state.alarm.axes])
    grading = grade_axes(state.rls, state.coefficients, evidence, settled, model_form)
    errors = grading.errors if state.ai is None else np.full(len(axes), np.nan)
    columns = zip(
        bound.model.labels,
        state.coefficients.tolist(),
        errors.tolist(),
        grading.grades,
        grading.causes,
        strict=True,
    )
    present = np.unique(axes).tolist()
    return {
        "time": _number(state.validator.time),
        "method": "rls" if state.ai is None else "ai",
        "coefficients": {
            label: {
                "value": _number(value),
                "standard_error": _number(error),
                "grade": grade.word,
                "cause": cause.word if cause else None,
            }
            for label, value, error, grade, cause in columns
        },
        "excitation": {AXES[i]: float(grading.excitation[i]) for i in present},
        "model_form": [AXES[i] for i in present if model_form[i]],
        "alarm": state.alarm.line(present),
        "counts": state.counts,
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _settled(state: LiveState) -> np.ndarray:
    """Return on which axes the coefficients are where the data want them, shape (6,)."""
    if state.ai is None:
        return np.ones(6, dtype=np.bool_)
    return (
        recursive.missing_wrench_share(state.rls, state.coefficients) <= adaptive.MAX_RESIDUAL_SHARE
    )
