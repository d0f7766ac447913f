"""Messages of pydantic validation errors: one sentence per fault, with its location."""

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
    """Validate the content of a file; raise an error with all faults."""
    from pydantic import ValidationError

    try:
        return form.model_validate(content)
    except ValidationError as cause:
        raise error(list_faults(source, faults_in(cause, content, form))) from cause


def faults_in(error: ValidationError, content: object, form: type[BaseModel]) -> list[str]:
    """Return the faults of a file's content as sentences.

    A validator that raises ValueError gives the predicate of a sentence about the location
    ("must be ..."); one that raises a HydrodampError gives a complete sentence.
    """
    sentences: list[str] = []
    for fault in error.errors(include_url=False):
        location = _location(fault["loc"], content, fault["type"])
        sentences += _sentences(dict(fault), location, form)
    return list(dict.fromkeys(sentences))


def _sentences(
    fault: dict[str, Any], location: list[str | int], form: type[BaseModel]
) -> Iterator[str]:
    path, kind, value = format_path(location), fault["type"], fault.get("input")
    subject = f"`{path}`" if path else "it"
    cause = fault.get("ctx", {}).get("error")
    if isinstance(cause, HydrodampError):
        faults = cause.faults if isinstance(cause, LogError) else (str(cause),)
        yield from (f"`{path}`: {each}" if path else each for each in faults)
    elif cause is not None:
        yield f"`{path}` {cause}" if path else str(cause)
    elif kind == "extra_forbidden":
        yield _unknown_key(location, form)
    elif kind == "missing":
        yield f"`{path}` is missing"
    elif value is None:
        yield f"{subject} is still empty: fill it in"
    else:
        yield f"{subject} must be {_expected_value(kind, fault)}; got {reprlib.repr(value)}"


def _location(loc: tuple[str | int, ...], content: Any, kind: str) -> list[str | int]:
    """Return the keys of a fault in the content, without those that pydantic adds."""
    location: list[str | int] = []
    for depth, key in enumerate(loc):
        is_key = isinstance(content, dict) and key in content
        is_index = isinstance(content, list) and isinstance(key, int) and key < len(content)
        if is_key or is_index:
            content = content[key]
            location.append(key)
        elif kind == "missing" and depth == len(loc) - 1:
            location.append(key)
    return location


def format_path(location: list[str | int]) -> str:
    """Return a location as text: ``velocity.u[0].unit``."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in location)
    return text.removeprefix(".")


def _unknown_key(location: list[str | int], form: type[BaseModel]) -> str:
    key, known = str(location[-1]), list(_keys_at(location, form))
    near = did_you_mean(key, known)
    if len(location) == 1:
        return f"unknown key `{key}`.{near} Keys are: {' '.join(known)}"
    takes = " ".join(known) or "nothing"
    return f"`{format_path(location[:-1])}` has no `{key}`.{near} It takes: {takes}"


def _keys_at(location: list[str | int], form: type[BaseModel]) -> dict[str, None]:
    """Return the allowed keys of the table around a location."""
    forms = [form]
    for key in location[:-1]:
        fields = [model.model_fields[key] for model in forms if key in model.model_fields]
        forms = [inner for field in fields for inner in _nested_models(field.annotation)] or forms
    return {key: None for model in forms for key in model.model_fields}


def _nested_models(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the models in the type of a field."""
    if hasattr(annotation, "model_fields"):
        yield annotation
    for argument in get_args(annotation):
        yield from _nested_models(argument)


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
    message = str(fault["msg"]).removeprefix("Input should be ").removeprefix("Input ")
    return _EXPECTED_VALUES.get(kind, message)
