"""Log mappings: reading of YAML files and presets, resolution of `extends`, checks."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hydrodamp.basis.term import VELOCITIES
from hydrodamp.conditioning.pipeline import clean
from hydrodamp.data.channels import ATTITUDE, EULER, SPECIFIC_FORCE
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording
from hydrodamp.errors import LogError, did_you_mean, no_such
from hydrodamp.faults import faults_in
from hydrodamp.files import PackageData, load_yaml, nearest_file, wrong_kind_message
from hydrodamp.ingest.mapping.assemble import build_record, build_resampler
from hydrodamp.ingest.mapping.channel_schema import (
    GEOGRAPHIC,
    PATH_VELOCITY,
    WORLD_DIRECTIONS,
)
from hydrodamp.ingest.mapping.schema import MappingFile, commands_by_name
from hydrodamp.ingest.mapping.sensor_channels import build_measurements

_WORLDS_BY_FRAME = {"FRD": ("NED",), "FLU": ("NWU", "ENU")}
_WORLD_AXES = (*WORLD_DIRECTIONS, *PATH_VELOCITY)
_LINEAR, _ANGULAR = VELOCITIES[:3], VELOCITIES[3:]


def find_contradictions(content: Mapping[Any, Any]) -> Iterator[str]:
    """Yield a sentence on each missing or contradictory key of a mapping."""
    if set(content) == {"steps"}:
        return  # a table in the canonical form needs no channels
    attitude, velocity = _subtable(content, "attitude"), _subtable(content, "velocity")
    if content.get("time") is None:
        yield (
            "`time` is missing; it must name the column of the clock. For topics with a recorded"
            " time, set `time: recorded`"
        )
    sensors = _subtable(content, "sensors")
    has_sensor = any("kind" in _subtable(sensors, name) for name in sensors)
    if not (content.get("velocity") or content.get("position") or has_sensor):
        yield (
            "`velocity` is missing; it must name the column of at least one of u v w p q r, or "
            "`sensors` one sensor with its `kind`"
        )
    forms = ((*EULER, "heading"), ATTITUDE.columns, ("quaternion",))
    present = [_names_in(attitude, form) for form in forms if _names_in(attitude, form)]
    if len(present) > 1:
        listed = " and ".join(f"`{names}`" for names in present)
        yield f"`attitude` must be given once; got both {listed}. Set one of them to null"
    if {"yaw", "heading"} <= set(attitude):
        yield "`attitude` takes `yaw` or `heading`, not both. Set one of them to null"
    if world := _names_in(velocity, _WORLD_AXES):
        yield from _check_world_velocity(world, _names_in(velocity, _LINEAR), attitude)
    geographic = _names_in(_subtable(content, "position"), GEOGRAPHIC)
    if horizontal := _names_in(_subtable(content, "position"), ("north", "east")):
        if geographic:
            yield f"`position` takes `{horizontal}` or `{geographic}`; set one of them to null"
    elif geographic and " " not in geographic:
        yield f"`position` needs both `latitude` and `longitude`; got only `{geographic}`"
    for group in ("velocity", "position"):
        vertical = _names_in(_subtable(content, group), ("down", "up", "depth"))
        if " " in vertical:
            yield f"`{group}` takes one of `{vertical}`; set the others to null"
    yield from _check_sensors(content, attitude, velocity)
    frame, attitude_world = _attitude_axes(content), content.get("world")
    allowed = _WORLDS_BY_FRAME.get(frame, ())
    if allowed and attitude_world not in (None, *allowed):
        yield (
            f"`world` must be {' or '.join(allowed)} if the attitude has axes {frame}; got"
            f" {attitude_world}. Set `sensors.attitude.axes` if they differ from `frame`"
        )


def _names_in(table: Mapping[Any, Any], names: Iterable[str]) -> str:
    return " ".join(name for name in names if name in table)


def default_world(content: Mapping[Any, Any]) -> str:
    """Return the default world frame of the attitude: NED for FRD, NWU for FLU."""
    return _WORLDS_BY_FRAME.get(_attitude_axes(content), ("NED",))[0]


def _attitude_axes(content: Mapping[Any, Any]) -> str:
    axes = _subtable(_subtable(content, "sensors"), "attitude").get("axes")
    return str(axes or content.get("frame") or "FRD")


def _subtable(content: Mapping[Any, Any], key: str) -> dict[Any, Any]:
    value = content.get(key)
    return value if isinstance(value, dict) else {}


def _check_world_velocity(world: str, body: str, attitude: Mapping[Any, Any]) -> Iterator[str]:
    names = world.split()
    if names == ["speed"]:
        if "u" in body:
            yield "`velocity` takes `u` or `speed`, which becomes u; set one of them to null"
        return
    if body:
        yield (
            f"`velocity` must be in body axes or in world axes; got both `{body}` and `{world}`."
            " Set one of them to null"
        )
    if not attitude:
        yield f"`velocity.{names[0]}` needs `attitude` for the rotation to body axes"
    horizontal = {*names} & {"north", "east", *PATH_VELOCITY}
    if horizontal not in ({"north", "east"}, {*PATH_VELOCITY}):
        yield "`velocity` in world axes needs `north` and `east`, or `speed` and `course`"
    tilts = {"roll", "pitch", *ATTITUDE.columns, "quaternion"} & set(attitude)
    if tilts and not {"down", "up"} & set(names):
        yield (
            f"`velocity` needs `down` or `up` with {' and '.join(names)}, since roll or pitch is"
            " mapped"
        )


def _check_sensors(
    content: Mapping[Any, Any], attitude: Mapping[Any, Any], velocity: Mapping[Any, Any]
) -> Iterator[str]:
    is_complete = {
        "velocity": set(_LINEAR) <= set(velocity),
        "rates": set(_ANGULAR) <= set(velocity),
        "attitude": len(attitude) > 2 or "quaternion" in attitude,
        SPECIFIC_FORCE.name: len(_subtable(content, SPECIFIC_FORCE.name)) == 3,
    }
    sensors = _subtable(content, "sensors")
    for name in sensors:
        sensor = _subtable(sensors, name)
        if sensor.get("rotation") and not is_complete.get(name, True):
            yield f"`sensors.{name}.rotation` needs all three components in the mapping"
        if sensor.get("position") and name != "velocity":
            yield f"`sensors.{name}.position` has no effect; only `sensors.velocity.position` has"
    if _subtable(sensors, "velocity").get("position") and not set(_ANGULAR) & set(velocity):
        yield "`sensors.velocity.position` needs the rates p q r, or r for level motion"


_FOLDER = Path(__file__).with_name("presets")
_PRESETS = PackageData(_FOLDER, lambda name: load_yaml(_FOLDER / f"{name}.yaml"))


class LogMapping(MappingFile):
    """Assignment of the fields of a recording to the channels of a log, with units and axes.

    The attributes are the keys of a mapping file, with `extends` resolved.

    Attributes
    ----------
    name : str
        Name in messages: its file, or the name of the preset.
    frame : str
        Axes of the log: ``FRD`` (body forward-starboard-down) or ``FLU`` (body
        forward-port-up).
    world : str
        Reference frame of the attitude: ``NED``; ``NWU``, z up and heading from x towards y; or
        ``ENU``.
    segment : str or None
        Column with the segment labels.
    topics : dict of str to tuple of str
        Topic names used in the mapping, and the alternative topics of each.
    steps : tuple of Step
        Conditioning steps applied to the resampled log.
    """

    @classmethod
    def from_dict(cls, content: object, source: str = "mapping") -> LogMapping:
        """Return the mapping that the content of a YAML file describes.

        Parameters
        ----------
        content : dict
            Content of the mapping file.
        source : str, optional
            Name in messages; the files in `extends` are relative to this path.

        Returns
        -------
        mapping : LogMapping
            Validated.

        Raises
        ------
        LogError
            With all unknown keys, units, signs and frames.
        FileError
            If a file in `extends` cannot be read.

        Examples
        --------
        >>> mapping = LogMapping.from_dict({"time": "t", "velocity": {"u": "speed"}})
        >>> [entry.column for entry in mapping.entries]
        ['t', 'speed']
        """
        if not isinstance(content, dict):
            got = "nothing" if content is None else type(content).__name__
            fault = f"a mapping must be a table of channels and columns; got {got}"
            raise LogError(fault, source=source)
        resolved = resolve_extends(content, Path(source))
        faults = [*find_contradictions(resolved)]
        try:
            mapping = cls.model_validate({"world": default_world(resolved), **resolved})
        except ValidationError as error:
            raise LogError([*faults_in(error, resolved, cls), *faults], source=source) from error
        if faults:
            raise LogError(faults, source=source)
        mapping._name = source
        return mapping

    def log(self, recording: Recording) -> Log:
        """Return the log of a recording.

        Parameters
        ----------
        recording : Recording
            From :func:`~hydrodamp.read_recording`.

        Returns
        -------
        log : Log
            On one clock, in SI units, forward-starboard-down and north-east-down; its notes
            describe what the steps of the mapping did.

        Raises
        ------
        LogError
            With all faults, or the channels that a step needs and the log lacks.

        Warns
        -----
        GapWarning
            Once, if a gap or missing values split the log.
        ClockWarning
            Once, if a clock has duplicate or out-of-order timestamps or resets.

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
            resampler = build_resampler(self, recording)
            log = Log.from_record(build_record(self, recording, resampler))
            measurements = build_measurements(self, resampler, log)
            return clean(replace(log, measurements=measurements), self.steps)
        except LogError as error:
            faults = [self._add_column_names(fault) for fault in error.faults]
            raise LogError(faults, source=recording.source) from error

    def _add_column_names(self, fault: str) -> str:
        """Add the columns of the channel that a fault begins with, since the file has no `u`."""
        prefix, name, predicate = ("", "", fault) if "`" not in fault else fault.split("`", 2)
        entries = [entry for entry in self.entries if entry.name == name]
        if not entries and name in _LINEAR:
            velocities = (entry for entry in self.entries if entry.group == "velocity")
            entries = [entry for entry in velocities if entry.name in _WORLD_AXES]
        columns = [entry.column for entry in entries if entry.column not in ("", name)]
        if not columns or not predicate.startswith(" must"):
            return fault
        return f"{prefix}`{name}`, read from `{' '.join(columns)}`,{predicate}"


