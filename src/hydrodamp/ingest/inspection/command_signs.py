"""Signs of the effects of commands that their names, the geometry or the order in time contradict.

The accelerations of surge and yaw are regressed on the state and all commands, each shifted by its
delay, over five blocks of the log; an effect is significant if its mean over the blocks exceeds
four standard errors.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.conditioning.consistency import Fix, QualityIssue
from hydrodamp.data.log import Log
from hydrodamp.ingest.inspection.delay import (
    Delay,
    resample,
    state_regressors,
)
from hydrodamp.ingest.inspection.names import WORDS, words

#: Signs of the effect on a velocity, by command and velocity.
Signs = Mapping[tuple[str, str], int]

_MIN_LEAD_SHARE = 0.1  # of the acceleration, from which a lead of the response counts
_MIN_RELATIVE_LEAD, MIN_LEAD_STEPS = 0.05, 2.0  # shortest, over the time scale, and in steps
MIN_LEAD_CONFIDENCE = 40  # %, the limit of a response before its command
_N_BLOCKS = 5
_MIN_SIGNIFICANCE = 4.0  # standard errors over the blocks
_SIDES = {**dict.fromkeys(("left", "port"), 1), **dict.fromkeys(("right", "starboard", "stbd"), -1)}
_AXIS_WORDS = {
    **dict.fromkeys(("surge", "forward", "fwd"), "u"),
    **dict.fromkeys(("sway", "lateral"), "v"),
    **dict.fromkeys(("heave", "vertical"), "w"),
    "yaw": "r",
}


def check_commands(
    log: Log, delays: Sequence[Delay], expected: Signs | None = None
) -> Iterator[QualityIssue]:
    """Yield the issues of the wrench and the commands: axes, signs and order in time."""
    yield from reversed_wrench(delays)
    yield from contradicted_signs(log, delays, expected)
    yield from leading_responses(log, delays)


def reversed_wrench(delays: Sequence[Delay]) -> Iterator[QualityIssue]:
    """Yield axes of a recorded wrench that accelerate the vehicle against their sign."""
    against = {
        delay.command: f"{delay.velocity} decreases when {delay.command} increases"
        for delay in delays
        if VELOCITY_OF.get(delay.command) == delay.velocity and delay.sign < 0 and delay.is_known
    }
    if against:
        evidence, fix = ", ".join(against.values()), Fix("sign", "-1")
        yield QualityIssue(" ".join(against), "acts against its sign", evidence, fix=fix)


def leading_responses(log: Log, delays: Sequence[Delay]) -> Iterator[QualityIssue]:
    """Yield the commands that the motion precedes, if it precedes every one that has an effect."""
    effective = [each for each in delays if each.share >= _MIN_LEAD_SHARE]
    shortest = max(
        MIN_LEAD_STEPS * float(np.median(log.steps)), _MIN_RELATIVE_LEAD * log.time_scale
    )
    leading = [
        each
        for each in effective
        if each.seconds < -shortest and each.confidence >= MIN_LEAD_CONFIDENCE
    ]
    if not leading or len(leading) < len(effective):
        return
    lead = -float(np.median([each.seconds for each in leading]))
    names = [each.command for each in leading]
    group = "wrench" if all(name in AXES for name in names) else "commands"
    yield QualityIssue(
        " ".join(names),
        "follows the motion: clock offset, or a command that a controller derives from the motion",
        f"the response comes {lead:.2g} s before the command",
        fix=Fix("delay", f"{lead:.2g}"),
        remedy=f"for a clock offset, add `delay: {lead:.2g}` to its column under `{group}` in the "
        "mapping",
    )


def contradicted_signs(
    log: Log, delays: Iterable[Delay], expected: Signs | None = None
) -> Iterator[QualityIssue]:
    """Yield thrusters that turn or push the vehicle against their geometry, or else their names."""
    by_command = {each.command: each for each in delays if each.command in log.command_names}
    from_geometry = {} if expected is None else dict(expected)
    signs = from_geometry or signs_by_side(by_command)
    axis_of = {name: axis for name in by_command if (axis := _named_axis(name))}
    if not by_command or not (signs or axis_of):
        return
    effects = estimate_effects(log, [*by_command.values()])
    basis = "its position and direction" if from_geometry else "its name"
    against = {
        key: effects[key]
        for key, sign in signs.items()
        if sign * effects.get(key, 0.0) < -_MIN_SIGNIFICANCE
    }
    for name in dict.fromkeys(name for name, _ in against):
        yield _contradiction(name, against, signs, effects, basis)
    for name, axis in axis_of.items():
        moved, response = by_command[name], abs(effects.get((name, axis), np.inf))
        if moved.is_known and moved.velocity != axis and response < _MIN_SIGNIFICANCE / 2.0:
            yield QualityIssue(
                name,
                f"moves {moved.velocity}, which contradicts its name",
                f"it explains {moved.share:.0%} of the acceleration of {moved.velocity}, and "
                f"{axis} does not respond ({response:.1f} standard errors)",
                remedy="correct its name or its column under `commands` in the mapping",
            )


def _contradiction(
    name: str,
    against: Signs | dict[tuple[str, str], float],
    signs: Signs,
    effects: Mapping[tuple[str, str], float],
    basis: str,
) -> QualityIssue:
    """Return the issue of one command, with the remedy that its other effects suggest."""
    turns, surges = (name, "r") in against, (name, "u") in against
    partners = {key[0] for key in against if key[1] == "r"} - {name}
    remedy = f"write `sign: -1` for `{name}` under `commands` in the mapping"
    fix: Fix | None = Fix("sign", "-1")
    if turns and surges:
        problem = "acts with the opposite sign"
    elif surges:
        problem = "slows the vehicle when it increases"
    else:
        to = "starboard" if effects[name, "r"] > 0.0 else "port"
        problem = f"turns the vehicle to {to}: labels swapped, or sign of the command or of r"
        if partners:
            exchange = f"exchange the columns of `{name}` and `{min(partners)}` in the mapping"
            remedy, fix = f"{exchange}, or check the axes (`frame`)", None
        elif effects.get((name, "u"), 0.0) >= _MIN_SIGNIFICANCE:
            remedy, fix = "check which side it is on", None
    evidence = ", ".join(
        f"{velocity} {'increases' if effects[key] > 0.0 else 'decreases'} with it by "
        f"{abs(effects[key]):.0f} standard errors, against {basis}"
        for key in against
        if (velocity := key[1]) and key[0] == name
    )
    return QualityIssue(name, problem, evidence, remedy=remedy, fix=fix)


def signs_by_side(names: Iterable[str]) -> dict[tuple[str, str], int]:
    """Return the signs of thrusters named by their side that push ahead, where both sides exist."""
    sides: dict[str, int] = {}
    for name in names:
        name_words = {word.rstrip("0123456789") for word in words(name)}
        side = {_SIDES[word] for word in name_words & _SIDES.keys()}
        is_thruster = name_words & WORDS["thruster"] or name_words <= _SIDES.keys()
        if len(side) == 1 and is_thruster and not name_words & WORDS["not_along"]:
            sides[name] = side.pop()
    if {*sides.values()} != {1, -1}:
        return {}
    ahead = {(name, "u"): 1 for name in sides}
    return ahead | {(name, "r"): side for name, side in sides.items()}


def _named_axis(name: str) -> str:
    """Return the velocity that the name of a command states, empty for none."""
    axes = {_AXIS_WORDS[word] for word in {*words(name)} & _AXIS_WORDS.keys()}
    return axes.pop() if len(axes) == 1 else ""


def estimate_effects(log: Log, delays: Sequence[Delay]) -> dict[tuple[str, str], float]:
    """Return the effect of each command on each velocity, in standard errors over blocks."""
    inputs = np.column_stack([log.command(each.command) for each in delays])
    step, state, commands = resample(log, inputs)
    velocity, down = state[:, :6], state[:, 6:]
    axes = [VELOCITIES.index(name) for name in log.velocity_names]
    for column, delay in enumerate(delays):
        commands[:, column] = _shift(commands[:, column], round(delay.seconds / step))
    acceleration = np.diff(velocity[:, axes], axis=0, append=np.nan) / step
    regressors = np.column_stack((state_regressors(velocity, axes), down, commands))
    valid = np.isfinite(np.column_stack((acceleration, regressors))).all(axis=1)
    rows = np.flatnonzero(valid)
    n = len(delays)
    if len(rows) < _N_BLOCKS * 2 * regressors.shape[1]:
        return {}
    estimates = [
        np.linalg.lstsq(regressors[block], acceleration[block])[0][-n:]
        for block in np.array_split(rows, _N_BLOCKS)
    ]
    values = np.array(estimates)  # (blocks, commands, axes)
    errors = values.std(axis=0, ddof=1) / np.sqrt(_N_BLOCKS)
    significance = values.mean(axis=0) / np.maximum(errors, np.finfo(float).tiny)
    return {
        (delay.command, VELOCITIES[axis]): float(significance[i, j])
        for i, delay in enumerate(delays)
        for j, axis in enumerate(axes)
    }


def _shift(values: FloatArray, lag: int) -> FloatArray:
    """Return the values later by a lag, NaN where there are none."""
    shifted = np.full_like(values, np.nan)
    n = len(values)
    shifted[max(lag, 0) : n + min(lag, 0)] = values[max(-lag, 0) : n - max(lag, 0)]
    return shifted
