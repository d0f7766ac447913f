"""Elements of arrays by the names of their columns: ``nu[0]``, ``tau_1``, ``pd(1,1)``."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass

_INDEX = re.compile(r"(?P<stem>.*[^\W\d_].*?)(?P<index>_\d|\[\d+\]|\(\d+(, ?\d+)?\))")


def split_index(name: str) -> tuple[str, str]:
    """Return the name of an array and the index of its element, which is empty for a scalar."""
    found = _INDEX.fullmatch(name)
    return (found["stem"], found["index"]) if found else (name, "")


@dataclass(frozen=True)
class Element:
    """Place of an element in its array, counted from zero, and the number of elements."""

    index: int
    size: int


def element_of(field: str, beside: Collection[str]) -> Element | None:
    """Return the element that a field is, by its index and those beside it; None for none.

    The indices of a row or a column of MATLAB, `(3,1)`, count as one; those of a matrix do not.
    """
    stem, index = split_index(field)
    indices = [other for each, other in map(split_index, {*beside, field}) if each == stem]
    places = [tuple(map(int, re.findall(r"\d+", one))) for one in indices if one]
    if not index or len({*map(len, places)}) != 1:
        return None
    moving = [k for k, column in enumerate(zip(*places, strict=True)) if len({*column}) > 1]
    if len(moving) > 1:
        return None
    axis = moving[0] if moving else 0
    first = min(one[axis] for one in places) if moving and "[" not in index else 0
    return Element(int(re.findall(r"\d+", index)[axis]) - min(first, 1), len(places))
