"""Predicted error of standard missions: steps of depth and heading, also beyond the log's speeds.

The missions are simulated in closed loop with the identified damping and the autopilot that plans
use. A velocity is not to be trusted on a mission where the standard deviation of its predicted
error exceeds its RMS, the error of predicting no motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.errors import HydrodampError
from hydrodamp.experiment_design.autopilot_design import design_autopilot
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator
from hydrodamp.experiment_design.context import SEGMENT_DURATION
from hydrodamp.experiment_design.ensemble import DampingEnsemble
from hydrodamp.experiment_design.envelope import Envelope
from hydrodamp.experiment_design.guidance import Manoeuvre
from hydrodamp.experiment_design.optimise import simulate_candidates
from hydrodamp.identification.dissipativity import velocity_unit
from hydrodamp.identification.fit import Fit
from hydrodamp.validation.predicted_error import predict_error

#: Speeds beyond the range of the log, as a share of its ends.
SPEED_MARGIN = 0.15

#: Strengths of steps of heading and depth; those of the candidates of a plan.
HEADING_STRENGTH, DEPTH_STRENGTH = 0.5, 0.4

_DEGREES = np.repeat([1.0, np.degrees(1.0)], 3)  # from rad/s


@dataclass(frozen=True)
class MissionError:
    """Half-width of the 95 % band and RMS of each velocity on a mission, in m/s and deg/s."""

    kind: str
    speed: float
    is_inside: bool
    half_width: dict[str, float | None]
    motion: dict[str, float]

    @property
    def untrusted(self) -> dict[str, str]:
        """The predicted error of each velocity that is not to be trusted, as text."""
        return {
            name: f"{name} ±{half:.2g}" if half is not None else f"{name} diverges"
            for name, half in self.half_width.items()
            if half is None or half > 2.0 * self.motion[name] > 0.0
        }


def predict_missions(fit: Fit) -> tuple[MissionError, ...]:
    """Return the predicted errors of steps of depth and heading at speeds around those of the log.

    There are none of a fit without vehicle, covariance or speed ahead.
    """
    vehicle, (slow, fast) = fit.vehicle, fit.training_range.get("u", (0.0, 0.0))
    if vehicle is None or fit.damping.covariance is None or not slow > 0.0:
        return ()
    speeds = np.array([(1.0 - SPEED_MARGIN) * slow, slow, 0.5 * (slow + fast), fast])
    speeds = np.append(speeds, (1.0 + SPEED_MARGIN) * fast)
    envelope = Envelope(speed=(float(speeds[0]), float(speeds[-1])))
    autopilot = replace(design_autopilot(vehicle, fit.damping, envelope), adds_excitation=False)
    kinds = {"depth": (0.0, 0.0, DEPTH_STRENGTH), "heading": (0.0, HEADING_STRENGTH, 0.0)}
    loops = {"depth": autopilot.depth, "heading": autopilot.heading}
    levels = ((speeds - speeds[0]) / np.ptp(speeds)).tolist()
    flown = [kind for kind in kinds if loops[kind] is not None]
    missions = [Manoeuvre("steps", level, 0.1, kinds[kind]) for kind in flown for level in levels]
    pairs = [(kind, speed) for kind in flown for speed in speeds.tolist()]
    if autopilot.propeller is None or not missions:
        return ()
    ensemble = DampingEnsemble((fit.damping,), fit.model)
    simulator = ClosedLoopSimulator.of(vehicle, autopilot, envelope, ensemble)
    samples = round(SEGMENT_DURATION / envelope.period)
    log = simulate_candidates(simulator, missions, samples).log(
        vehicle, autopilot.names, exact=True
    )
    band = predict_error(vehicle, fit, log)
    results = []
    for (kind, speed), segment in zip(pairs, log.segments, strict=True):
        rows = slice(segment.start, segment.stop)
        ends = {name: getattr(band, name)[rows] for name in ("velocity", "lower", "upper")}
        sizes = replace(band, log=log.select(segment.name), **ends).rms_by_axis(vehicle.axes, "deg")
        rms = np.sqrt(np.mean(log.velocity[rows] ** 2, axis=0)) * _DEGREES
        motions = {VELOCITY_OF[axis]: float(rms[AXES.index(axis)]) for axis in vehicle.axes}
        is_inside = slow <= speed <= fast
        results.append(MissionError(kind, speed, is_inside, sizes, motions))
    return tuple(results)


def describe_missions(fit: Fit) -> Iterator[str]:
    """Yield sentences on the predicted errors of standard missions, if they can be simulated."""
    try:
        with np.errstate(all="ignore"):  # motions of a bad fit may diverge
            missions = predict_missions(fit)
    except HydrodampError:  # the autopilot cannot steer this vehicle
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
    for kind in dict.fromkeys(each.kind for each in missions):
        if untrusted := [each for each in missions if each.kind == kind and each.untrusted]:
            worst = max(untrusted, key=lambda each: len(each.untrusted))
            listed = ", ".join(f"{each.speed:.2g}" for each in untrusted)
            errors = ", ".join(worst.untrusted.values())
            yield (
                f"Do not trust {kind} steps at {listed} m/s ({errors} at {worst.speed:.2g} m/s): "
                "record them at that speed."
            )
