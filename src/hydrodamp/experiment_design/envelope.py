"""The envelope of a dive: constraints on depth, speed, angles, commands and area."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import FileError, ProblemError, list_faults
from hydrodamp.faults import validate
from hydrodamp.files import load_yaml
from hydrodamp.simulation.campaign.conditions import SENSOR_CHANNELS, SENSOR_VARIANCES

Band = tuple[float, float]
"""Lowest and highest value."""

Positive = Annotated[float, Field(gt=0.0)]

NonNegative = Annotated[float, Field(ge=0.0)]

PUBLISHED_NOISE = dict(zip(SENSOR_CHANNELS, np.sqrt(SENSOR_VARIANCES).tolist(), strict=True))
"""Standard deviation of the noise of each measured channel [m/s, rad/s, rad, m]."""

MAX_NOISE_RATIO = 1e3
"""Largest noise over the published one, beyond which a sensor measures nothing; assumed."""

Gains = tuple[NonNegative, NonNegative, NonNegative]
"""Proportional, integral and derivative gain; their signs follow from the vehicle."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class CommandLimits(_Table):
    """Limits of a command, in its own unit, and its rate limit in that unit per second."""

    lowest: float | None = None
    highest: float | None = None
    rate: Positive | None = None

    @model_validator(mode="after")
    def _is_a_band(self) -> CommandLimits:
        if self.lowest is not None and self.highest is not None and self.lowest >= self.highest:
            raise ValueError(
                f"must have lowest below highest; got {self.lowest:g} and {self.highest:g}"
            )
        return self


class Area(_Table):
    """Limits of position relative to the start [m]."""

    north: Band
    east: Band


class LoopGains(_Table):
    """Gains of the autopilot, none negative.

    From the depth error [m] to a pitch setpoint, or to a command where one lifts at rest; from the
    errors of pitch and heading [rad] to a command.
    """

    depth: Gains | None = None
    pitch: Gains | None = None
    heading: Gains | None = None


class Envelope(_Table):
    """Constraints of the next dive, and how the vehicle is commanded.

    Attributes
    ----------
    depth : tuple of two floats
        Least and greatest depth of the reference point [m].
    bottom, altitude : float
        Depth of the bottom, where it is known, and least altitude above it [m].
    pitch, roll : float
        Largest absolute angle [deg].
    speed : tuple of two floats
        Least and greatest speed setpoint [m/s].
    margin : float
        Share by which the speed may exceed the greatest setpoint.
    area : Area or None
        Limits of position; none by default.
    commands : dict of str to CommandLimits
        Limits and rates of commands; those of the vehicle file by default.
    steering : {"autopilot", "direct"}
        Whether an autopilot follows setpoints of depth and heading, with excitation added to its
        commands, or commands alone are used.
    autopilot : LoopGains or None
        Its gains; by default from inertia and control effectiveness (pole placement).
    period : float
        Time from one command to the next [s].
    noise : dict of str to float
        Standard deviation of measured channels [m/s, rad/s, rad, m]; published values by default.
    home : tuple of two floats, or None
        Latitude, within 89 deg of the equator, and longitude of the start [deg], for a mission.

    Examples
    --------
    >>> Envelope(depth=(3, 20)).max_depth
    20.0
    """

    depth: Band = (2.0, 30.0)
    bottom: float | None = None
    altitude: float = Field(default=3.0, ge=0.0)
    pitch: float = Field(default=35.0, gt=0.0, lt=90.0)
    roll: float = Field(default=60.0, gt=0.0, lt=90.0)
    speed: Band = (1.0, 2.5)
    margin: Positive = 0.25
    area: Area | None = None
    commands: dict[str, CommandLimits] = Field(default_factory=dict)
    steering: Literal["autopilot", "direct"] = "autopilot"
    autopilot: LoopGains | None = None
    period: float = Field(default=0.1, ge=0.02, le=0.5)
    noise: dict[str, Annotated[float, Field(ge=0.0)]] = Field(default_factory=dict)
    home: tuple[float, float] | None = None

    @model_validator(mode="after")
    def _is_possible(self) -> Envelope:
        if faults := list(self._contradictions()):
            raise ValueError("; ".join(faults))
        return self

    def _contradictions(self) -> Iterator[str]:
        if not 0.0 <= self.depth[0] < self.depth[1]:
            yield f"`depth` must be a band below the surface, least first; {_got(self.depth)}"
        elif not self.depth[0] < self.max_depth:
            yield (
                f"`bottom` {self.bottom:g} m less `altitude` {self.altitude:g} m must be below the "
                f"least depth of {self.depth[0]:g} m"
            )
        if not 0.0 <= self.speed[0] <= self.speed[1] or not self.speed[1] > 0.0:
            yield f"`speed` must be a band of zero or more, least first; {_got(self.speed)}"
        for name, band in dict(self.area or ()).items():
            if not band[0] <= 0.0 <= band[1] or band[0] == band[1]:
                yield f"`area.{name}` must contain the start, 0; " + _got(band)
        for name, std in self.noise.items():
            if name not in SENSOR_CHANNELS:
                yield f"`noise` has the channels {' '.join(SENSOR_CHANNELS)}; got '{name}'"
            elif std > (most := MAX_NOISE_RATIO * PUBLISHED_NOISE[name]):
                yield f"`noise.{name}` must be at most {most:.3g}, in SI units; got {std:g}"
        if self.home is not None and not (abs(self.home[0]) <= 89.0 and abs(self.home[1]) <= 180.0):
            limits = "a latitude of at most 89 deg and a longitude of at most 180 deg"
            yield f"`home` must be {limits}; {_got(self.home)}"
        if self.steering == "direct" and self.autopilot is not None:
            yield "`autopilot` has no effect with direct `steering`: leave one of them out"

    @property
    def max_depth(self) -> float:
        """Greatest depth: the band's, or the bottom less the altitude [m]."""
        if self.bottom is None:
            return self.depth[1]
        return min(self.depth[1], self.bottom - self.altitude)

    @property
    def mid_depth(self) -> float:
        """Middle of the depth band [m]."""
        return 0.5 * (self.depth[0] + self.max_depth)

    @property
    def noise_std(self) -> FloatArray:
        """Standard deviation of the noise of each measured channel, shape (10,)."""
        return np.array([*(PUBLISHED_NOISE | self.noise).values()])

    def check_commands(self, names: tuple[str, ...]) -> None:
        """Refuse limits of commands that the vehicle does not have."""
        if unknown := [name for name in self.commands if name not in names]:
            fault = f"`commands` has {', '.join(unknown)}; the vehicle's are {' '.join(names)}"
            raise ProblemError(list_faults("envelope", [fault]))


def _got(band: tuple[float, float]) -> str:
    return f"got {band[0]:g} and {band[1]:g}"


def read_envelope(path: str | os.PathLike[str]) -> Envelope:
    """Read an envelope from a YAML file.

    Parameters
    ----------
    path : str or path
        A table with the attributes of :class:`Envelope` as keys.

    Returns
    -------
    envelope : Envelope
        With defaults for missing keys.

    Raises
    ------
    FileError
        With every fault of the file.
    """
    content = load_yaml(path)
    if not content:
        raise FileError(
            f"{path}: the envelope is empty: state at least `depth: [least, greatest]` in metres."
        )
    return validate(Envelope, content, str(path))
