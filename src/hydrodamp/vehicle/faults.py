"""What is wrong in a vehicle file, said plainly."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from hydrodamp.errors import did_you_mean
from hydrodamp.vehicle.schema import (
    FinEntry,
    MatrixEntry,
    PropellerEntry,
    RigidBodyEntry,
    ThrusterEntry,
    VehicleEntry,
)

_ACTUATORS: dict[str, type[BaseModel]] = {
    "matrix": MatrixEntry,
    "fin": FinEntry,
    "propeller": PropellerEntry,
    "thruster": ThrusterEntry,
}
_WANTED = {
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "string_type": "text",
    "list_type": "a list",
    "dict_type": "keys and values",
    "model_type": "keys and values",
    "model_attributes_type": "keys and values",
}


def faults_of(error: ValidationError) -> list[str]:
    """Return the faults of a vehicle file, one sentence each."""
    return list(dict.fromkeys(_sentences(error)))


def _sentences(error: ValidationError) -> Iterator[str]:
    for fault in error.errors(include_url=False):
        path = _path(fault["loc"])
        kind, given = fault["type"], fault.get("input")
        if kind == "missing":
            yield f"`{path}` is missing"
        elif kind == "extra_forbidden":
            yield f"`{path}` is no key of a vehicle file.{_nearest(fault['loc'])}"
        elif kind == "value_error":
            yield f"{path + ' ' if path else 'the file '}{fault['ctx']['error']}"
        elif given is None:
            yield f"`{path}` is still empty: fill it in"
        elif kind == "union_tag_not_found":
            is_table = isinstance(given, Mapping)
            yield (
                f"`{path}.kind` is missing; it must be one of {', '.join(_ACTUATORS)}"
                if is_table
                else f"`{path}` must be keys and values; got {_short(given)}"
            )
        elif kind == "union_tag_invalid":
            yield (
                f"`{path}.kind` must be one of {', '.join(_ACTUATORS)}; got {given.get('kind')!r}"
            )
        elif kind in ("too_short", "too_long"):
            yield _count(path, fault["ctx"], given)
        else:
            yield f"`{path}` must be {_wanted(kind, fault)}; got {_short(given)}"


def _wanted(kind: str, fault: Mapping[str, Any]) -> str:
    if kind == "literal_error":
        words = str(fault["ctx"]["expected"]).replace(" or ", ", ").replace("'", "")
        return f"one of {words}"
    said = str(fault["msg"]).removeprefix("Input should be ").removeprefix("Input ")
    return _WANTED.get(kind, said)


def _count(path: str, context: Mapping[str, Any], given: Any) -> str:
    wanted = context.get("min_length", context.get("max_length"))
    rows = any(isinstance(row, list) for row in given)
    return f"`{path}` must have {wanted} {'rows' if rows else 'numbers'}; got {len(given)}"


def _path(loc: tuple[str | int, ...]) -> str:
    parts: list[str] = []
    for part in loc:
        before = parts[-1] if parts else ""
        if isinstance(part, int):
            parts[-1] += f"[{part}]"
        elif not _is_form(part, before):
            parts.append(part)
    return ".".join(parts)


def _is_form(part: str, before: str) -> bool:
    """Tell the words that pydantic puts into a path for the form it tried."""
    actuator = part in _ACTUATORS and before.startswith("actuators[")
    return actuator or part == "[key]" or (part in ("moments", "tensor") and before == "inertia")


def _nearest(loc: tuple[str | int, ...]) -> str:
    forms: dict[str, type[BaseModel]] = {"rigid_body": RigidBodyEntry, **_ACTUATORS}
    form = forms.get(str(loc[-2]), VehicleEntry) if len(loc) > 1 else VehicleEntry
    return did_you_mean(str(loc[-1]), form.model_fields)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
