"""What comes before the search: mode, reachable speed, members that steer, baseline, sizes."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import ProblemError
from hydrodamp.experiment_design.autopilot import Autopilot
from hydrodamp.experiment_design.closed_loop import (
    ClosedLoopSimulator,
    Trajectories,
)
from hydrodamp.experiment_design.excitation import Manoeuvre, baseline_manoeuvres
from hydrodamp.experiment_design.optimiser import (
    simulate_candidates,
    worst_violation,
)
from hydrodamp.simulation.problem import prepare

Mode = Literal["overlays", "setpoints", "waypoints"]
"""How a dive is executed: setpoints and excitation of commands, setpoints alone, or waypoints."""

#: Mode of a vehicle with a propeller and steering; docs/how-to/plan-a-dive.md.
DEFAULT_MODE: Mode = "setpoints"

#: Members of the ensemble that a dive is verified with.
VERIFIED = 40

#: Motion of a vehicle that is steered, at least: standard deviations [m/s, rad/s].
_MOTION = np.full(6, 0.1)

#: Strengths of steps that are tried.
_STRENGTHS = np.linspace(1.0, 0.1, 10)


def choose_mode(autopilot: Autopilot, mode: Mode | None) -> Mode:
    """Return the mode given, or that of the vehicle; refuse one that it cannot execute."""
    follows = autopilot.propeller is not None and autopilot.heading is not None
    if mode is None:
        return DEFAULT_MODE if follows else "overlays"
    if mode != "overlays" and not follows:
        raise ProblemError(
            f"mode '{mode}' needs a propeller that drives the vehicle and an autopilot that steers "
            "its heading, which it has not here: plan with mode 'overlays'."
        )
    return mode


def check_reachable(closed_loop: ClosedLoopSimulator) -> None:
    """Refuse a speed that most members do not reach at the limits of the actuators."""
    autopilot, highest = closed_loop.autopilot, closed_loop.envelope.speed[1]
    speeds = closed_loop.reachable_speeds()
    if not np.any(autopilot.full_ahead) or np.median(speeds) >= highest:
        return
    low, middle, high = np.quantile(speeds, [0.05, 0.5, 0.95])
    limits = ", ".join(
        f"`{name}` of {command:.4g}"
        for name, command in zip(autopilot.names, autopilot.full_ahead, strict=True)
        if command
    )
    raise ProblemError(
        f"envelope: `speed` up to {highest:g} m/s is beyond the vehicle's reach: with {limits} it "
        f"reaches {middle:.2g} m/s, {low:.2g} to {high:.2g} in 90 % of the draws of its damping. "
        f"Lower `speed`, or correct these limits. {' '.join(autopilot.assumptions)}".rstrip()
    )


def steerable_members(closed_loop: ClosedLoopSimulator, samples: int) -> ClosedLoopSimulator:
    """Leave out members that cannot turn calmly to a course: the real vehicle can."""
    turns = (0.0, 0.75, 0.0, *[0.0] * len(closed_loop.autopilot.overlays))
    calm = [Manoeuvre("steps", level, 0.0, turns) for level in (0.0, 0.5, 1.0)]
    keeps = (
        worst_violation(closed_loop, simulate_candidates(closed_loop, calm, samples)).max(axis=0)
        <= 0.0
    )
    keeps[0] = True
    if keeps.sum() < VERIFIED:
        raise ProblemError(
            f"in {1.0 - keeps.mean():.0%} of the draws of the damping, the autopilot leaves the "
            "envelope as it turns to a course. Raise the lowest `speed`, give the `autopilot` its "
            "gains, or plan with a fit of smaller standard errors (`--damping`)."
        )
    return closed_loop.with_members(np.flatnonzero(keeps)[:VERIFIED].tolist())


def largest_steps(alone: ClosedLoopSimulator, samples: int, stretches: int) -> list[Manoeuvre]:
    """Return a campaign of steps, each as large as the envelope lets it be."""
    autopilot = alone.autopilot
    several = baseline_manoeuvres(len(autopilot.overlays), autopilot.hovers)
    offered = [one.attenuate(share) for one in several for share in _STRENGTHS]
    worst = worst_violation(alone, simulate_candidates(alone, offered, samples)).reshape(
        len(several), -1
    )
    fits = worst < 0.0
    fits[:, -1] = True  # if need be, the weakest
    best = fits.argmax(axis=1)
    found = [one.attenuate(_STRENGTHS[place]) for one, place in zip(several, best, strict=True)]
    return [found[n % len(found)] for n in range(stretches)]


def coefficient_sizes(
    alone: ClosedLoopSimulator, trajectories: Trajectories, seed: int
) -> FloatArray:
    """Return the coefficients of the wide model that would make all the force on their axis.

    The motion counts as no smaller than ``_MOTION``: a column that was hardly moved says nothing.
    """
    log = trajectories.log(alone.vehicle, alone.autopilot.names, exact=True)
    moved = np.random.default_rng(seed).standard_normal(log.velocity.shape) * _MOTION
    wide, damping = alone.ensemble.wide, alone.ensemble.dampings[0]
    problem = prepare(alone.vehicle, replace(log, velocity=log.velocity + moved), wide)
    columns = problem.regressor()[:, problem.equations.n_known :]
    own = problem.matrix(damping)[problem.equations.n_known :]
    force = np.sqrt(np.mean((columns @ own) ** 2, axis=0))
    size = dict(zip(problem.equations.basis, np.sqrt(np.mean(columns**2, axis=0)), strict=True))
    rows = zip(force, wide.terms, strict=True)
    made = [f / (size[t] or 1.0) for f, terms in rows for t in terms]
    return np.array(made)
