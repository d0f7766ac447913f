"""Recursive identification without I/O: ``update(state, row) -> state``, and estimate lines.

Recursive least squares always runs. With an adaptive identifier it provides the excitation, the
alarm and the test of convergence.
"""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from itertools import compress
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import AXES, VELOCITIES, Term
from hydrodamp.data.channels import SEGMENT
from hydrodamp.errors import HydrodampError, MethodError, ProblemError
from hydrodamp.identification import adaptive, composite, recursive
from hydrodamp.identification.grades import MIN_MOTION_LEVERAGE, Cause, Grade, grade_coefficients
from hydrodamp.identification.online import OnlineIdentifier
from hydrodamp.kernels.plant import Sample
from hydrodamp.live.change_detection import Alarm, update_alarm
from hydrodamp.live.sample_validator import (
    ACCEPTED,
    MAX_INCOMPLETE,
    MAX_OUTLIERS,
    REJECTED,
    RESTARTS,
    SampleValidator,
    classify,
    count_other_channels,
)
from hydrodamp.live.samples import (
    Row,
    optional_channels,
    read_inputs,
    read_sample,
    sample_equations,
)
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.ranges import TYPICAL_VELOCITY, Ranges
from hydrodamp.vehicle.vehicle import Vehicle

CRITICAL_VALUE = 1.959964  # of a 95 % interval of the normal distribution

WORDS = {None: None, **{each: each.word for each in (*Grade, *Cause)}}


class LiveState(NamedTuple):
    """State of a live run: estimators, sample validator, counts and alarm."""

    rls: recursive.RecursiveState
    ai: adaptive.State | composite.CompositeState | None
    ranges: Ranges
    validator: SampleValidator
    n_rows: int  # of the source
    counts: dict[str, int]  # samples by class
    method: str
    alarm: Alarm = Alarm()

    @property
    def coefficients(self) -> FloatArray:
        """The present estimate, in the order of the model's labels."""
        return (self.ai or self.rls).coefficients

    @property
    def digest(self) -> str:
        """Hash of the vehicle, model, channels, method and settings."""
        adaptation = self.rls.adaptation
        plant, recursion = adaptation.equations.plant, adaptation.settings
        settings = METHODS[self.method]
        names = (adaptation.model.labels, adaptation.equations.channels, settings)
        digest = hashlib.sha256(repr(names).encode())
        arrays = [plant.mass_matrix, plant.free, plant.factors, recursion.known, recursion.unit]
        for array in arrays:
            digest.update(np.ascontiguousarray(array).data)
        digest.update(repr((recursion.block, recursion.forgetting)).encode())
        return digest.hexdigest()

    def add_count(self, kind: str, n: int = 1) -> LiveState:
        """Return the state with more samples of a class."""
        counts = self.counts | {kind: self.counts.get(kind, 0) + n}
        if kind in RESTARTS:
            counts[ACCEPTED] += n
        return self._replace(n_rows=self.n_rows + n, counts=counts)

    def reject(self, kind: str) -> LiveState:
        """Return the state after a rejected sample; the next accepted one restarts."""
        return self._replace(validator=self.validator._replace(is_interrupted=True)).add_count(kind)


#: Methods that run sample by sample, the default first.
METHODS: dict[str, OnlineIdentifier[Any, Any]] = {
    "ai-composite": composite.ONBOARD,
    "rls": recursive.RecursiveLeastSquares(typical_velocity=TYPICAL_VELOCITY),
    "ai": adaptive.AdaptiveIdentifier(),
}


def start(vehicle: Vehicle, model: DampingModel, method: str, row: Row) -> LiveState:
    """Return the initial state; the first row determines the channels and is not absorbed yet."""
    if method not in METHODS:
        raise MethodError(f"`--method` must be one of {', '.join(METHODS)}; got '{method}'.")
    channels = tuple(sorted(optional_channels(row)))
    equations, ranges = sample_equations(vehicle, model, row, channels)
    sample = read_sample(equations, ranges, channels, row, None)
    if isinstance(sample, str):
        raise ProblemError(f"a sample {REJECTED[sample]}.")
    ai = METHODS[method].init(equations, model, sample) if method != "rls" else None
    rls = METHODS["rls"].init(equations, model, sample)
    return LiveState(rls, ai, ranges, SampleValidator(channels=channels), 0, {ACCEPTED: 0}, method)


