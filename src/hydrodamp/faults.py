"""What a pydantic model finds wrong in a file, one plain sentence a fault, each with its place."""

from __future__ import annotations

import reprlib
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from hydrodamp.errors import FileError, HydrodampError, LogError, did_you_mean, list_faults

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError

_TABLES = ("dataclass_type", "dict_type", "model_attributes_type", "model_type")
_EXPECTED_VALUES = {
    **dict.fromkeys(_TABLES, "a table"),
    **dict.fromkeys(("float_parsing", "float_type"), "a number"),
    **dict.fromkeys(("int_from_float", "int_parsing", "int_type"), "a whole number"),
    **dict.fromkeys(("list_type", "tuple_type"), "a list"),
    "bool_type": "true or false",
    "string_type": "text",
}


Model = TypeVar("Model", bound="BaseModel")


def validate(
    form: type[Model], content: object, source: str, error: type[HydrodampError] = FileError
) -> Model:
    """Return a file's content as its form, or refuse it with all its faults."""
    from pydantic import ValidationError

    try:
        return form.model_validate(content)
    except ValidationError as cause:
        raise error(list_faults(source, faults_in(cause, content, form))) from cause


def faults_in(error: ValidationError, content: object, form: type[BaseModel]) -> list[str]:
    """Return the faults of a file's content as sentences.

    A validator that raises ValueError gives the rest of a sentence that begins with the place
    ("must be ..."); one that raises an error of ours gives a whole sentence.
    """
    told: list[str] = []
    for fault in error.errors(include_url=False):
        place = _location(fault["loc"], content, fault["type"])
        told += _sentences(dict(fault), place, form)
    return list(dict.fromkeys(told))


def _sentences(
    fault: dict[str, Any], place: list[str | int], form: type[BaseModel]
) -> Iterator[str]:
    path, kind, given = format_path(place), fault["type"], fault.get("input")
    subject = f"`{path}`" if path else "it"
    cause = fault.get("ctx", {}).get("error")
    if isinstance(cause, HydrodampError):
        faults = cause.faults if isinstance(cause, LogError) else (str(cause),)
        yield from (f"`{path}`: {each}" if path else each for each in faults)
    elif cause is not None:
        yield f"`{path}` {cause}" if path else str(cause)
    elif kind == "extra_forbidden":
        yield _unknown_key(place, form)
    elif kind == "missing":
        yield f"`{path}` is missing"
    elif given is None:
        yield f"{subject} is still empty: fill it in"
    else:
        yield f"{subject} must be {_expected_value(kind, fault)}; got {reprlib.repr(given)}"


def _location(loc: tuple[str | int, ...], content: Any, kind: str) -> list[str | int]:
    """Return where a fault is: its keys in the content, without what pydantic adds to them."""
    place: list[str | int] = []
    for depth, part in enumerate(loc):
        is_key = isinstance(content, dict) and part in content
        is_index = isinstance(content, list) and isinstance(part, int) and part < len(content)
        if is_key or is_index:
            content = content[part]
            place.append(part)
        elif kind == "missing" and depth == len(loc) - 1:
            place.append(part)
    return place


def format_path(place: list[str | int]) -> str:
    """Return a place as it is written: ``velocity.u[0].unit``."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place)
    return text.removeprefix(".")


def _unknown_key(place: list[str | int], form: type[BaseModel]) -> str:
    key, known = str(place[-1]), list(_keys_at(place, form))
    near = did_you_mean(key, known)
    if len(place) == 1:
        return f"unknown key `{key}`.{near} Keys are: {' '.join(known)}"
    takes = " ".join(known) or "nothing"
    return f"`{format_path(place[:-1])}` has no `{key}`.{near} It takes: {takes}"


def _keys_at(place: list[str | int], form: type[BaseModel]) -> dict[str, None]:
    """Return the keys that the table around a place may have."""
    forms = [form]
    for part in place[:-1]:
        found = [one.model_fields[part] for one in forms if part in one.model_fields]
        forms = [inner for one in found for inner in _nested_models(one.annotation)] or forms
    return {key: None for one in forms for key in one.model_fields}


def _nested_models(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the models in the type of a field."""
    if hasattr(annotation, "model_fields"):
        yield annotation
    for part in get_args(annotation):
        yield from _nested_models(part)


def _expected_value(kind: str, fault: Mapping[str, Any]) -> str:
    if kind == "literal_error":
        return str(fault["ctx"]["expected"]).replace("'", "")
    if kind == "less_than_equal":
        return f"at most {fault['ctx']['le']:g}"
    if kind == "greater_than_equal":
        return f"at least {fault['ctx']['ge']:g}"
    if kind in ("too_short", "too_long"):
        least, most = (fault["ctx"].get(name) for name in ("min_length", "max_length"))
        return "a list of at least one" if least == 1 else f"a list of {least or most}"
    said = str(fault["msg"]).removeprefix("Input should be ").removeprefix("Input ")
    return _EXPECTED_VALUES.get(kind, said)
