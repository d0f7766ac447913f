"""What the next dive may do: bands of depth, speed and angles, limits of commands, an area."""

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

#: Lowest and highest.
Band = tuple[float, float]

Positive = Annotated[float, Field(gt=0.0)]

#: Proportional, integral and derivative gain.
Gains = tuple[float, float, float]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class CommandLimits(_Part):
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


class Area(_Part):
    """Where the vehicle may be, from where it starts [m]."""

    north: Band
    east: Band


class Loops(_Part):
    """The autopilot's gains.

    From the error of depth [m] to a pitch, or to a command where one lifts at rest; of pitch [rad]
    and of heading [rad] to a command.
    """

    depth: Gains | None = None
    pitch: Gains | None = None
    heading: Gains | None = None


class Envelope(_Part):
    """What the next dive may do, and how the vehicle is told.

    Attributes
    ----------
    depth : tuple of two floats
        Least and greatest depth of the reference point [m].
    bottom, altitude : float
        Depth of the bottom, where it is known, and how far to stay above it [m].
    pitch, roll : float
        Largest angle to either side [deg].
    speed : tuple of two floats
        Least and greatest speed ahead that is asked for [m/s].
    margin : float
        By what share of the greatest speed the vehicle may pass it.
    area : Area or None
        Where it may be; anywhere by default.
    commands : dict of str to CommandLimits
        Limits and rates of commands; those of the vehicle file where they are not given.
    steering : {"autopilot", "direct"}
        Whether setpoints of depth and heading are told, commands being added to what the
        autopilot sends, or commands alone.
    autopilot : Loops or None
        Its gains; from the vehicle's inertia and the force of its actuators by default.
    period : float
        Time from one command to the next [s].
    noise : dict of str to float
        Standard deviation of what is measured [m/s, rad/s, rad, m]; published values by default.
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
    autopilot: Loops | None = None
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
            yield "`depth` must be a band below the surface, least before greatest; " + _got(
                self.depth
            )
        elif not self.depth[0] < self.max_depth:
            yield (
                f"`bottom` at {self.bottom:g} m less `altitude` of {self.altitude:g} m leaves "
                f"nothing below the least depth of {self.depth[0]:g} m"
            )
        if not 0.0 <= self.speed[0] <= self.speed[1] or not self.speed[1] > 0.0:
            yield "`speed` must be a band of zero or more, least before greatest; " + _got(
                self.speed
            )
        bands = {} if self.area is None else {"north": self.area.north, "east": self.area.east}
        for name, band in bands.items():
            if not band[0] <= 0.0 <= band[1] or band[0] == band[1]:
                yield f"`area.{name}` must hold the start, 0, between its ends; " + _got(band)
        for name in self.noise:
            if name not in SENSOR_CHANNELS:
                yield f"`noise` is of {' '.join(SENSOR_CHANNELS)}; got '{name}'"
        if self.home is not None and not (abs(self.home[0]) <= 89.0 and abs(self.home[1]) <= 180.0):
            yield (
                "`home` must be a latitude of at most 89 deg and a longitude of at most 180 deg; "
                + _got(self.home)
            )
        if self.steering == "direct" and self.autopilot is not None:
            yield "`steering` is direct, so that `autopilot` has no use: leave one of them out"

    @property
    def max_depth(self) -> float:
        """Greatest depth, above the bottom [m]."""
        if self.bottom is None:
            return self.depth[1]
        return min(self.depth[1], self.bottom - self.altitude)

    @property
    def mid_depth(self) -> float:
        """Depth about which a dive goes [m]."""
        return 0.5 * (self.depth[0] + self.max_depth)

    @property
    def noise_std(self) -> FloatArray:
        """Standard deviation of each channel that is measured, shape (10,)."""
        known = (
            dict(zip(SENSOR_CHANNELS, np.sqrt(SENSOR_VARIANCES).tolist(), strict=True)) | self.noise
        )
        return np.array([known[name] for name in SENSOR_CHANNELS])


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
        What the file leaves out is as by default.

    Raises
    ------
    FileError
        With every fault of the file.
    """
    content = load_yaml(path)
    if not content:
        raise FileError(
            f"{path}: the envelope is empty: say at least `depth: [least, greatest]` in metres, "
            "and what else the dive may do."
        )
    return validate(Envelope, content, str(path))


def checked(envelope: Envelope, names: tuple[str, ...]) -> Envelope:
    """Refuse an envelope that limits commands the vehicle does not have."""
    strange = [name for name in envelope.commands if name not in names]
    if strange:
        told = f"`commands` has {', '.join(strange)}; the vehicle's are {' '.join(names)}"
        raise ProblemError(list_faults("envelope", [told]))
    return envelope
