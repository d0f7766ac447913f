"""Autopilots scheduled over speeds, with their stability margins over draws of the damping."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.control import linear_model as linear
from hydrodamp.control.loop_margins import (
    MARGINAL,
    MIN_MODULUS,
    LinearLaw,
    Margins,
    linear_law,
    stability_margins,
)
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError, demand
from hydrodamp.experiment_design.autopilot_design import DesignedAutopilot, design_autopilot
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator, Trajectories
from hydrodamp.experiment_design.context import limit_by_log
from hydrodamp.experiment_design.ensemble import DampingEnsemble, draw_ensemble
from hydrodamp.experiment_design.envelope import Envelope
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.predicted_error import predict_error
from hydrodamp.models.damping import Damping
from hydrodamp.progress import count_items
from hydrodamp.simulation.closed_loop import FIN_LIMIT
from hydrodamp.status import TextEnum
from hydrodamp.vehicle.vehicle import Vehicle

STEP_LENGTHS = 30.0
"""Duration of a simulated step after half as long without, in lengths of the vehicle travelled."""

MAX_SIMULATED = 50
"""Draws whose step is simulated."""


class Outcome(TextEnum):
    """Outcome of the design at a speed."""

    OK = "ok: the margins of all draws are acceptable."
    LOW_MARGIN = "low margins: a draw has less than the acceptable modulus margin."
    UNCERTAIN = "uncertain: a draw has no trim, or its closed loop diverges."
    UNSTABLE = "unstable: the closed loop of the estimate diverges."
    NO_TRIM = "no trim: no commands within their limits hold this speed on a straight level course."

    @property
    def usable(self) -> bool:
        """Whether the speed has a stable autopilot."""
        return self in (Outcome.OK, Outcome.LOW_MARGIN, Outcome.UNCERTAIN)


@dataclass(frozen=True, eq=False)
class SpeedDesign:
    """The outcome at one speed."""

    speed: float
    outcome: Outcome
    warning: str


@dataclass(frozen=True, eq=False)
class LoopDesign(SpeedDesign):
    """The design at a speed with a trim; arrays have a row for each draw, the estimate first."""

    model: linear.LinearModel
    used: BoolArray  # states of the closed loop
    autopilot: DesignedAutopilot
    law: LinearLaw
    margins: Margins
    step: Trajectories


@dataclass(frozen=True, eq=False)
class ControlDesign:
    """Autopilots of a vehicle at several speeds."""

    vehicle: Vehicle
    damping: Damping
    period: float
    n_draws: int
    speeds: tuple[SpeedDesign, ...]
    assumptions: tuple[str, ...] = ()

    @property
    def loops(self) -> list[LoopDesign]:
        """The designs at speeds with a trim."""
        return [each for each in self.speeds if isinstance(each, LoopDesign)]

    @property
    def accepted(self) -> bool:
        """Whether the margins of all draws are acceptable at all speeds."""
        return all(each.outcome is Outcome.OK for each in self.speeds)

    def __str__(self) -> str:
        """Return the verdict."""
        head = "Acceptable" if self.accepted else "Not acceptable"
        faults = [
            f"at {each.speed:g} m/s {each.outcome.value}"
            for each in self.speeds
            if each.outcome not in (Outcome.OK, Outcome.LOW_MARGIN)
        ]
        if self.loops:
            worst = min(self.loops, key=lambda each: float(each.margins.modulus.min()))
            modulus = worst.margins.modulus.min()
            of = f"over {self.n_draws} draws" if self.n_draws else "of the estimate alone"
            faults.insert(
                0,
                f"the smallest modulus margin {of} is {modulus:.2f} at {worst.speed:g} m/s; "
                f"{MIN_MODULUS:g} is required.",
            )
        return f"{head}: {' '.join(faults)}"


def design_control(
    vehicle: Vehicle,
    damping: Damping,
    speeds: Sequence[float],
    *,
    envelope: Envelope | None = None,
    fit: Fit | None = None,
    draws: int = 100,
) -> ControlDesign:
    """Design an autopilot at each surge speed [m/s], with margins over draws of the damping."""
    valid = bool(speeds) and all(0.0 <= each < np.inf for each in speeds)
    demand(valid, "speed", "one or more speeds from 0 m/s", [*speeds])
    demand(draws >= 0, "draws", "0 or more", draws)
    ensemble = draw_ensemble(vehicle, damping, draws)
    envelope = envelope or Envelope()
    if fit is not None:
        envelope = limit_by_log(vehicle, envelope, fit)
    band = {"speed": (min(speeds), max(speeds))}
    overall = design_autopilot(vehicle, damping, envelope.model_copy(update=band))
    progress = count_items(sorted({*speeds}), "designing autopilots", len({*speeds}))
    return ControlDesign(
        vehicle,
        damping,
        envelope.period,
        len(ensemble.dampings) - 1,
        tuple(_design_at(speed, vehicle, ensemble, envelope, fit) for speed in progress),
        (*overall.assumptions, *_default_values(envelope, overall)),
    )


def _default_values(envelope: Envelope, autopilot: DesignedAutopilot) -> Iterator[str]:
    """Yield the values of the envelope that are used and not stated."""
    values = {"period": ("time between commands [s]", envelope.period)}
    if autopilot.pitch is not None:
        values["pitch"] = ("largest pitch [deg]", envelope.pitch)
    assumed = [
        f"{quantity} `{key}: {value:g}`"
        for key, (quantity, value) in values.items()
        if key not in envelope.model_fields_set
    ]
    if assumed:
        yield f"Assumed: {', '.join(assumed)}. State it in the file of `--envelope`."


def _design_at(
    speed: float,
    vehicle: Vehicle,
    ensemble: DampingEnsemble,
    envelope: Envelope,
    fit: Fit | None,
) -> SpeedDesign:
    """Return the design at a speed."""
    nominal, period = ensemble.dampings[0], envelope.period
    envelope = envelope.model_copy(update={"speed": (speed, speed)})
    try:
        autopilot = design_autopilot(vehicle, nominal, envelope)
    except ProblemError:  # the propeller does not reach this speed
        return SpeedDesign(speed, Outcome.NO_TRIM, "")
    simulator = ClosedLoopSimulator.of(vehicle, autopilot, envelope, ensemble)
    model = linear.linearise(simulator.equation, autopilot, speed)
    if not model.exists[0]:
        return SpeedDesign(speed, Outcome.NO_TRIM, "")
    used = linear.free_states(vehicle)
    trim = model.commands[0].copy()
    used[[8, 9]] &= [autopilot.heading is not None, autopilot.depth is not None]
    if autopilot.propeller is not None:
        trim[autopilot.propeller] = 0.0  # the autopilot adds it
    scales = linear.state_scales(vehicle)
    law = linear_law(autopilot, model.state[0], scales, period)
    known = np.flatnonzero(model.exists)
    valid = replace(model, a=model.a[known], b=model.b[known])
    margins = stability_margins(valid, law, used, period)
    step = _simulate_step(simulator.with_members(known[:MAX_SIMULATED].tolist()), speed, trim)
    diverges = margins.growth > MARGINAL
    diverges[:MAX_SIMULATED] |= step.states[-1, :, 7] == -np.pi / 2.0
    outcome = Outcome.OK
    if diverges[0]:
        outcome = Outcome.UNSTABLE
    elif diverges.any() or not model.exists.all():
        outcome = Outcome.UNCERTAIN
    elif margins.modulus.min() < MIN_MODULUS:
        outcome = Outcome.LOW_MARGIN
    warning = "" if fit is None else _extrapolation(vehicle, fit, speed, model, autopilot.names)
    return LoopDesign(speed, outcome, warning, model, used, autopilot, law, margins, step)


def _simulate_step(
    simulator: ClosedLoopSimulator, speed: float, overlay: FloatArray
) -> Trajectories:
    """Return a step of a length in depth, or of 20 deg in heading without a depth loop."""
    vehicle, period = simulator.vehicle, simulator.envelope.period
    length = linear.vehicle_length(vehicle)
    pace = speed or 0.25 * linear.state_scales(vehicle)[0]
    n = int(np.ceil(STEP_LENGTHS * length / pace / period))
    setpoints = np.zeros((n + n // 2, 1, 3))
    setpoints[:, 0, 0] = speed
    is_vertical = "Z" in vehicle.axes and simulator.autopilot.depth is not None
    setpoints[n // 2 :, 0, 2 if is_vertical else 1] = length if is_vertical else FIN_LIMIT
    return simulator.simulate((setpoints, np.tile(overlay, (len(setpoints), 1, 1))))


def _extrapolation(
    vehicle: Vehicle, fit: Fit, speed: float, model: linear.LinearModel, names: tuple[str, ...]
) -> str:
    """Return a warning of a speed outside the training range, with the predicted error."""
    low, high = fit.training_range.get("u", (speed, speed))
    if low <= speed <= high:
        return ""
    error = ""
    if fit.damping.covariance is not None:
        trim, length = model.state[0], linear.vehicle_length(vehicle)
        time = np.linspace(0.0, STEP_LENGTHS * length / max(speed, high - low), 500)
        velocity = np.tile(trim[:6], (len(time), 1))
        velocity[0, 0] = min(max(speed, low), high)
        attitude = np.tile(trim[6:9], (len(time), 1))
        commands = dict(zip(names, np.tile(model.commands[0], (len(time), 1)).T, strict=True))
        log = Log.from_arrays(time, velocity, attitude=attitude, commands=commands)
        half_width = predict_error(vehicle, fit, log).half_width[-1, 0]
        error = f"; the predicted error of its steady speed is ±{half_width:.2g} m/s (95 %)"
    return (
        f"{speed:g} m/s is outside the training data, {low:.3g} to {high:.3g} m/s{error}. "
        "The margins there are a guess."
    )
