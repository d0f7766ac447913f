"""Elements of arrays by the names of their columns: ``nu[0]``, ``tau_1``, ``pd(1,1)``."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass

_INDEX = re.compile(r"(?P<stem>.*[^\W\d_].*?)(?P<index>_\d|\[\d+\]|\(\d+(, ?\d+)?\))")


def split_index(name: str) -> tuple[str, str]:
    """Return the name of an array and the index of its element, which is empty for a scalar."""
    match = _INDEX.fullmatch(name)
    return (match["stem"], match["index"]) if match else (name, "")


@dataclass(frozen=True)
class Element:
    """Index of an element in its array, from zero, and the number of elements."""

    index: int
    size: int


def element_of(field: str, beside: Collection[str]) -> Element | None:
    """Return the array element that a field is, from the indices of its siblings; or None.

    A MATLAB row or column, `(3,1)`, is a vector; elements of a matrix have no single index.
    """
    stem, index = split_index(field)
    indices = [index_ for each, index_ in map(split_index, {*beside, field}) if each == stem]
    subscripts = [
        tuple(map(int, re.findall(r"\d+", subscript))) for subscript in indices if subscript
    ]
    if not index or len({*map(len, subscripts)}) != 1:
        return None
    moving = [k for k, column in enumerate(zip(*subscripts, strict=True)) if len({*column}) > 1]
    if len(moving) > 1:
        return None
    axis = moving[0] if moving else 0
    first = min(subscript[axis] for subscript in subscripts) if moving and "[" not in index else 0
    return Element(int(re.findall(r"\d+", index)[axis]) - min(first, 1), len(subscripts))
