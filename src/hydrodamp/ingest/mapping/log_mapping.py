"""A mapping as a value, read from a file, a preset, or several that extend one another."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.conditioning.pipeline import clean
from hydrodamp.data.channels import ATTITUDE, EULER, SPECIFIC_FORCE
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording
from hydrodamp.errors import LogError, did_you_mean
from hydrodamp.faults import faults_in
from hydrodamp.files import PackageData, load_yaml, nearest_file, wrong_kind_message
from hydrodamp.ingest.mapping.assemble import record_of
from hydrodamp.ingest.mapping.schema import COMPASS, MappingFile, by_name

_WORLDS = {"FRD": ("NED",), "FLU": ("NWU", "ENU")}
_LINEAR, _ANGULAR = VELOCITIES[:3], VELOCITIES[3:]


def contradictions(content: Mapping[Any, Any]) -> Iterator[str]:
    """Yield what is missing from a mapping or contradicts itself, a sentence each."""
    if set(content) == {"steps"}:
        return  # for a table in the canonical form
    attitude, velocity = _table(content, "attitude"), _table(content, "velocity")
    if content.get("time") is None:
        yield (
            "`time` must name the column of the clock; it is missing. Where topics have a clock of"
            " their own, `time: recorded` takes it"
        )
    if not content.get("velocity") and not content.get("position"):
        yield "`velocity` must name the columns of at least one of u v w p q r; it is missing"
    yield from _attitude(attitude)
    yield from _velocity(velocity, attitude)
    for group in ("velocity", "position"):
        vertical = [name for name in ("down", "up", "depth") if name in _table(content, group)]
        if len(vertical) > 1:
            yield f"`{group}` takes one of `{' '.join(vertical)}`; set the others to null"
    yield from _sensors(content, attitude, velocity)
    frame, world = _axes_of_attitude(content), content.get("world")
    if world is not None and world not in _WORLDS.get(frame, (world,)):
        yield (
            f"`world` must be {' or '.join(_WORLDS[frame])} where attitude is of axes {frame}; got"
            f" {world}. Set `sensors.attitude.axes` if attitude has other axes than the rest"
        )


def usual_world(content: Mapping[Any, Any]) -> str:
    """Return what the attitude is counted from where a mapping does not say it."""
    return _WORLDS.get(_axes_of_attitude(content), ("NED",))[0]


def _axes_of_attitude(content: Mapping[Any, Any]) -> str:
    own = _table(_table(content, "sensors"), "attitude").get("axes")
    return str(own or content.get("frame") or "FRD")


def _table(content: Mapping[Any, Any], key: str) -> dict[Any, Any]:
    given = content.get(key)
    return given if isinstance(given, dict) else {}


def _attitude(given: Mapping[Any, Any]) -> Iterator[str]:
    ways = ((*EULER, "heading"), ATTITUDE.columns, ("quaternion",))
    told = [" ".join(name for name in way if name in given) for way in ways]
    if len(told := [f"`{names}`" for names in told if names]) > 1:
        both = " and ".join(told)
        yield f"`attitude` must be given once; got both {both}. Set one of them to null"
    if {"yaw", "heading"} <= set(given):
        yield "`attitude` takes `yaw` or `heading`, not both. Set one of them to null"


def _velocity(given: Mapping[Any, Any], attitude: Mapping[Any, Any]) -> Iterator[str]:
    body, world = ([name for name in names if name in given] for names in (_LINEAR, COMPASS))
    if not world:
        return
    if body:
        yield (
            f"`velocity` must be along body axes or along the world's; got both `{' '.join(body)}`"
            f" and `{' '.join(world)}`. Set one of them to null"
        )
    if not attitude:
        yield f"`velocity.{world[0]}` needs `attitude` to become a velocity along body axes"
    if not {"north", "east"} <= set(world):
        yield "`velocity` along the world's axes needs both `north` and `east`"
    tilts = {"roll", "pitch", *ATTITUDE.columns, "quaternion"} & set(attitude)
    if tilts and not {"down", "up"} & set(world):
        yield "`velocity` needs `down` or `up` beside north and east, as the vehicle may tilt"


def _sensors(
    content: Mapping[Any, Any], attitude: Mapping[Any, Any], velocity: Mapping[Any, Any]
) -> Iterator[str]:
    is_whole = {
        "velocity": set(_LINEAR) <= set(velocity),
        "rates": set(_ANGULAR) <= set(velocity),
        "attitude": len(attitude) > 2 or "quaternion" in attitude,
        SPECIFIC_FORCE.name: len(_table(content, SPECIFIC_FORCE.name)) == 3,
    }
    sensors = _table(content, "sensors")
    for name in sensors:
        given = _table(sensors, name)
        if given.get("rotation") and not is_whole.get(name, True):
            yield f"`sensors.{name}.rotation` needs all three components of it in the mapping"
        if given.get("position") and name != "velocity":
            yield f"`sensors.{name}.position` has no effect; only that of `velocity` has"
    if _table(sensors, "velocity").get("position") and not set(_ANGULAR) & set(velocity):
        yield "`sensors.velocity.position` needs the rates p q r, or r alone on the level"


_FOLDER = Path(__file__).with_name("presets")
_PRESETS = PackageData(_FOLDER, lambda name: load_yaml(_FOLDER / f"{name}.yaml"))


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
        faults = [*contradictions(whole)]
        try:
            mapping = cls.model_validate({"world": usual_world(whole), **whole})
        except ValidationError as error:
            raise LogError([*faults_in(error, whole, cls), *faults], source=source) from error
        if faults:
            raise LogError(faults, source=source)
        mapping._name = source
        return mapping

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
        try:
            return clean(Log.from_record(record_of(self, recording)), self.steps)
        except LogError as error:
            faults = [self._named_by_columns(fault) for fault in error.faults]
            raise LogError(faults, source=recording.source) from error

    def _named_by_columns(self, fault: str) -> str:
        """Name the columns behind a channel that a fault begins with; the file has no `u`."""
        begin, name, rest = ("", "", fault) if "`" not in fault else fault.split("`", 2)
        entries = [one for one in self.entries if one.name == name]
        if not entries and name in _LINEAR:
            velocities = (one for one in self.entries if one.group == "velocity")
            entries = [one for one in velocities if one.name in COMPASS]
        columns = [one.column for one in entries if one.column not in ("", name)]
        if not columns or not rest.startswith(" must"):
            return fault
        return f"{begin}`{name}`, read from `{' '.join(columns)}`,{rest}"


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


def presets() -> tuple[str, ...]:
    """Return the names of the mappings that come with the package.

    Returns
    -------
    names : tuple of str
        Sorted; each may be given wherever a mapping file may.

    Examples
    --------
    >>> "mavros" in presets()
    True
    """
    return tuple(_PRESETS)


def load(place: str | Path, beside: Path | None = None) -> tuple[object, Path | None]:
    """Return the content of a preset or of a mapping file."""
    text = str(place)
    if text in _PRESETS:
        return _PRESETS[text], None
    path = Path(text) if beside is None else beside / text
    if isinstance(place, str) and "/" not in text and not Path(text).suffix and not path.exists():
        meant = did_you_mean(text, _PRESETS) or nearest_file(path.with_suffix(".yaml"))
        raise LogError(
            f"there is no preset '{text}'.{meant} The presets are: {', '.join(_PRESETS)}. A mapping"
            " file is named with its suffix"
        )
    content = load_yaml(path)
    if other := wrong_kind_message(content, str(path), "mapping"):
        raise LogError(other)
    return content, path


def composed(content: dict[Any, Any], path: Path | None = None) -> dict[Any, Any]:
    """Return a mapping with everything it extends filled in, without what is null."""
    whole = _merged(content, path, (str(path),) if path else ())
    for key, given in whole.items():
        if _is_group(key, given):
            whole[key] = {name: one for name, one in given.items() if one is not None}
    return {key: given for key, given in whole.items() if given is not None}


def _merged(content: dict[Any, Any], path: Path | None, seen: tuple[str, ...]) -> dict[Any, Any]:
    """Lay a mapping over those it extends: groups channel by channel, all else whole."""
    whole: dict[Any, Any] = {}
    for place in _extended(content):
        if place in seen:
            raise LogError(f"mappings extend one another in a ring: {' -> '.join((*seen, place))}")
        other, found = load(place, path.parent if path else None)
        if not isinstance(other, dict):
            raise LogError(f"`extends: {place}` holds no mapping; it must be a table")
        whole = _over(whole, _merged(other, found, (*seen, place)))
    return _over(whole, {key: given for key, given in content.items() if key != "extends"})


def _extended(content: dict[Any, Any]) -> Iterator[str]:
    given = content.get("extends") or []
    for place in [given] if isinstance(given, str) else given:
        if not isinstance(place, str):
            raise LogError(f"`extends` must be the name of a preset or a path; got {place!r}")
        yield place


def _over(below: dict[Any, Any], above: dict[Any, Any]) -> dict[Any, Any]:
    whole = dict(below)
    for key, given in above.items():
        table, under = by_name(given) if key == "commands" else given, whole.get(key)
        is_laid = _is_group(key, table) and _is_group(key, under)
        whole[key] = under | table if is_laid else table
    return whole


def _is_group(key: object, given: object) -> bool:
    return isinstance(given, dict) and key not in ("time", "clock")