def read_mapping(path: str | Path) -> LogMapping:
    """Read a mapping from its YAML file, or a preset by its name.

    Parameters
    ----------
    path : str or Path
        Path of the file, or name of a preset.

    Returns
    -------
    mapping : LogMapping
        Validated.

    Raises
    ------
    FileError
        If the file cannot be read or is no valid YAML, with the line.
    LogError
        With all faults of the mapping.

    Examples
    --------
    >>> read_mapping("rep103-odometry").world
    'ENU'
    """
    content, _ = load_content(path)
    return LogMapping.from_dict(content, str(path))


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a mapping file, for validation and completion in editors.

    Returns
    -------
    schema : dict
        Draft 2020-12.

    Examples
    --------
    >>> sorted(json_schema()["properties"])[:3]
    ['acceleration', 'attitude', 'clock']
    """
    schema = MappingFile.model_json_schema()
    descriptions: Any = load_yaml(Path(__file__).with_name("descriptions.yaml"))
    for model, texts in descriptions.items():
        properties = schema["$defs"].get(model, schema)["properties"]
        for key, text in texts.items():
            properties[key]["description"] = text
    dialect = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return {**dialect, **schema, "title": "hydrodamp mapping file"}


def presets() -> tuple[str, ...]:
    """Return the names of the packaged mappings.

    Returns
    -------
    names : tuple of str
        Sorted; each is accepted in place of a mapping file.

    Examples
    --------
    >>> "mavros" in presets()
    True
    """
    return tuple(_PRESETS)


def load_content(name: str | Path, folder: Path | None = None) -> tuple[object, Path | None]:
    """Return the content of a preset or of a mapping file."""
    text = str(name)
    if text in _PRESETS:
        return _PRESETS[text], None
    path = Path(text) if folder is None else folder / text
    if isinstance(name, str) and "/" not in text and not Path(text).suffix and not path.exists():
        suggestion = did_you_mean(text, _PRESETS) or nearest_file(path.with_suffix(".yaml"))
        raise LogError(
            f"there is no preset '{text}'.{suggestion} The presets are: {', '.join(_PRESETS)}. Give"
            " a mapping file with its suffix"
        )
    content = load_yaml(path)
    if message := wrong_kind_message(content, str(path), "mapping"):
        raise LogError(message)
    return content, path


def resolve_extends(content: dict[Any, Any], path: Path | None = None) -> dict[Any, Any]:
    """Return the content of a mapping with `extends` resolved and null keys removed."""
    merged = _merge_extended(content, path, (str(path),) if path else ())
    for key, value in merged.items():
        if _is_group(key, value):
            merged[key] = {name: channel for name, channel in value.items() if channel is not None}
    return {key: value for key, value in merged.items() if value is not None}


def _merge_extended(
    content: dict[Any, Any], path: Path | None, chain: tuple[str, ...]
) -> dict[Any, Any]:
    """Overlay a mapping on those it extends: groups by channel, other keys by replacement."""
    merged: dict[Any, Any] = {}
    extends = content.get("extends") or []
    for name in extends if isinstance(extends, list) else [extends]:
        if not isinstance(name, str):
            raise LogError(f"`extends` must be the name of a preset or a path; got {name!r}")
        if name in chain:
            raise LogError(f"`extends` is circular: {' -> '.join((*chain, name))}")
        extended, extended_path = load_content(name, path.parent if path else None)
        if not isinstance(extended, dict):
            raise LogError(f"`extends: {name}` must hold a mapping table")
        merged = _overlay(merged, _merge_extended(extended, extended_path, (*chain, name)))
    return _overlay(merged, {key: value for key, value in content.items() if key != "extends"})


def _overlay(below: dict[Any, Any], above: dict[Any, Any]) -> dict[Any, Any]:
    merged = dict(below)
    for key, value in above.items():
        table = commands_by_name(value) if key == "commands" else value
        is_mergeable = _is_group(key, table) and _is_group(key, below.get(key))
        merged[key] = below[key] | table if is_mergeable else table
    return merged


def _is_group(key: object, value: object) -> bool:
    return isinstance(value, dict) and key not in ("time", "clock")


def preset_text(name: str) -> str:
    """Return the file of a preset."""
    if name not in _PRESETS:
        raise LogError(no_such("preset", name, _PRESETS))
    return _PRESETS.text(name)


def describe_preset(name: str) -> str:
    """Return the first sentence of the comment of a preset."""
    lines = preset_text(name).splitlines()
    comment = " ".join(line.lstrip("# ") for line in takewhile(lambda x: x.startswith("#"), lines))
    return f"{re.split(r'[:.] ', comment, maxsplit=1)[0].rstrip('.')}."
