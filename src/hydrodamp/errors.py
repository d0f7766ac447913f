"""Exceptions, warnings, and the wording of messages, such as those of validation errors."""

from __future__ import annotations

import difflib
import reprlib
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, TypeVar, get_args

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError

# C0 and C1 controls, line separators, and marks that turn the direction of text.
_CONTROLS = dict.fromkeys(
    [*range(0x20), *range(0x7F, 0xA0), *range(0x2028, 0x202F), *range(0x2066, 0x206A)], " "
)

_CENTISECOND = 0.005  # s, what two digits round to
_TABLE_TYPES = ("dataclass_type", "dict_type", "model_attributes_type", "model_type")
_EXPECTED_VALUES = {
    **dict.fromkeys(_TABLE_TYPES, "a table"),
    **dict.fromkeys(("float_parsing", "float_type"), "a number"),
    **dict.fromkeys(("int_from_float", "int_parsing", "int_type"), "a whole number"),
    **dict.fromkeys(("list_type", "tuple_type"), "a list"),
    "bool_type": "true or false",
    "string_type": "text",
}


Model = TypeVar("Model", bound="BaseModel")


class HydrodampError(Exception):
    """Any mistake that hydrodamp can name."""


class TermError(HydrodampError, ValueError):
    """A spelling that is not a term."""


class ModelError(HydrodampError, ValueError):
    """An unknown model or label, or a wrong number of coefficients."""


class VehicleError(HydrodampError, ValueError):
    """A vehicle that is physically impossible."""


class ProblemError(HydrodampError, ValueError):
    """A vehicle, a log and terms that do not match."""


class MethodError(HydrodampError, ValueError):
    """An unknown method or a setting it cannot take."""


class FileError(HydrodampError, OSError):
    """A file or folder that cannot be read or written."""


class LogError(HydrodampError, ValueError):
    """Faults of one recorded log, collected and raised once.

    Attributes
    ----------
    faults : tuple of str
        One message per fault.
    """

    def __init__(self, faults: str | Iterable[str], *, source: str = "") -> None:
        self.faults = (faults,) if isinstance(faults, str) else tuple(faults)
        super().__init__(list_faults(source, self.faults))


class HydrodampWarning(UserWarning):
    """Something the reader of the result should know."""


class GapWarning(HydrodampWarning):
    """A log was split at a gap or at missing samples."""


class ClockWarning(HydrodampWarning):
    """A recorded clock repeats, runs backwards or jumps."""


class ForeignVehicleWarning(HydrodampWarning):
    """Damping coefficients are used with another vehicle."""


class PropulsionWarning(HydrodampWarning):
    """The propulsion ratio is unknown and assumed to be one."""


_suppressed: ContextVar[bool] = ContextVar("suppressed", default=False)


@contextmanager
def suppress_warnings() -> Iterator[None]:
    """Issue no warning by :func:`warn` inside, in this thread or task alone."""
    token = _suppressed.set(True)
    try:
        yield
    finally:
        _suppressed.reset(token)


def warn(message: str, category: type[HydrodampWarning], stacklevel: int) -> None:
    """Issue a warning as :func:`warnings.warn` does, unless it is suppressed here."""
    if not _suppressed.get():
        warnings.warn(message, category, stacklevel=stacklevel + 1)


def list_faults(source: str, faults: Sequence[str]) -> str:
    """Return one message that lists all faults of a file."""
    head = f"{source}: " if source else ""
    if len(faults) == 1:
        return head + faults[0]
    return f"{head}{len(faults)} faults" + "".join(f"\n  - {fault}" for fault in faults)


def printable(text: str) -> str:
    """Return a text with a blank for each control character, such as ESC or the end of a line."""
    return text.translate(_CONTROLS)


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a clause naming the known word nearest to ``name``."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f" Did you mean '{near[0]}'?" if near else ""


def no_such(what: str, name: str, known: Iterable[str]) -> str:
    """Return the message for an unknown name, with the nearest known name."""
    names = list(known)
    there = ", ".join(names) or "none"
    return f"there is no {what} '{name}'.{did_you_mean(name, names)} There are: {there}"


def demand(holds: bool, name: str, wanted: str, got: object) -> None:
    """Raise MethodError if a setting is invalid."""
    if not holds:
        raise MethodError(f"`{name}` must be {wanted}; got {got}")


def first_few(sentences: list[str], most: int, what: str) -> list[str]:
    """Return the first sentences of many, and how many more there are."""
    more = len(sentences) - most
    return sentences if more <= 0 else [*sentences[:most], f"... and {more} more {what}"]


def unique_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names; a repeated name gets a number: ``dive``, ``dive-2``."""
    unique: dict[str, None] = {}
    for name in names:
        candidate, count = name, 1
        while candidate in unique:
            count += 1
            candidate = f"{name}-{count}"
        unique[candidate] = None
    return tuple(unique)


def format_time(time: float, first: float) -> str:
    """Return a time counted from the first sample, and on the clock of the log if it differs."""
    clock = f" (by the clock {time:.3f} s)" if abs(first) >= _CENTISECOND else ""
    return f"{time - first:.2f} s{clock}"


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
    path, kind, given = format_path(location), fault["type"], fault.get("input")
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
    elif given is None:
        yield f"{subject} is still empty: fill it in"
    else:
        yield f"{subject} must be {_expected_value(kind, fault)}; got {reprlib.repr(given)}"


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
