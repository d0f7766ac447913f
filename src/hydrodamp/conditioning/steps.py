"""Steps from log to log by their names, so that a mapping file can ask for them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from hydrodamp.advance import shares, within
from hydrodamp.conditioning.accelerometer import acceleration_from_accelerometer
from hydrodamp.conditioning.attitude_jumps import steady_attitude
from hydrodamp.conditioning.bottom_lock import mask_bottom_lock
from hydrodamp.conditioning.clean import clean
from hydrodamp.conditioning.frozen import mask_frozen
from hydrodamp.conditioning.mixing import AVL_690, ROTATION, Mixing, roll_from_mixing
from hydrodamp.conditioning.rates import rates_from_attitude
from hydrodamp.conditioning.response import beyond_dead_zone, delayed, lagged
from hydrodamp.conditioning.spikes import remove_spikes
from hydrodamp.conditioning.suspicions import note_suspicions
from hydrodamp.conditioning.through_water import without_current
from hydrodamp.conditioning.touched import Cleaned
from hydrodamp.conditioning.ways import velocity_from_position
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError, did_you_mean

Function = Callable[..., Log | Cleaned]

_BY_COMMAND: dict[str, Function] = {
    "delayed": delayed,
    "lagged": lagged,
    "beyond_dead_zone": beyond_dead_zone,
}
"""These take a table of commands."""

_OWN: dict[str, Function] = {
    one.__name__: one
    for one in (
        clean,
        mask_bottom_lock,
        mask_frozen,
        steady_attitude,
        remove_spikes,
        note_suspicions,
        velocity_from_position,
        rates_from_attitude,
        acceleration_from_accelerometer,
        roll_from_mixing,
        without_current,
    )
}

STEPS: tuple[str, ...] = (*_OWN, *_BY_COMMAND)
"""The names of all steps."""

_MIXINGS: dict[str, Mixing] = {"rotation": ROTATION, "avl690": AVL_690}
_NOT_SAID = ("steps", "current")  # values that a file cannot hold


@dataclass(frozen=True)
class Step:
    """A step and its settings."""

    name: str
    settings: tuple[tuple[str, Any], ...] = ()

    def __call__(self, log: Log) -> Log:
        """Return what the step makes of a log."""
        given = dict(self.settings)
        try:
            if self.name in _BY_COMMAND:
                done = _BY_COMMAND[self.name](log, given)
            else:
                done = _OWN[self.name](log, **_valued(given))
        except TypeError as error:
            raise LogError(f"step `{self.name}`: {error}", source=log.source) from error
        return done.log if isinstance(done, Cleaned) else done


def prepared(log: Log, steps: tuple[Step, ...]) -> Log:
    """Return a log after some steps."""
    for step, share in zip(steps, shares([1.0] * len(steps)), strict=True):
        with within(*share):
            log = step(log)
    return log


def steps_of(content: object) -> tuple[tuple[Step, ...], list[str]]:
    """Return the steps that a mapping file asks for, and everything wrong with them."""
    if content is None:
        return (), []
    if not isinstance(content, list):
        return (), [f"`steps` must be a list; got {type(content).__name__}"]
    found: list[Step] = []
    faults: list[str] = []
    for given in content:
        name, settings = _parts(given)
        wrong = [*_faults(name, settings)]
        faults += wrong
        if not wrong and isinstance(settings, dict):
            found.append(Step(str(name), tuple(settings.items())))
    return tuple(found), faults


def _parts(given: object) -> tuple[object, object]:
    if isinstance(given, dict) and len(given) == 1:
        ((name, settings),) = given.items()
        return name, {} if settings is None else settings
    return given, {}


def _faults(name: object, settings: object) -> Iterator[str]:
    if not isinstance(name, str):
        yield f"a step must be a name, or one name with its settings; got {name!r}"
        return
    if name not in STEPS:
        near = did_you_mean(name, STEPS)
        yield f"unknown step `{name}`.{near} Steps are: {' '.join(STEPS)}"
        return
    if not isinstance(settings, dict):
        yield f"the settings of `{name}` must be a table; got {settings!r}"
    elif name in _BY_COMMAND:
        if not settings:
            yield f"`{name}` needs commands and their numbers, such as {{rudder: 0.2}}"
    else:
        known = [key for key in inspect.signature(_OWN[name]).parameters if key not in _NOT_SAID]
        for key in settings:
            if key not in known[1:]:
                takes = " ".join(known[1:]) or "no settings"
                yield f"step `{name}` has no `{key}`.{did_you_mean(key, known)} It takes: {takes}"


def _valued(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with a mixing by its name as a value."""
    mixing = settings.get("mixing")
    if mixing is None:
        return dict(settings)
    if mixing not in _MIXINGS:
        raise LogError(f"unknown mixing {mixing!r}. Known: {' '.join(_MIXINGS)}")
    return {**settings, "mixing": _MIXINGS[mixing]}
