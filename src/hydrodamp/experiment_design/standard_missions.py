"""Predicted error of standard missions: steps of depth and heading, also beyond the log's speeds.

The missions are simulated in closed loop with the identified damping and the autopilot that plans
use; their steps are the largest of ``STRENGTHS`` whose motion is within the range of the log. A
velocity that the steps drive is not to be trusted where the standard deviation of its predicted
error exceeds its RMS, the error of predicting no motion. Errors of open-loop replays of a vehicle
that is unstable straight ahead grow exponentially, with any coefficients.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.term import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.errors import HydrodampError, MethodError
from hydrodamp.experiment_design.autopilot_design import design_autopilot
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator
from hydrodamp.experiment_design.context import SEGMENT_DURATION, limit_by_log
from hydrodamp.experiment_design.ensemble import DampingEnsemble
from hydrodamp.experiment_design.envelope import Envelope
from hydrodamp.experiment_design.guidance import Manoeuvre
from hydrodamp.experiment_design.optimise import simulate_candidates
from hydrodamp.identification.dissipativity import velocity_unit
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.predicted_error import predict_error
from hydrodamp.simulation.checks import CHANNEL_AXES
from hydrodamp.simulation.closed_loop import N_STATES

#: Speeds beyond the range of the log, as a share of its ends.
SPEED_MARGIN = 0.15

#: Steps of depth and heading; the first are those of the candidates of a plan.
STRENGTHS = {
    "depth": [(0.0, 0.0, strength) for strength in (0.4, 0.2, 0.1, 0.05)],
    "heading": [(0.0, strength, 0.0) for strength in (0.5, 0.25, 0.12, 0.06)],
}

#: Velocities that they drive; others move little.
DRIVEN = {"depth": "uwq", "heading": "uvr"}

#: Difference of the velocities over the speed, for derivatives.
RELATIVE_STEP = 1e-3

#: Why no log helps.
UNSTABLE = (
    "the vehicle is unstable there without its autopilot, so errors of open-loop replays grow "
    "whatever the log."
)

_DEGREES = np.repeat([1.0, np.degrees(1.0)], 3)  # from rad/s


@dataclass(frozen=True)
class MissionError:
    """Half-width of the 95 % band and RMS of each velocity on a mission, in m/s and deg/s."""

    kind: str
    speed: float
    is_inside: bool
    is_unstable: bool
    half_width: dict[str, float | None]
    motion: dict[str, float]

    @property
    def untrusted(self) -> dict[str, str]:
        """The predicted error of each velocity that is not to be trusted, as text."""
        return {
            name: f"{name} ±{half:.2g}" if half is not None else f"{name} diverges"
            for name, half in self.half_width.items()
            if half is None or (half > 2.0 * self.motion[name] > 0.0 and name in DRIVEN[self.kind])
        }


def predict_missions(fit: Fit) -> tuple[MissionError, ...]:
    """Return the predicted errors of steps of depth and heading at speeds around those of the log.

    Raise where the vehicle cannot be steered at a speed ahead, or the fit has no covariance.
    """
    vehicle, (slow, fast) = fit.vehicle, fit.training_range.get("u", (0.0, 0.0))
    if vehicle is None or fit.damping.covariance is None:
        raise MethodError("the fit has no vehicle or no covariance.")
    if not CHANNEL_AXES.keys().isdisjoint(fit.model.commands):
        raise MethodError("the log has a wrench, and no commands to steer with.")
    if not slow > 0.0:
        raise MethodError(
            "surge is about zero or astern in a part of the log, and steps need way ahead."
        )
    speeds = np.array([(1.0 - SPEED_MARGIN) * slow, slow, 0.5 * (slow + fast), fast])
    speeds = np.append(speeds, (1.0 + SPEED_MARGIN) * fast)
    envelope = Envelope(speed=(float(speeds[0]), float(speeds[-1])))
    envelope = limit_by_log(vehicle, envelope, fit)
    autopilot = replace(design_autopilot(vehicle, fit.damping, envelope), adds_excitation=False)
    loops = {"depth": autopilot.depth, "heading": autopilot.heading}
    levels = ((speeds - speeds[0]) / np.ptp(speeds)).tolist()
    flown = [kind for kind in STRENGTHS if loops[kind] is not None]
    missions = [
        Manoeuvre("steps", level, 0.1, strengths)
        for kind in flown
        for level in levels
        for strengths in STRENGTHS[kind]
    ]
    if autopilot.propeller is None or not missions:
        raise MethodError(f"the commands of '{vehicle.name}' do not control speed and course.")
    ensemble = DampingEnsemble((fit.damping,), fit.model)
    simulator = ClosedLoopSimulator.of(vehicle, autopilot, envelope, ensemble)
    samples = round(SEGMENT_DURATION / envelope.period)
    trajectories = simulate_candidates(simulator, missions, samples)
    chosen = _choose_strengths(trajectories.states, fit.training_range)
    log = trajectories.select(chosen).log(vehicle, autopilot.names, exact=True)
    growth = SEGMENT_DURATION * _growth_rates(simulator, speeds)
    cases = [
        (kind, speed, slow <= speed <= fast, exponent > 1.0)
        for kind in flown
        for speed, exponent in zip(speeds.tolist(), growth.tolist(), strict=True)
    ]
    band = predict_error(vehicle, fit, log)
    results = []
    for case, segment in zip(cases, log.segments, strict=True):
        rows = slice(segment.start, segment.stop)
        ends = {name: getattr(band, name)[rows] for name in ("velocity", "lower", "upper")}
        sizes = replace(band, log=log.select(segment.name), **ends).rms_by_axis(vehicle.axes, "deg")
        rms = np.sqrt(np.mean(log.velocity[rows] ** 2, axis=0)) * _DEGREES
        motions = {VELOCITY_OF[axis]: float(rms[AXES.index(axis)]) for axis in vehicle.axes}
        results.append(MissionError(*case, sizes, motions))
    return tuple(results)


def _choose_strengths(states: FloatArray, ranges: dict[str, tuple[float, float]]) -> IntArray:
    """Return, of each mission, the strongest variant whose motion is that of the log."""
    limits = np.array([ranges.get(name, (0.0, np.inf))[1] for name in VELOCITIES[1:]])
    peaks = np.quantile(np.abs(states[:, :, 1:6]), 0.99, axis=0)
    n = len(STRENGTHS["depth"])
    fits = np.all(peaks <= limits, axis=1).reshape(-1, n)
    fits[:, -1] = True  # the weakest, if no other is
    return np.asarray(n * np.arange(len(fits)) + fits.argmax(axis=1))


def _growth_rates(simulator: ClosedLoopSimulator, speeds: FloatArray) -> FloatArray:
    """Return the largest growth rate [1/s] of small velocities straight ahead, open loop."""
    autopilot, equation = simulator.autopilot, simulator.equation
    free = np.flatnonzero(simulator.vehicle.free)
    state = np.zeros((len(speeds), 2, len(free), N_STATES))
    state[..., 0] = speeds[:, None, None]
    step = RELATIVE_STEP * speeds
    state[:, 0, range(len(free)), free] += step[:, None]
    state[:, 1, range(len(free)), free] -= step[:, None]
    states = state.reshape(-1, N_STATES)
    commands = np.zeros((len(states), len(autopilot.names)))
    commands[:, autopilot.propeller] = np.repeat(
        autopilot.propeller_command(speeds), len(states) // len(speeds)
    )
    inputs = equation.inputs(dict(zip(autopilot.names, commands.T, strict=True)), len(states))
    acceleration = equation.acceleration(states, *inputs).reshape(len(speeds), 2, len(free), 6)
    slopes = (acceleration[:, 0] - acceleration[:, 1])[:, :, free] / (2.0 * step[:, None, None])
    return np.asarray(np.linalg.eigvals(slopes).real.max(axis=1))


def describe_missions(fit: Fit) -> Iterator[str]:
    """Yield sentences on the predicted errors of standard missions, or why there are none."""
    try:
        with np.errstate(all="ignore"):  # motions of a bad fit may diverge
            missions = predict_missions(fit)
    except HydrodampError as error:  # the autopilot cannot steer this vehicle
        yield f"Errors of other missions are not predicted: {error}"
        return
    trusted = [each for each in missions if each.is_inside and not each.untrusted]
    if trusted:
        errors = ", ".join(
            f"{name} ±{max(each.half_width[name] or 0.0 for each in trusted):.2g} "
            f"{velocity_unit(name).replace('rad', 'deg')}"
            for name in trusted[0].half_width
        )
        kinds = " and ".join(dict.fromkeys(each.kind for each in trusted))
        low, high = (choose(each.speed for each in trusted) for choose in (min, max))
        yield f"Predicted error (95 %) of {kinds} steps at {low:.2g} to {high:.2g} m/s: {errors}."
    elif missions:
        yield (
            "Predicted error (95 %): larger than the motion itself in all steps at the speeds of "
            "the log."
        )
    groups: dict[tuple[str, bool], list[MissionError]] = {}
    for each in missions:
        if each.untrusted:
            groups.setdefault((each.kind, each.is_unstable), []).append(each)
    for (kind, is_unstable), untrusted in groups.items():
        speeds = ", ".join(f"{each.speed:.2g}" for each in untrusted)
        worst = max(untrusted, key=lambda each: len(each.untrusted))
        errors = ", ".join(worst.untrusted.values())
        yield (
            f"Do not trust {kind} steps at {speeds} m/s ({errors} at {worst.speed:.2g} m/s): "
            f"{UNSTABLE if is_unstable else 'record them at that speed.'}"
        )