def find_stray(row: Row) -> str | None:
    """Return the class of a row that says nothing about the motion of the vehicle, else None."""
    if row:
        return "foreign" if row.keys().isdisjoint(VELOCITIES) else None
    return "unreadable"


def update(state: LiveState, row: Row) -> tuple[LiveState, str]:
    """Return the state after a row, and the class of the row."""
    if kind := find_stray(row):
        return state.add_count(kind), kind
    equations, ranges = state.rls.adaptation.equations, state.ranges
    channels = optional_channels(row, state.validator.channels)
    if equations.actuators:
        channels -= frozenset(AXES)
    validator = count_other_channels(state.validator, tuple(sorted(channels)))
    names, n_new = validator.new_channels
    if n_new >= MAX_OUTLIERS and channels.issuperset(validator.channels):
        validator, n_new = validator._replace(channels=names, new_channels=((), 0)), 0
    if n_new >= MAX_INCOMPLETE and not state.rls.estimate.rows.any():
        with suppress(HydrodampError):  # an incomplete row
            fresh = start(equations.vehicle, state.rls.adaptation.model, state.method, row)
            return update(fresh._replace(n_rows=state.n_rows, counts=state.counts), row)
    required = (*compress(VELOCITIES, equations.plant.free), *equations.required_commands)
    if n_new or not all(name in row for name in required):
        return state._replace(validator=validator).add_count("incomplete"), "incomplete"
    sample = read_sample(equations, ranges, validator.channels, row, state.rls.last)
    if isinstance(sample, str):
        return state.reject(sample), sample
    motion, segment = sample.values[1:10].tolist(), str(row.get(SEGMENT, ""))
    inputs = read_inputs(row, ranges.names, validator.channels)
    validator, kind = classify(validator, sample.time, motion, segment, inputs, ranges)
    if kind in REJECTED:
        return state._replace(validator=validator).add_count(kind), kind
    if is_restart := kind in RESTARTS:
        sample = Sample(sample.values.copy())
        sample.propulsion[1] = sample.propulsion[0]  # no step ends here
    rls, ai, alarm = state.rls, state.ai, state.alarm
    rls = rls.restart(sample) if is_restart else rls.advance(sample)
    if ai is not None:
        ai = ai.restart(sample) if is_restart else ai.advance(sample)
    has_row = rls.estimate is not state.rls.estimate
    arrays = (rls.block, *(rls.estimate if has_row else ()), *((ai.values,) if ai else ()))
    if not all(np.isfinite(array).all() for array in arrays):
        return state.reject("overflow"), "overflow"
    if has_row and not is_restart:
        alarm = update_alarm(alarm, state.rls, rls, validator.time)
    state = state._replace(rls=rls, ai=ai, validator=validator, alarm=alarm)
    return state.add_count(kind), kind


def _grade(
    state: LiveState, current: recursive.EstimateUncertainty, has_model_form: BoolArray
) -> Iterator[tuple[Grade, Cause | None]]:
    """Yield grade and cause of coefficients as `identify` does, from running moments."""
    evidence, bound = [test.evidence for test in state.alarm.axes], state.rls.adaptation
    model, axes, unit = bound.model, bound.settings.axes, bound.settings.unit
    excited = np.array([moments.is_excited for moments in evidence])
    quiet = {
        v for v, terms, x in zip("uvwpqr", model.terms, excited, strict=True) if terms and not x
    }
    squares = [
        np.zeros(len(terms)) if moments.columns is None else moments.columns
        for moments, terms in zip(evidence, model.terms, strict=True)
    ]
    grades, causes = grade_coefficients(
        state.coefficients,
        CRITICAL_VALUE * current.standard_errors,
        np.sqrt(np.concatenate(squares)) / np.where(unit > 0.0, unit, np.inf),
        np.array([not quiet & _velocities(term) for terms in model.terms for term in terms], float),
        ~current.is_estimated,
        response=np.array([moments.response for moments in evidence])[axes],
        excited=(excited & _has_converged(state))[axes],
    )
    # A leverage that does not last may be noise: such a coefficient is weak at best.
    is_noise = current.persistent_leverage_share < MIN_MOTION_LEVERAGE
    columns = zip(grades, causes, is_noise.tolist(), has_model_form.tolist(), strict=True)
    for grade, cause, is_weak, has_error in columns:
        if not state.rls.estimate.rows.any():
            yield Grade.NOT_DETERMINED, Cause.NO_BLOCK
        elif has_error:
            yield Grade.NOT_DETERMINED, Cause.MODEL_FORM
        else:
            yield (Grade.WEAK if is_weak and grade is Grade.DETERMINED else grade), cause


