"""A mapping as a value: from a recording to a log."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hydrodamp.conditioning.steps import prepared
from hydrodamp.data.log import Log
from hydrodamp.data.record import Record
from hydrodamp.data.recording import Recording
from hydrodamp.errors import LogError
from hydrodamp.faults import faults_in
from hydrodamp.ingest.mapping.assembling import record_of
from hydrodamp.ingest.mapping.composition import composed, load
from hydrodamp.ingest.mapping.contradictions import axes_of_attitude, contradictions
from hydrodamp.ingest.mapping.schema import MappingFile

_WORLD = {"FRD": "NED", "FLU": "NWU"}
_SAID = {
    "frame": "`frame` must be FRD (z down) or FLU (z up); got {given!r}",
    "segment": "`segment` must be the name of a column; got {given!r}",
    "world": "`world` must be NED, NWU or ENU; got {given!r}",
}


class LogMapping(MappingFile):
    """Which field of a recording becomes which channel of a log, and how.

    Its attributes are the keys of a mapping file, with everything that it extends filled in.

    Attributes
    ----------
    name : str
        What messages call it: its file, or the name of the preset.
    frame : str
        Axes of the log: ``FRD`` (body forward-starboard-down) or ``FLU`` (body
        forward-port-up).
    world : str
        What attitude is counted from: ``NED``; ``NWU``, z up and heading counted from x towards
        y; or ``ENU``.
    segment : str or None
        The column that names the segments.
    topics : dict of str to tuple of str
        Names used here, and the topics that each may stand for.
    steps : tuple of Step
        What is done to the log once it is on one clock.
    """

    @classmethod
    def from_dict(cls, content: object, source: str = "mapping") -> LogMapping:
        """Return the mapping that the content of a YAML file describes.

        Parameters
        ----------
        content : dict
            As the mapping file holds it.
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
        if not isinstance(content, dict):
            got = "nothing" if content is None else type(content).__name__
            raise LogError(
                f"a mapping must be a table of names to columns; got {got}", source=source
            )
        whole = composed(content, Path(source))
        wrong = [*contradictions(whole)]
        world = _WORLD.get(axes_of_attitude(whole), "NED")
        try:
            mapping = cls.model_validate({"world": world, **whole})
        except ValidationError as error:
            faults = [*faults_in(error, whole, cls, _SAID), *wrong]
            raise LogError(faults, source=source) from error
        if wrong:
            raise LogError(wrong, source=source)
        mapping._name = source
        return mapping

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
    ['acceleration', 'attitude', 'clock']
    """
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **MappingFile.model_json_schema(),
        "title": "hydrodamp mapping file",
    }
