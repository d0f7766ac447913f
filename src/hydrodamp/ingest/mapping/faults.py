"""What is wrong in a mapping file, said plainly and with its place."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from hydrodamp.errors import did_you_mean
from hydrodamp.ingest.mapping import schema
from hydrodamp.ingest.mapping.channels import SINGLE

_TAGS = frozenset(("name", "entry", "constant", "choices", "[key]", "one", "several", "table"))
_FORMS: dict[str, type[BaseModel]] = {
    "attitude": schema.AttitudeForm,
    "velocity": schema.VelocityForm,
    "acceleration": schema.AccelerationForm,
    "wrench": schema.WrenchForm,
    "position": schema.PositionForm,
    "accelerometer": schema.AccelerometerForm,
    "sensors": schema.SensorsForm,
    "clock": schema.ClockForm,
    "quaternion": schema.QuaternionForm,
    "rotation": schema.AnglesForm,
}
_SAID = {
    "frame": "`frame` must be FRD (z down) or FLU (z up); got {given!r}",
    "segment": "`segment` must be the name of a column; got {given!r}",
    "clock": "`clock` must be a topic, or a table of `topic` or `rate`; got {given!r}",
    "world": "`world` must be NED, NWU or ENU; got {given!r}",
}
_WANTED = {
    "bool_type": "true or false",
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "list_type": "a list",
    "string_type": "text",
}


def form_faults(error: ValidationError) -> list[str]:
    """Return the faults that the form of a mapping file shows, one sentence each."""
    sentences = (_sentence(dict(fault)) for fault in error.errors(include_url=False))
    return list(dict.fromkeys(sentences))


def _sentence(fault: dict[str, Any]) -> str:
    kind, given = fault["type"], fault.get("input")
    loc = fault["loc"]
    keys = {0, len(loc) - 1} if kind == "extra_forbidden" else {0}  # are keys, whatever they say
    place = [
        part
        for i, part in enumerate(loc)
        if i in keys or (part not in _TAGS and not _is_type(part))
    ]
    path = _path(place)
    if kind == "extra_forbidden":
        return _unknown(place)
    if path in _SAID:
        return _SAID[path].format(given=given)
    if kind == "missing" or place[-1:] == ["column"]:
        where = path.removesuffix(".column")
        return f"`{where}` must name a column; got {_column(given, kind)!r}"
    if kind.startswith("model") or kind == "dict_type":
        return _no_table(place, path, given)
    return f"`{path}` must be {_wanted(kind, fault)}; got {_short(given)}"


def _is_type(part: object) -> bool:
    """Tell the words that pydantic puts into a path for the type it tried."""
    return isinstance(part, str) and (part in ("str", "literal") or "[" in part)


def _column(given: object, kind: str) -> object:
    return given.get("column") if kind == "missing" and isinstance(given, dict) else given


def _no_table(place: list[str | int], path: str, given: object) -> str:
    if len(place) == 1 and path not in SINGLE:
        return f"`{path}` must be a table of names to columns; got {called(given)}"
    if place[0] == "sensors" or place[-1] in ("quaternion", "where"):
        return f"`{path}` must be a table; got {called(given)}"
    return f"`{path}` must name a column; got {given!r}"


def _unknown(place: list[str | int]) -> str:
    key = str(place[-1])
    if len(place) == 1:
        known = list(schema.MappingForm.model_fields)
        return f"unknown key `{key}`.{did_you_mean(key, known)} Keys are: {' '.join(known)}"
    form = _FORMS.get(str(place[-2]))
    if form is None:
        form = schema.SensorForm if place[0] == "sensors" else schema.EntryForm
    known = list(form.model_fields)
    near = did_you_mean(key, known)
    return f"`{_path(place[:-1])}` has no `{key}`.{near} It takes: {' '.join(known)}"


def _wanted(kind: str, fault: Mapping[str, Any]) -> str:
    if kind == "literal_error":
        return str(fault["ctx"]["expected"]).replace("'", "")
    if kind in ("too_short", "too_long"):
        least, most = (fault["ctx"].get(name) for name in ("min_length", "max_length"))
        return "a list of at least one" if least == 1 else f"a list of {least or most}"
    said = str(fault["msg"]).removeprefix("Input should be ")
    return _WANTED.get(kind, said)


def _path(place: list[str | int]) -> str:
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place)
    return text.removeprefix(".")


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def called(content: object) -> str:
    """Return how a message calls content of the wrong kind."""
    return "nothing" if content is None else type(content).__name__
