"""A first look at what a dive of ten minutes would add to a log."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import HydrodampError
from hydrodamp.experiment_design.autopilot import design_autopilot
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator
from hydrodamp.experiment_design.ensemble import DampingEnsemble
from hydrodamp.experiment_design.envelope import CommandLimits, Envelope
from hydrodamp.experiment_design.excitation import candidate_manoeuvres
from hydrodamp.experiment_design.fisher_information import (
    ErrorModel,
    fisher_information,
    window_information,
)
from hydrodamp.experiment_design.optimiser import simulate_candidates, worst_violation
from hydrodamp.identification.differentiation import noise_variance
from hydrodamp.identification.fit import Fit, critical_value
from hydrodamp.identification.identifiability import MAX_RELATIVE_HALF_WIDTH, Grade, Identifiability
from hydrodamp.simulation.problem import Problem

#: Length of the dive looked at, and of the manoeuvres it is made of [s].
_DIVE, _STRETCH = 600.0, 40.0

#: Manoeuvres of the dive, and the share of each coefficient's size below which nothing is known.
_TAKEN, _RIDGE = 4, 1e-3

#: Depths that limit nothing [m], and how far a log's own speeds and commands reach [%].
_DEEP, _REACH = (0.0, 1000.0), (5.0, 95.0)

_TOLD = "`hydrodamp plan --damping FILE --duration 600` says what to sail"


def expected_gain(problem: Problem, fit: Fit, grades: Identifiability) -> str:
    """Say what ten minutes of planned manoeuvres would add to what a log determines.

    Manoeuvres are simulated with the fit's damping at the speeds of the log, and standard errors
    fall from those of the fit as Cramer and Rao's bound falls from that of the log.
    """
    open_ones = [label for label, grade in grades.grades.items() if grade is not Grade.DETERMINED]
    if not open_ones:
        return ""
    n = len(open_ones)
    counted = f"{n} of {fit.model.n_coefficients} coefficients are less than determined"
    if fit.damping.covariance is None:
        return f"{counted}: {_TOLD} next."
    try:
        share = _share(problem, fit)
    except HydrodampError:
        return f"{counted}: {_TOLD} next, once it is known how the vehicle is steered."
    error = np.sqrt(np.diag(fit.damping.covariance)) * share
    narrow = critical_value() * error <= MAX_RELATIVE_HALF_WIDTH * np.abs(fit.damping.coefficients)
    gained = [label for label, now in zip(fit.model.labels, narrow, strict=True) if now]
    more = [label for label in open_ones if label in gained]
    named = f", {', '.join(more[:3])}{' and others' * (len(more) > 3)}," if more else ""
    lower = 100.0 * (1.0 - float(np.exp(np.mean(np.log(share)))))
    return (
        f"{counted}. A planned dive of ten minutes would make standard errors {lower:.0f} % less "
        f"and bring about {len(more) or 'none'} of them{named} there: {_TOLD}."
    )


def _share(problem: Problem, fit: Fit) -> FloatArray:
    """Return what standard errors would fall to, as a share, where the dive is added to the log."""
    vehicle, log = problem.vehicle, problem.log
    low, high = np.percentile(log.velocity[:, 0], _REACH)
    speed = (max(float(low), 0.1), max(float(high), 0.2))
    ends = {name: np.percentile(log.command(name), _REACH) for name in log.command_names}
    commands = {
        name: CommandLimits(lowest=min(float(a), -float(b)), highest=max(float(b), -float(a)))
        for name, (a, b) in ends.items()
        if max(abs(a), abs(b)) > 0.0 and name in (*vehicle.commands, *fit.model.commands)
    }
    envelope = Envelope(depth=_DEEP, speed=speed, commands=commands)
    closed_loop = ClosedLoopSimulator.of(
        vehicle,
        design_autopilot(vehicle, fit.damping, envelope),
        envelope,
        DampingEnsemble((fit.damping,), fit.model),
    )
    seen = ErrorModel.of(np.sqrt(noise_variance(problem)))
    before = window_information(problem, problem.matrix(fit.damping), fit.model, seen).sum(axis=0)
    several = candidate_manoeuvres(len(closed_loop.autopilot.overlays))
    trajectories = simulate_candidates(closed_loop, several, round(_STRETCH / envelope.period))
    keeps = worst_violation(closed_loop, trajectories).max(axis=1) <= 0.0
    if not keeps.any():
        raise HydrodampError("no manoeuvre keeps within bounds")
    told = fisher_information(closed_loop, trajectories, seen)[keeps]
    size = np.sqrt(np.diag(before + told.sum(axis=0))) * _RIDGE
    after = before + np.diag(size**2)
    start = np.linalg.inv(after)
    for _ in range(_TAKEN):
        best = int(np.argmax(np.linalg.slogdet(after + told)[1]))
        after = after + told[best] * _DIVE / _STRETCH / _TAKEN
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(after)) / np.diag(start)))
