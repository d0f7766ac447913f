"""Steps from log to log by their names, so that a mapping file can ask for them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

from hydrodamp.conditioning.actuators import beyond_dead_zone, delayed, lagged
from hydrodamp.conditioning.current import without_current
from hydrodamp.conditioning.derived import (
    acceleration_from_accelerometer,
    rates_from_attitude,
    velocity_from_position,
)
from hydrodamp.conditioning.dropouts import mask_bottom_lock, mask_frozen
from hydrodamp.conditioning.mixing import AVL_690, ROTATION, roll_from_mixing
from hydrodamp.conditioning.spikes import LEAST_WINDOW, remove_spikes, steady_attitude
from hydrodamp.conditioning.suspicions import note_suspicions
from hydrodamp.data.log import Log
from hydrodamp.errors import did_you_mean
from hydrodamp.faults import faults_in

if TYPE_CHECKING:
    from pydantic import BaseModel

Step = Callable[[Log], Log]

#: The steps of :func:`clean`. Numbers that stand for none first: others take them for spikes.
CLEANING_STEPS: tuple[Step, ...] = (
    mask_bottom_lock,
    mask_frozen,
    steady_attitude,
    remove_spikes,
    note_suspicions,
)

_MIXINGS = {"rotation": ROTATION, "avl690": AVL_690}
# What takes a table of commands, by the name of that setting.
_BY_COMMAND = {"delayed": "seconds", "lagged": "seconds", "beyond_dead_zone": "zones"}


def clean(log: Log, steps: Sequence[Step] = CLEANING_STEPS) -> Log:
    """Clean a log, step by step.

    Parameters
    ----------
    log : Log
        Any log.
    steps : sequence of function, optional
        Each takes a log and returns a log; :func:`functools.partial` gives one other settings.

    Returns
    -------
    log : Log
        Its notes count what every step touched, channel by channel.

    Raises
    ------
    LogError
        If a step leaves nothing.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(0.0, 20.0, 0.1)
    >>> surge, rate = 1 + 0.1 * np.sin(time), 0.2 * np.cos(time)
    >>> surge[50] = 9.0
    >>> clean(Log.from_arrays(time, {"u": surge, "r": rate})).notes
    ('spikes: 1 of 200 samples of `u` (0.5 %) interpolated',)
    """
    for step in steps:
        log = step(log)
    return log


_ALL: tuple[Callable[..., Log], ...] = (
    clean,
    *CLEANING_STEPS,
    velocity_from_position,
    rates_from_attitude,
    acceleration_from_accelerometer,
    roll_from_mixing,
    without_current,
    delayed,
    lagged,
    beyond_dead_zone,
)
_FUNCTIONS = {step.__name__: step for step in _ALL}

#: The names of all steps.
STEPS = tuple(_FUNCTIONS)


def steps_of(content: object) -> tuple[tuple[Step, ...], list[str]]:
    """Return the steps that a mapping file asks for, and everything wrong with them."""
    if content is None:
        return (), []
    if not isinstance(content, list):
        return (), [f"`steps` must be a list; got {type(content).__name__}"]
    found: list[Step] = []
    faults: list[str] = []
    for given in content:
        name, settings = given, None
        if isinstance(given, dict) and len(given) == 1:
            ((name, settings),) = given.items()
        if not isinstance(name, str):
            faults.append(f"a step must be a name, or one name with its settings; got {name!r}")
        elif name not in STEPS:
            near = did_you_mean(name, STEPS)
            faults.append(f"unknown step `{name}`.{near} Steps are: {' '.join(STEPS)}")
        else:
            step, wrong = _step(name, {} if settings is None else settings)
            found += () if step is None else (step,)
            faults += wrong
    return tuple(found), faults


def _step(name: str, settings: object) -> tuple[Step | None, list[str]]:
    """Return a step with its settings checked, or what is wrong with them."""
    from pydantic import ValidationError

    if name in _BY_COMMAND and settings == {}:
        return None, [f"`{name}` needs commands and their numbers, such as {{rudder: 0.2}}"]
    form = _form(name)
    try:
        checked = form.model_validate({name: settings}).model_dump(exclude_unset=True)[name]
    except ValidationError as error:
        return None, faults_in(error, {name: settings}, form)
    if "mixing" in checked:
        checked["mixing"] = _MIXINGS[checked["mixing"]]
    given = {_BY_COMMAND[name]: checked} if name in _BY_COMMAND else checked
    return partial(_FUNCTIONS[name], **given), []


@cache
def _form(name: str) -> type[BaseModel]:
    """Return the form of a step in a file: its name, then the settings its function takes."""
    from pydantic import ConfigDict, create_model

    kinds, strict = _kinds(), ConfigDict(extra="forbid")
    if name in _BY_COMMAND:
        settings = kinds[name]
    else:
        taken = inspect.signature(_FUNCTIONS[name]).parameters
        fields: dict[str, Any] = {
            key: (kinds[key], ... if one.default is one.empty else None)
            for key, one in taken.items()
            if key in kinds
        }
        settings = create_model(name, __config__=strict, **fields)
    entry: dict[str, Any] = {name: (settings, ...)}
    return create_model("Step", __config__=strict, **entry)


@cache
def _kinds() -> Mapping[str, Any]:
    """Return the kinds of all settings that a file can hold, by their names."""
    from pydantic import AfterValidator, Field, FiniteFloat

    positive = Annotated[FiniteFloat, Field(gt=0)]
    window = Annotated[int, Field(ge=LEAST_WINDOW), AfterValidator(_odd)]
    return {
        "names": tuple[str, ...],
        "window": window,
        "threshold": positive,
        "seconds": positive,
        "flag": str,
        "fastest": positive,
        "gravity": positive,
        "lever_arm": tuple[FiniteFloat, FiniteFloat, FiniteFloat],
        "demanded": tuple[str, str],
        "fins": tuple[str, str],
        "mixing": Literal[tuple(_MIXINGS)],
        **dict.fromkeys(("delayed", "lagged"), dict[str, Annotated[FiniteFloat, Field(ge=0)]]),
        "beyond_dead_zone": dict[str, tuple[FiniteFloat, FiniteFloat]],
    }


def _odd(window: int) -> int:
    if window % 2 == 0:
        raise ValueError(f"must be odd; got {window}")
    return window
