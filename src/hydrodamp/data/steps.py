"""Steps from log to log by their names, so that a mapping file can ask for them.

::

    steps:                       # in this order, after the log is on one clock
      - clean                    # all cleaning steps; or mask_frozen, remove_spikes …
      - rates_from_attitude
      - lagged: {rudder: 0.2}    # a command and its number, or a step's own settings
      - remove_spikes: {threshold: 8}
      - without_current
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from hydrodamp.advance import shares, within
from hydrodamp.data.cleaning.attitude_jumps import steady_attitude
from hydrodamp.data.cleaning.bottom_lock import mask_bottom_lock
from hydrodamp.data.cleaning.clean import clean
from hydrodamp.data.cleaning.frozen import mask_frozen
from hydrodamp.data.cleaning.spikes import remove_spikes
from hydrodamp.data.cleaning.suspicions import note_suspicions
from hydrodamp.data.cleaning.touched import Cleaned
from hydrodamp.data.completing.accelerometer import acceleration_from_accelerometer
from hydrodamp.data.completing.mixing import AVL_690, ROTATION, Mixing, roll_from_mixing
from hydrodamp.data.completing.rates import rates_from_attitude
from hydrodamp.data.completing.response import beyond_dead_zone, delayed, lagged
from hydrodamp.data.completing.through_water import without_current
from hydrodamp.data.completing.ways import velocity_from_position
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
    """A step and its settings.

    Attributes
    ----------
    name : str
        One of :data:`STEPS`.
    settings : tuple of (str, object)
        Commands or keywords, with their values.

    Examples
    --------
    >>> Step("lagged", (("rudder", 0.2),))
    Step(name='lagged', settings=(('rudder', 0.2),))
    """

    name: str
    settings: tuple[tuple[str, Any], ...] = ()

    def __call__(self, log: Log) -> Log:
        """Return what the step makes of a log.

        Raises
        ------
        LogError
            If the log lacks what the step needs, or a setting is no value for it.
        """
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
    """Return a log after some steps.

    Parameters
    ----------
    log : Log
        As it was read.
    steps : tuple of Step
        In their order.

    Returns
    -------
    log : Log
        Its notes tell what the steps did.

    Raises
    ------
    LogError
        If the log lacks what a step needs.
    """
    for step, share in zip(steps, shares([1.0] * len(steps)), strict=True):
        with within(*share):
            log = step(log)
    return log


def steps_of(content: object) -> tuple[tuple[Step, ...], list[str]]:
    """Return the steps that a mapping file asks for, and everything wrong with them.

    Parameters
    ----------
    content : object
        A list of names, and of tables of one name with its settings; None for no steps.

    Returns
    -------
    steps : tuple of Step
        Those that could be understood.
    faults : list of str
        One sentence each.

    Examples
    --------
    >>> steps_of(["clean", {"lagged": {"rudder": 0.2}}])[0][1].name
    'lagged'
    >>> steps_of(["polish"])[1][0].split(".")[0]
    'unknown step `polish`'
    """
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
