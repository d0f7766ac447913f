"""Exceptions, warnings, and text helpers of messages."""

from __future__ import annotations

import difflib
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from html import escape
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from pydantic import BaseModel

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


class UnknownModelError(ModelError, KeyError):
    """A name that the catalogue does not have."""

    __str__ = Exception.__str__


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


class OutlierWarning(HydrodampWarning):
    """Implausible samples of a log are left out."""


class ForeignVehicleWarning(HydrodampWarning):
    """Damping coefficients are used with another vehicle."""


class PropulsionWarning(HydrodampWarning):
    """The propulsion ratio is unknown and assumed to be one."""


#: A message and its category.
WarningList = list[tuple[str, type["HydrodampWarning"]]]

_suppressed: ContextVar[WarningList | None] = ContextVar("suppressed", default=None)


@contextmanager
def suppress_warnings() -> Iterator[WarningList]:
    """Collect the warnings by :func:`warn` inside instead, in this thread or task alone."""
    collected: WarningList = []
    token = _suppressed.set(collected)
    try:
        yield collected
    finally:
        _suppressed.reset(token)


def warn(message: str, category: type[HydrodampWarning], stacklevel: int) -> None:
    """Issue a warning as :func:`warnings.warn` does, unless it is suppressed here."""
    if (suppressed := _suppressed.get()) is None:
        warnings.warn(message, category, stacklevel=stacklevel + 1)
    else:
        suppressed.append((message, category))


def list_faults(source: str, faults: Sequence[str]) -> str:
    """Return one message that lists all faults of a file."""
    head = f"{source}: " if source else ""
    if len(faults) == 1:
        return head + faults[0]
    return f"{head}{len(faults)} faults" + "".join(f"\n  - {fault}" for fault in faults)


def printable(text: str) -> str:
    """Return a text with a blank for each control character, such as ESC or the end of a line."""
    return text.translate(_CONTROLS)


def repr_html(value: object, columns: Mapping[str, Sequence[object]] | None = None) -> str:
    """Return the text of a value, and columns that are not empty as a table, as HTML."""
    filled = {name: cells for name, cells in (columns or {}).items() if cells}
    rows = [[*filled], *zip(*filled.values(), strict=True)]
    lines = ("".join(f"<td>{escape(_cell(cell))}</td>" for cell in row) for row in rows if row)
    table = "".join(f"<tr>{line}</tr>" for line in lines)
    return f'<pre style="white-space: pre-wrap">{escape(str(value))}</pre><table>{table}</table>'


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else printable(str(value))


def has_controls(text: str) -> bool:
    """Return whether a text holds control characters other than tabs and ends of lines."""
    return printable(text) != text.translate({9: " ", 10: " ", 13: " "})


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
