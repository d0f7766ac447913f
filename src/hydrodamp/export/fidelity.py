"""Fidelity card: wrench error, replay RMS and projected terms of an export, measured.

The wrench error of an axis is rms(M (dν/dt_target - dν/dt_source)) / rms(K ξ) at the samples of a
log or over the operating box. The replay RMS is that of eq. 24 with attitude simulated.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.errors import first_few
from hydrodamp.export.plant import ExportedPlant, States, mass_ratio
from hydrodamp.export.target import NotRun, RunError, Target
from hydrodamp.export.verification import Engine, VerificationRun, sample_states
from hydrodamp.identification.dissipativity import max_damping_power
from hydrodamp.identification.predicted_error import PredictionBand
from hydrodamp.simulation.replay import Score, Trajectory, no_score, score

FORMAT, VERSION = "hydrodamp-fidelity", 2
UNITS = {
    "wrench_error": "% of the rms of the damping on that axis",
    "slow_error": "% of the rms of the damping on that axis, at a tenth of the velocities",
    "rms": "m/s and deg/s mixed (eq. 24)",
    "predicted_error": "m/s and deg/s, half-width of the 95 % band",
    "coverage": "% of the recorded samples inside that band around the target's replay",
    "power": "W, negative where damping dissipates",
    "mass_ratio": "added mass over the rigid body's",
}

ROUNDING = 1e-9  # relative error of a wrench; below it the difference is rounding
LOW_SPEED_RATIO, MAX_LOW_SPEED_STATES = 0.1, 100  # of the velocities; number of states


@dataclass(frozen=True)
class Replays:
    """Replays of a log with attitude simulated, compared in pairs.

    Attributes
    ----------
    source_to_target : Score
        RMS error (eq. 24) of the exported files against equation 1.
    source_to_log, target_to_log : Score
        RMS errors of both against the measured velocity.
    step : str
        Integration step of the target.
    coverage : dict of str to float
        Share of the recorded samples inside the 95 % band, moved to the replay of the target, by
        velocity [%]; empty without a band, or if the replay diverged.
    """

    source_to_target: Score
    source_to_log: Score
    target_to_log: Score
    step: str
    coverage: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Fidelity:
    """Errors of an export against its source.

    Attributes
    ----------
    target, description : str
        Key of the target; the program and version that the files are for.
    settings : dict of str to str
        Settings of the target.
    vehicle, model : str
        Name of the vehicle, title of the damping model.
    inputs : tuple of str
        Inputs of the exported model.
    projected : tuple of str
        Labels of the projected terms: the target cannot represent them, and their wrench was fitted
        with terms that it can. Empty if the export is exact.
    about : list of float
        Reference point of the target's coefficients, from the origin of the vehicle's body frame
        [m].
    ignores : str
        Unrepresented effects of equation 1.
    run_by : str
        Program that ran the files; empty if none could.
    not_run : str
        Why the files were not run.
    run_error : str
        Message of the installed compiler or interpreter that failed on the files.
    wrench_error : dict of str to float
        By axis, RMS difference between the wrenches of source and target [% of the rms of the
        damping].
    slow_error : dict of str to float
        The same at a tenth of the velocities, as when a simulation starts at rest.
    asked_at : str
        Velocities at which the errors are evaluated.
    replays : Replays or None
        None without a log, or if the files could not be run.
    power : dict of str to float
        Greatest power that the damping of source and of target puts into the motion within
        ``box`` [W]; negative if it dissipates at all velocities searched.
    box : str
        Range of the velocities searched: the operating box, as in reports.
    mass_ratio : dict of str to float
        Added mass over rigid-body mass by axis, where both are known.
    predicted_error : dict of str to float or None
        RMS half-width of the 95 % band around the replay of the source, by velocity, from the
        standard errors of the coefficients and the error of the form; empty if it is unknown.
    extrapolated : tuple of str
        Velocities of that replay that leave their range in the training log.
    assumed : tuple of str
        Values on the axes Z, K and M that the vehicle file does not have; the source has them too.
    wrench_gain : dict of str to float
        Gain of the wrench that the log of the fit has, by axis; empty where none is estimated.
    reservations : tuple of str
        Form of the model, what it is not for, and velocities of its training data.
    """

    target: str
    description: str
    settings: dict[str, str]
    vehicle: str
    model: str
    inputs: tuple[str, ...]
    projected: tuple[str, ...]
    about: list[float]
    ignores: str
    run_by: str
    not_run: str
    run_error: str
    wrench_error: dict[str, float]
    slow_error: dict[str, float]
    asked_at: str
    replays: Replays | None
    power: dict[str, float]
    box: str
    mass_ratio: dict[str, float]
    predicted_error: dict[str, float | None] = field(default_factory=dict)
    extrapolated: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()
    wrench_gain: dict[str, float] = field(default_factory=dict)
    reservations: tuple[str, ...] = ()

    @property
    def exact(self) -> bool:
        """Whether the target represents every term."""
        return not self.projected

    def document(self) -> dict[str, Any]:
        """Return the content of ``fidelity.json``."""
        import hydrodamp

        head = {"format": FORMAT, "version": VERSION, "hydrodamp": hydrodamp.__version__}
        return {**head, "text": str(self), "exact": self.exact, **asdict(self), "units": UNITS}

    def __str__(self) -> str:
        """Return the card, one line per message."""
        return "\n".join(_summary_lines(self))


def _summary_lines(card: Fidelity) -> Iterator[str]:
    worst, replays = max(card.wrench_error.values(), default=0.0), card.replays
    size = "exact to rounding" if worst < 100.0 * ROUNDING else f"wrench error up to {worst:.2g} %"
    if replays is not None and replays.source_to_target.diverged:
        size += ", but the replay diverges"
    if card.ignores:
        size += f", without {card.ignores}"
    ran = f"{size}; read back and run by {card.run_by}" if card.run_by else "not verified"
    yield f"Verdict: {f'failed: {card.run_error}' if card.run_error else ran}."
    yield from card.reservations
    if card.exact:
        yield f"{card.description} represents every term of {card.model}."
    else:
        labels = first_labels(card.projected)
        yield f"Projected terms: {card.description} cannot represent {labels}."
    if card.assumed:
        yield f"Assumed on Z, K and M, which are not identified: {'; '.join(card.assumed)}."
    if card.wrench_gain:
        gains = ", ".join(f"{axis} {gain:.3g}" for axis, gain in card.wrench_gain.items())
        yield f"Multiply a wrench as in the log of the fit by its gain {gains}."
    if any(card.about):
        point = " ".join(f"{x:g}" for x in card.about)
        yield f"Reference point of its coefficients: {point} m in the vehicle's frame."
    if card.not_run:
        yield f"Not run: {card.not_run}."
    source = card.asked_at if card.run_by else f"{card.asked_at}, computed and not from the files"
    if worst < 100.0 * ROUNDING:
        yield f"Wrench error at {source}: rounding only ({worst:.1g} %)."
    else:
        errors = _format_errors(card.wrench_error)
        yield f"Wrench error at {source} [% of the damping's rms]: {errors}."
    if max(card.slow_error.values(), default=0.0) >= 100.0 * ROUNDING:
        yield f"Wrench error at a tenth of these velocities: {_format_errors(card.slow_error)}."
    if card.replays is not None:
        pairs = {
            "target against source": card.replays.source_to_target,
            "source against log": card.replays.source_to_log,
            "target against log": card.replays.target_to_log,
        }
        errors = ", ".join(f"{name} {_format_score(value)}" for name, value in pairs.items())
        yield f"Replay RMS (eq. 24, attitude simulated, {card.replays.step}): {errors}."
        yield from _replay_lines(card, card.replays)
    if card.predicted_error:
        known = {name: size for name, size in card.predicted_error.items() if size is not None}
        errors = _format_errors(known) or "none, the replay diverged"
        if card.extrapolated:
            errors += f" (extrapolation in {' '.join(card.extrapolated)})"
        yield f"Predicted error of the source on this log (95 %) [m/s, deg/s]: {errors}."
    power, source_power = card.power["target"], card.power["source"]
    yield (
        f"Its damping dissipates at all velocities searched in {card.box}."
        if power <= 0.0
        else f"Its damping injects up to {power:.3g} W into the motion in {card.box}"
        f" (source: {source_power:.3g} W)."
    )
    heavy = [axis for axis, ratio in card.mass_ratio.items() if ratio > 1.0]
    if heavy:
        yield f"Added mass exceeds rigid-body mass on {' '.join(heavy)}."


def _replay_lines(card: Fidelity, replays: Replays) -> Iterator[str]:
    """Yield fit and coverage of the replay in the target, by velocity."""
    fits = [
        f"{name} {fit:.0f} %"
        + (f" ({replays.coverage[name]:.0f} % in the band)" if name in replays.coverage else "")
        for name, fit in replays.target_to_log.fit_by_axis.items()
        if fit is not None
    ]
    if fits:
        band = ", and share of the recorded samples in the 95 % band around it" * bool(
            replays.coverage
        )
        yield f"Fit of the target to this log{band}: {', '.join(fits)}."


def _format_errors(errors: dict[str, float]) -> str:
    return ", ".join(f"{axis} {error:.2g}" for axis, error in errors.items())


def _format_score(value: Score) -> str:
    if value.rms is not None:
        return f"{value.rms:.3g}"
    first = min((time for _, time in value.diverged), default=0.0)
    return f"none, diverged after {first:.1f} s" if value.diverged else "none"


def measure_fidelity(
    form: Target,
    plant: ExportedPlant,
    projected: ExportedPlant,
    at: States,
    run: VerificationRun | None,
    folder: Path,
    band: PredictionBand | None = None,
) -> Fidelity:
    """Return the card of a plant as projected for a target, whose files are in a folder.

    The band is that of the replay of the source.
    """
    name, run_error, replays = "", "", None
    target_run = None if run is None else VerificationRun.of(projected, run.log)
    states = sample_states(projected) if target_run is None else target_run.states
    slow_states, slow_at = _slow_states(states), _slow_states(at)
    try:
        with form.open_engine(folder, projected) as engine:
            acceleration, slow = engine.accelerations(states), engine.accelerations(slow_states)
            name, not_run = engine.name, engine.not_run
            if run is not None and target_run is not None:
                replays = replay_target(run, target_run, engine, band)
    except NotRun as error:
        acceleration, slow = projected.acceleration(states), projected.acceleration(slow_states)
        not_run, run_error = ("", str(error)) if isinstance(error, RunError) else (str(error), "")
    dampings = {"source": plant.damping, "target": projected.damping}
    return Fidelity(
        target=form.key,
        description=form.description,
        settings={name: str(value) for name, value in asdict(form).items()},
        vehicle=plant.vehicle.name,
        model=plant.damping.model.title,
        inputs=(*projected.inputs, "wrench"),
        projected=form.unrepresented_effects(plant),
        about=[*form.reference_point(plant)],
        ignores=form.omissions_of(plant),
        run_by=name,
        not_run=not_run,
        run_error=run_error,
        wrench_error=wrench_errors(plant, at, acceleration),
        slow_error=wrench_errors(plant, slow_at, slow),
        asked_at="velocities over the operating box" if run is None else "the log's samples",
        replays=replays,
        power={key: max_damping_power(each, plant.box).power for key, each in dampings.items()},
        box=str(plant.box),
        mass_ratio=mass_ratio(plant.vehicle),
        wrench_gain={
            axis: gain
            for axis, gain in zip(AXES, plant.wrench_gain.tolist(), strict=True)
            if gain != 1.0
        },
    )


def _slow_states(at: States) -> States:
    """Return a subset of states at a tenth of their velocities."""
    stride = max(1, len(at.velocity) // MAX_LOW_SPEED_STATES)
    subset = States(*(values[::stride] for values in at))
    return subset._replace(velocity=LOW_SPEED_RATIO * subset.velocity)


def replay_target(
    source: VerificationRun,
    target: VerificationRun,
    engine: Engine,
    band: PredictionBand | None = None,
) -> Replays:
    """Replay source and target with the commands of a log, and score both."""
    original, exported = source.simulate_source(), target.simulate_target(engine)
    step = engine.step.format(engine.max_step)
    scores = _compare(original, exported), score(original), score(exported)
    return Replays(*scores, step, _coverage(exported, band) if band is not None else {})


def _coverage(trajectory: Trajectory, band: PredictionBand) -> dict[str, float]:
    """Return the share of recorded samples in a band moved to a replay, by velocity [%]."""
    error = np.abs(trajectory.velocity - band.log.velocity)
    if trajectory.diverged or not np.isfinite(band.half_width).all():
        return {}
    inside = 100.0 * np.mean(error <= band.half_width, axis=0)
    shares = dict(zip(VELOCITIES, inside.tolist(), strict=True))
    names = (VELOCITY_OF[axis] for axis in trajectory.axes)
    return {name: shares[name] for name in names if name in band.log.velocity_names}


def _compare(reference: Trajectory, trajectory: Trajectory) -> Score:
    if diverged := (*reference.diverged, *trajectory.diverged):
        return no_score(reference.axes, "deg", diverged)
    log = replace(trajectory.log, velocity=reference.velocity, acceleration=None)
    return score(replace(trajectory, log=log))


def wrench_errors(plant: ExportedPlant, at: States, acceleration: FloatArray) -> dict[str, float]:
    """Return the wrench error of a target by axis [%].

    On an axis without damping the error is relative to the greatest rms of the damping forces, or
    of the moments.
    """
    difference = (acceleration - plant.acceleration(at)) @ plant.vehicle.mass_matrix
    damping = np.sqrt(np.mean(plant.damping_wrench(at) ** 2, axis=0))
    error = np.sqrt(np.mean(difference**2, axis=0))
    greatest = np.repeat([damping[:3].max(), damping[3:].max()], 3)
    fallback = np.where(greatest > 0.0, greatest, damping.max() or 1.0)
    percent = (100.0 * error / np.where(damping > 0.0, damping, fallback)).tolist()
    return {
        axis: value
        for axis, value, size in zip(AXES, percent, damping.tolist(), strict=True)
        if axis in plant.vehicle.axes and (size > 0.0 or value > 100.0 * ROUNDING)
    }


def first_labels(labels: Iterable[str]) -> str:
    """Return the first six labels, and the number of the others."""
    return ", ".join(first_few([*labels], 6, "coefficients"))
