"""A mapping as a value: from a recording to a log."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hydrodamp.conditioning.steps import Step, prepared, steps_of
from hydrodamp.data.log import Log
from hydrodamp.data.record import Record
from hydrodamp.data.recording import Recording
from hydrodamp.errors import LogError
from hydrodamp.ingest.mapping.aliases import Topics
from hydrodamp.ingest.mapping.composition import composed, load
from hydrodamp.ingest.mapping.entries import Entry, entries_of
from hydrodamp.ingest.mapping.frames import Mounting

if TYPE_CHECKING:
    from hydrodamp.ingest.mapping.schema import MappingForm, SensorForm

_WORLD = {"FRD": "NED", "FLU": "NWU"}


@dataclass(frozen=True)
class LogMapping:
    """Which field of a recording becomes which channel of a log, and how.

    Attributes
    ----------
    entries : tuple of Entry
        One for every channel.
    frame : str
        Axes of the log: ``FRD`` (body forward-starboard-down) or ``FLU`` (body
        forward-port-up).
    world : str
        What attitude is counted from: ``NED``; ``NWU``, z up and heading counted from x towards
        y; or ``ENU``.
    segment : str or None
        The column that names the segments.
    topic : str or None
        The topic whose clock is followed; None for the fastest that holds a velocity.
    rate : float or None
        Samples a second instead of that topic's own [Hz].
    topics : tuple of (str, tuple of str)
        Names used here, and the topics that each may stand for.
    sensors : tuple of (str, Mounting)
        How the sensors behind the groups sit in the vehicle.
    source : str
        The mapping's file.
    steps : tuple of Step
        What is done to the log once it is on one clock.
    """

    entries: tuple[Entry, ...]
    frame: str = "FRD"
    world: str = "NED"
    segment: str | None = None
    topic: str | None = None
    rate: float | None = None
    topics: Topics = ()
    sensors: tuple[tuple[str, Mounting], ...] = ()
    source: str = ""
    steps: tuple[Step, ...] = ()

    @classmethod
    def from_dict(cls, content: object, source: str = "mapping") -> LogMapping:
        """Return the mapping that the content of a YAML file describes.

        Parameters
        ----------
        content : dict
            As in the docstring of :mod:`hydrodamp.ingest.mapping`.
        source : str, optional
            How messages call it; a path, so that files it extends are found beside it.

        Returns
        -------
        mapping : LogMapping
            Checked.

        Raises
        ------
        LogError
            With every unknown key, unit, sign and frame.
        FileError
            If a file it extends cannot be read.

        Examples
        --------
        >>> mapping = LogMapping.from_dict({"time": "t", "velocity": {"u": "speed"}})
        >>> [entry.column for entry in mapping.entries]
        ['t', 'speed']
        """
        from pydantic import ValidationError

        from hydrodamp.ingest.mapping.faults import called, form_faults
        from hydrodamp.ingest.mapping.schema import MappingForm
        from hydrodamp.ingest.mapping.sense import sense_faults

        if not isinstance(content, dict):
            fault = f"a mapping must be a table of names to columns; got {called(content)}"
            raise LogError(fault, source=source)
        whole = composed(content, Path(source))
        steps, wrong = steps_of(whole.get("steps"))
        faults = [*sense_faults(whole), *wrong]
        try:
            form = MappingForm.model_validate(whole)
        except ValidationError as error:
            raise LogError([*form_faults(error), *faults], source=source) from error
        if faults:
            raise LogError(faults, source=source)
        return replace(cls._of(form, source), steps=steps)

    @classmethod
    def _of(cls, form: MappingForm, source: str) -> LogMapping:
        sensors = dict(form.sensors or {})
        attitude = sensors.get("attitude")
        axes = (attitude.axes if attitude else None) or form.frame
        clock = form.clock
        return cls(
            entries_of(form),
            form.frame,
            form.world or _WORLD[axes],
            form.segment,
            clock if isinstance(clock, str) or clock is None else clock.topic,
            None if isinstance(clock, str) or clock is None else clock.rate,
            tuple(
                (name, (given,) if isinstance(given, str) else tuple(given))
                for name, given in form.topics.items()
            ),
            tuple((name, _mounting(one, form.frame)) for name, one in sensors.items() if one),
            source,
        )

    @property
    def commands(self) -> tuple[str, ...]:
        """The names of the commands."""
        return tuple(entry.name for entry in self.entries if entry.is_command)

    def mounting(self, group: str) -> Mounting:
        """Return how the sensor behind a group sits in the vehicle.

        Parameters
        ----------
        group : str
            ``velocity``, ``rates``, ``attitude`` or ``accelerometer``.

        Returns
        -------
        mounting : Mounting
            At the reference point and along the body's axes where the mapping says nothing.
        """
        return dict(self.sensors).get(group, Mounting(self.frame))

    def read(self, path: str | Path) -> Log:
        """Read a log through this mapping.

        Parameters
        ----------
        path : str or Path
            A file or folder of any format that can be read.

        Returns
        -------
        log : Log
            In SI units, forward-starboard-down and north-east-down.

        Raises
        ------
        FileError
            If the file cannot be opened.
        LogError
            With every fault of the file, columns that are absent included.

        Warns
        -----
        GapWarning
            Once, if a gap or missing values split the log.
        ClockWarning
            Once, if a clock repeats, runs backwards or leaps.
        """
        from hydrodamp.ingest.formats.files import read

        return self.log(read(path))

    def log(self, recording: Recording) -> Log:
        """Return the log of a recording.

        Parameters
        ----------
        recording : Recording
            What was read.

        Returns
        -------
        log : Log
            On one clock, in SI units, forward-starboard-down and north-east-down; its notes
            tell what the steps of the mapping did.

        Raises
        ------
        LogError
            With every fault, or what a step lacks.

        Warns
        -----
        GapWarning
            Once, if a gap or missing values split the log.
        ClockWarning
            Once, if a clock repeats, runs backwards or leaps.

        Examples
        --------
        >>> from hydrodamp.data.recording import Topic
        >>> dvl = Topic("dvl", [0.0, 1.0, 2.0], {"vx": [1.0, 1.5, 2.0]})
        >>> fin = Topic("fin", [-0.5, 0.5, 1.5], {"angle": [1.0, 2.0, 3.0]})
        >>> mapping = LogMapping.from_dict(
        ...     {
        ...         "time": "recorded",
        ...         "velocity": {"u": "dvl.vx"},
        ...         "commands": {"rudder": "fin.angle"},
        ...     }
        ... )
        >>> log = mapping.log(Recording((dvl, fin), "dive", "example"))
        >>> log.command("rudder").tolist()
        [1.0, 2.0, 3.0]
        """
        return prepared(Log.from_record(self.record(recording)), self.steps)

    def record(self, recording: Recording) -> Record:
        """Return the record of a recording: one clock, our axes, NaN where nothing is known.

        Parameters
        ----------
        recording : Recording
            What was read.

        Returns
        -------
        record : Record
            Not yet cut; without velocities where the mapping has a position alone.

        Raises
        ------
        LogError
            With every fault.

        Warns
        -----
        ClockWarning
            Once, if a clock repeats, runs backwards or leaps.
        """
        from hydrodamp.ingest.mapping.joining import record_of

        return record_of(self, recording)


def read_mapping(path: str | Path) -> LogMapping:
    """Read a mapping from its YAML file, or a preset by its name.

    Parameters
    ----------
    path : str or Path
        The file, or the name of a preset.

    Returns
    -------
    mapping : LogMapping
        Checked.

    Raises
    ------
    FileError
        If the file cannot be read, or is no YAML: with the line.
    LogError
        With everything wrong in it.

    Examples
    --------
    >>> read_mapping("rep103-odometry").world
    'ENU'
    """
    content, _ = load(path)
    return LogMapping.from_dict(content, str(path))


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a mapping file, for editors that check and complete.

    Returns
    -------
    schema : dict
        Draft 2020-12.

    Examples
    --------
    >>> sorted(json_schema()["properties"])[:3]
    ['acceleration', 'accelerometer', 'attitude']
    """
    from hydrodamp.ingest.mapping.schema import schema

    return schema()


def _mounting(form: SensorForm, frame: str) -> Mounting:
    """Return the mounting that a mapping describes in its own axes."""
    turn = form.rotation
    scale = math.pi / 180 if turn and turn.unit == "deg" else 1.0
    sign = -1.0 if frame == "FLU" else 1.0
    angles = (turn.roll, sign * turn.pitch, sign * turn.yaw) if turn else (0.0, 0.0, 0.0)
    x, y, z = form.position or (0.0, 0.0, 0.0)
    roll, pitch, yaw = (scale * angle for angle in angles)
    return Mounting(form.axes or frame, (roll, pitch, yaw), (x, sign * y, sign * z))
