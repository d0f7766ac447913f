"""The cleaning pipeline, and the named steps of a mapping file."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from functools import partial
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, create_model

from hydrodamp.conditioning.actuator_response import (
    apply_dead_zone,
    apply_delay,
    apply_first_order_lag,
)
from hydrodamp.conditioning.current import subtract_current
from hydrodamp.conditioning.derivatives import (
    acceleration_from_accelerometer,
    rates_from_attitude,
    velocity_from_position,
)
from hydrodamp.conditioning.dropouts import (
    interpolate_sample_and_hold,
    mask_dvl_dropouts,
    mask_frozen,
    mask_mocap_dropouts,
)
from hydrodamp.conditioning.interpolation import Interpolation, set_interpolation
from hydrodamp.conditioning.outliers import remove_attitude_outliers, remove_outliers
from hydrodamp.conditioning.quality_checks import annotate_quality
from hydrodamp.data.log import Log
from hydrodamp.errors import did_you_mean
from hydrodamp.faults import faults_in

Step = Callable[[Log], Log]

#: The steps of :func:`clean`. Invalid numbers first, or later steps see them as outliers.
CLEANING_STEPS: tuple[Step, ...] = (
    mask_dvl_dropouts,
    mask_mocap_dropouts,
    mask_frozen,
    remove_attitude_outliers,
    remove_outliers,
    annotate_quality,
)


_STRICT = ConfigDict(extra="forbid")
_PositiveNumber = Annotated[FiniteFloat, Field(gt=0)]
_CommandTimes = dict[str, Annotated[FiniteFloat, Field(ge=0)]]

# Types of settings by name; of steps that take a table of commands, by the name of the step.
_SETTING_TYPES: dict[str, Any] = {
    "names": tuple[str, ...],
    **dict.fromkeys(("threshold", "seconds"), _PositiveNumber),
    "flag": str,
    **dict.fromkeys(("wrench", "commands"), Interpolation),
    "lever_arm": tuple[FiniteFloat, FiniteFloat, FiniteFloat],
    **dict.fromkeys(("apply_delay", "apply_first_order_lag"), _CommandTimes),
    "apply_dead_zone": dict[str, tuple[FiniteFloat, FiniteFloat]],
}


def clean(log: Log, steps: Sequence[Step] = CLEANING_STEPS) -> Log:
    """Clean a log by a sequence of steps.

    Parameters
    ----------
    log : Log
        Any log.
    steps : sequence of function, optional
        Functions from log to log; set options by :func:`functools.partial`.

    Returns
    -------
    log : Log
        Its notes count the changed samples of every step and channel.

    Raises
    ------
    LogError
        If no sample remains.

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


_STEP_FUNCTIONS: tuple[Callable[..., Log], ...] = (
    clean,
    *CLEANING_STEPS,
    interpolate_sample_and_hold,
    velocity_from_position,
    rates_from_attitude,
    acceleration_from_accelerometer,
    subtract_current,
    apply_delay,
    apply_first_order_lag,
    apply_dead_zone,
    set_interpolation,
)
_FUNCTIONS = {step.__name__: step for step in _STEP_FUNCTIONS}

#: Names of all steps.
STEPS = tuple(_FUNCTIONS)


def parse_steps(content: Sequence[object]) -> tuple[tuple[Step, ...], list[str]]:
    """Return the steps that a mapping file names, and the faults of their settings."""
    steps: list[Step] = []
    faults: list[str] = []
    for item in content:
        name, settings = item, None
        if isinstance(item, dict) and len(item) == 1:
            ((name, settings),) = item.items()
        if not isinstance(name, str):
            faults.append(f"a step must be a name, or one name with its settings; got {name!r}")
        elif name not in STEPS:
            near = did_you_mean(name, STEPS)
            faults.append(f"unknown step `{name}`.{near} Steps are: {' '.join(STEPS)}")
        else:
            step, step_faults = _parse_step(name, {} if settings is None else settings)
            steps += () if step is None else (step,)
            faults += step_faults
    return tuple(steps), faults


def _parse_step(name: str, settings: object) -> tuple[Step | None, list[str]]:
    """Return a step with checked settings, or the faults."""
    function, by_command = _FUNCTIONS[name], name in _SETTING_TYPES
    if by_command and settings == {}:
        return None, [f"`{name}` needs commands and their numbers, such as {{rudder: 0.2}}"]
    kind = _SETTING_TYPES[name] if by_command else _settings_model(name)
    entry: dict[str, Any] = {name: (kind, ...)}
    form = create_model("Step", __config__=_STRICT, **entry)
    try:
        checked = form.model_validate({name: settings}).model_dump(exclude_unset=True)[name]
    except ValidationError as error:
        return None, faults_in(error, {name: settings}, form)
    if by_command:
        return lambda log: function(log, checked), []
    return partial(function, **checked), []


def _settings_model(name: str) -> type[BaseModel]:
    """Return the pydantic model of the settings of a step."""
    parameters = inspect.signature(_FUNCTIONS[name]).parameters
    fields: dict[str, Any] = {
        key: (_SETTING_TYPES[key], ... if parameter.default is parameter.empty else None)
        for key, parameter in parameters.items()
        if key in _SETTING_TYPES
    }
    return create_model(name, __config__=_STRICT, **fields)
