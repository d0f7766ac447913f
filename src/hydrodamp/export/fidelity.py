"""The fidelity card: what was lost between a damping and what a target makes of it, measured."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.rigid_body import mass_ratio
from hydrodamp.export.target import NotRun, RunError, Target
from hydrodamp.export.verification import Engine, VerificationRun, scattered
from hydrodamp.identification.dissipativity import OperatingBox, max_damping_power
from hydrodamp.simulation.replay import Score, Trajectory, no_score, score
from hydrodamp.text import first_few

FORMAT, VERSION = "hydrodamp-fidelity", 2
UNITS = {
    "wrench_error": "% of the rms of the damping on that axis",
    "slow_error": "% of the rms of the damping on that axis, at a tenth of the velocities",
    "rms": "m/s and deg/s mixed (eq. 24)",
    "power": "W, negative where damping dissipates",
    "mass_ratio": "added mass over the rigid body's",
}

#: Relative error of a wrench that is rounding.
ROUNDING = 1e-9

SLOW, _SLOW_STATES = 0.1, 100
"""Share of the velocities at which the card asks again, near rest, and at how many of them."""


@dataclass(frozen=True)
class Replays:
    """Replays of a log, its attitude integrated too, each against another.

    Attributes
    ----------
    source_to_target : Score
        What the written file made of the log's commands, against equation 1: the error of eq. 24.
    source_to_log, target_to_log : Score
        Both against what was measured.
    step : str
        How the target was stepped.
    """

    source_to_target: Score
    source_to_log: Score
    target_to_log: Score
    step: str


@dataclass(frozen=True)
class Fidelity:
    """How faithful an export is.

    Attributes
    ----------
    target, meant : str
        Its key, and the program and version it is for.
    settings : dict of str to str
        Of the target.
    vehicle, model : str
        What was exported.
    inputs : tuple of str
        What drives the written model.
    projected : tuple of str
        Coefficients that the target cannot hold: their wrench was fitted with terms that it can.
        Empty where the export is exact.
    about : list of float
        The point that the target's coefficients are about, from the origin of the vehicle's body
        frame [m].
    ignores : str
        What of equation 1 the target leaves out.
    run_by : str
        What ran the written file; empty where nothing could.
    not_run : str
        Why it was not run.
    run_error : str
        What the compiler or interpreter that is here said where it failed on the files.
    wrench_error : dict of str to float
        By axis, RMS difference between the wrenches of source and target [% of the rms of the
        damping].
    slow_error : dict of str to float
        The same at a tenth of the velocities: how a simulation begins that starts at rest.
    asked_at : str
        At which velocities.
    replays : Replays or None
        None without a log, or where nothing could run.
    power : dict of str to float
        Greatest power that the damping of source and of target puts into the motion within
        ``box`` [W]; negative where it dissipates everywhere that was looked at.
    box : str
        The velocities, in words: those that the vehicle is used at, and down to rest.
    mass_ratio : dict of str to float
        Added mass over that of the rigid body, by axis, where both are known.
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

    @property
    def exact(self) -> bool:
        """Whether the target has every term."""
        return not self.projected

    def document(self) -> dict[str, Any]:
        """Return what ``fidelity.json`` holds."""
        import hydrodamp

        said = {"format": FORMAT, "version": VERSION, "hydrodamp": hydrodamp.__version__}
        return {**said, "text": str(self), "exact": self.exact, **asdict(self), "units": UNITS}

    def __str__(self) -> str:
        """Return the card, a line a sentence."""
        return "\n".join(_sentences(self))


def some(labels: Iterable[str]) -> str:
    """Return a few labels, and how many more there are."""
    return ", ".join(first_few([*labels], 6, "coefficients"))


def _sentences(card: Fidelity) -> Iterator[str]:
    worst = max(card.wrench_error.values(), default=0.0)
    if card.exact:
        yield f"{card.description} has every term of {card.model}."
    else:
        lost = some(card.projected)
        yield f"{card.description} cannot hold {lost}: their wrench is fitted with its own terms."
    if any(card.about):
        yield (
            f"Its coefficients are about the point {' '.join(f'{x:g}' for x in card.about)} m of "
            "the vehicle's frame: they are fitted there."
        )
    if card.run_by:
        yield f"Read back and run by {card.run_by}."
    if card.not_run:
        yield f"Not run here: {card.not_run}."
    if card.run_error:
        yield f"Failed here: {card.run_error}."
    small = worst < 100.0 * ROUNDING
    asked_at = (
        card.asked_at if card.run_by else f"{card.asked_at}, by formula and not from the files"
    )
    yield (
        f"Wrench at {asked_at}: the same but for rounding ({worst:.1g} %)."
        if small
        else f"Wrench error at {asked_at} [% of the damping's rms]: {_percent(card.wrench_error)}."
    )
    if max(card.slow_error.values(), default=0.0) >= 100.0 * ROUNDING:
        yield f"At a tenth of these velocities: {_percent(card.slow_error)}."
    if card.replays is not None:
        yield from _told(card.replays)
    target = card.power["target"]
    yield (
        f"Its damping takes power everywhere looked at in {card.box}."
        if target <= 0.0
        else f"Its damping gives up to {target:.3g} W to the motion in {card.box}"
        f" (before export {card.power['source']:.3g} W)."
    )
    heavy = [axis for axis, ratio in card.mass_ratio.items() if ratio > 1.0]
    if heavy:
        yield f"Added mass is above the rigid body's on {' '.join(heavy)}."
    if card.ignores:
        yield f"It leaves out {card.ignores}."