@lru_cache
def _velocities(term: Term) -> set[str]:
    return {factor.strip("|") for factor in term.factors}


def estimate_line(state: LiveState) -> dict[str, Any]:
    """Return an estimate as strict JSON; null where there is no value.

    All values are null before the first row of recursive least squares is complete.
    """
    adaptation, current = state.rls.adaptation, recursive.estimate_uncertainty(state.rls)
    # The difference from the estimate of least squares is an error.
    errors = np.hypot(current.standard_errors, state.coefficients - state.rls.coefficients)
    current = current._replace(standard_errors=errors)
    axes = adaptation.settings.axes
    model_form = np.array([test.evidence.is_model_form for test in state.alarm.axes])
    has_steps = state.ai is not None and state.counts[ACCEPTED] > 1
    has_estimate = has_steps or bool(state.rls.estimate.rows.any())
    has_errors = has_estimate and state.method != "ai"
    columns = zip(
        adaptation.model.labels,
        state.coefficients.tolist(),
        np.where(model_form[axes], np.nan, errors).tolist(),
        _grade(state, current, model_form[axes]),
        strict=True,
    )
    present = np.unique(axes).tolist()
    line = {
        "time": _finite(state.validator.time),
        "method": state.method,
        "coefficients": {
            label: {
                "value": _finite(value) if has_estimate else None,
                "standard_error": _finite(error) if has_errors else None,
                "grade": WORDS[grade],
                "cause": WORDS[cause],
            }
            for label, value, error, (grade, cause) in columns
        },
        "excitation": {AXES[i]: float(current.excitation[i]) for i in present},
        "model_form": [AXES[i] for i in present if model_form[i]],
        "alarm": state.alarm.line(present),
        "counts": state.counts,
    }
    return {"verdict": diagnostic_status(line)[1], **line}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _has_converged(state: LiveState) -> BoolArray:
    """Return on which axes the adaptive estimate is near that of least squares, shape (6,)."""
    if not isinstance(state.ai, adaptive.State):
        return np.ones(6, dtype=np.bool_)
    return (
        recursive.relative_wrench_difference(state.rls, state.coefficients)
        <= adaptive.MAX_RESIDUAL_SHARE
    )


def diagnostic_status(line: dict[str, Any]) -> tuple[bool, str, dict[str, str]]:
    """Return whether an estimate line is a warning to an operator, a message, and values."""
    grades = Counter(entry["grade"] for entry in line["coefficients"].values())
    determined = grades[Grade.DETERMINED.word]
    message = f"{determined} of {grades.total()} coefficients are determined"
    alarm, last = line["alarm"], line["alarm"]["last"]
    if last:
        axes = ", ".join(last["axes"])
        message = f"the vehicle has changed at about {last['since']:.0f} s on {axes}; {message}"
    values = {f"excitation {axis}": f"{value:.4g}" for axis, value in line["excitation"].items()}
    values |= {f"{grade.word}": str(grades[grade.word]) for grade in Grade}
    values |= {"alarm armed": " ".join(alarm["armed"]), "changes": str(alarm["changes"])}
    values |= {f"alarm {axis}": reason for axis, reason in alarm["not_armed"].items()}
    values |= {name: str(count) for name, count in line["counts"].items()}
    return not determined or last is not None, message, values