def _percent(errors: dict[str, float]) -> str:
    return ", ".join(f"{axis} {error:.2g}" for axis, error in errors.items())


def _told(found: Replays) -> Iterator[str]:
    errors = {
        "between source and target": found.source_to_target,
        "of the source against the log": found.source_to_log,
        "of the target against the log": found.target_to_log,
    }
    words = ", ".join(f"{name} {_error(each)}" for name, each in errors.items())
    yield f"Replay error (eq. 24, attitude simulated, {found.step}): {words}."


def _error(found: Score) -> str:
    if found.rms is not None:
        return f"{found.rms:.3g}"
    soonest = min((time for _, time in found.diverged), default=0.0)
    return f"none, diverged after {soonest:.1f} s" if found.diverged else "none"


def measured(
    form: Target,
    craft: ExportedPlant,
    held: ExportedPlant,
    at: States,
    drive: VerificationRun | None,
    made: Path,
) -> Fidelity:
    """Return the card of a craft as a target holds it, whose files are made."""
    name, failure, replays = "", "", None
    moved = None if drive is None else VerificationRun.of(held, drive.log)
    own = scattered(held) if moved is None else moved.states
    some_own, some_at = _slower(own), _slower(at)
    try:
        with form.read(made, held) as engine:
            acceleration, slow = engine.rates(own), engine.rates(some_own)
            name, reason = engine.name, engine.not_run
            if drive is not None and moved is not None:
                replays = replays_of(drive, moved, engine)
    except NotRun as why:
        acceleration, slow = held.acceleration(own), held.acceleration(some_own)
        reason, failure = ("", str(why)) if isinstance(why, RunError) else (str(why), "")
    low, high = np.minimum(craft.box.low, 0.0), np.maximum(craft.box.high, 0.0)
    box = OperatingBox(low, high)
    return Fidelity(
        target=form.key,
        description=form.description,
        settings={name: str(value) for name, value in asdict(form).items()},
        vehicle=craft.vehicle.name,
        model=craft.damping.model.title,
        inputs=(*held.inputs, "wrench"),
        projected=form.unrepresented_effects(craft),
        about=[*form.point(craft)],
        ignores=form.ignores,
        run_by=name,
        not_run=reason,
        run_error=failure,
        wrench_error=wrench_errors(craft, at, acceleration),
        slow_error=wrench_errors(craft, some_at, slow),
        asked_at="velocities all over the operating box" if drive is None else "the log's samples",
        replays=replays,
        power={
            "source": max_damping_power(craft.damping, box).power,
            "target": max_damping_power(held.damping, box).power,
        },
        box=str(box),
        mass_ratio=mass_ratio(craft.vehicle),
    )


def _slower(at: States) -> States:
    """Return some of the states at a share of their velocities."""
    step = max(1, len(at.velocity) // _SLOW_STATES)
    velocity, *others = (part[::step] for part in at)
    return States(SLOW * velocity, *others)


def replays_of(source: VerificationRun, held: VerificationRun, engine: Engine) -> Replays:
    """Run what was written with the log's commands, and score it."""
    original, made = source.source(), held.target(engine)
    step = engine.step.format(engine.longest)
    return Replays(_between(original, made), score(original), score(made), step)


def _between(first: Trajectory, second: Trajectory) -> Score:
    if first.diverged or second.diverged:
        return no_score(first.axes, "deg", (*first.diverged, *second.diverged))
    log = replace(second.log, velocity=first.velocity, acceleration=None)
    return score(replace(second, log=log))


def wrench_errors(craft: ExportedPlant, at: States, acceleration: FloatArray) -> dict[str, float]:
    """Return by axis how far the wrench of a target is from that of its source [%].

    An axis that the source does not damp counts by what damps the others: forces and moments each.
    """
    missing = (acceleration - craft.acceleration(at)) @ craft.vehicle.mass_matrix
    size = np.sqrt(np.mean(craft.damping_wrench(at) ** 2, axis=0))
    error = np.sqrt(np.mean(missing**2, axis=0))
    others = np.repeat([size[:3].max(), size[3:].max()], 3)
    unit = np.where(size > 0.0, size, np.where(others > 0.0, others, size.max() or 1.0))
    found = dict(zip(AXES, (100.0 * error / unit).tolist(), strict=True))
    return {
        axis: found[axis]
        for axis, damped in zip(AXES, (size > 0.0).tolist(), strict=True)
        if axis in craft.vehicle.axes and (damped or found[axis] > 100.0 * ROUNDING)
    }
