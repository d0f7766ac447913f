"""A table of words: what every rendering starts from."""

from __future__ import annotations

from dataclasses import dataclass

CROWDED = 10
"""Columns beyond which they stand closer together."""


@dataclass(frozen=True)
class Grid:
    """A title, a header, rows of words and remarks below them."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    align: str
    notes: tuple[str, ...] = ()
    best: frozenset[tuple[int, int]] = frozenset()
    dim: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        """Refuse a ragged table."""
        widths = {len(self.header), len(self.align), *map(len, self.rows)}
        if len(widths) != 1:
            raise ValueError(
                f"`header`, `align` and `rows` must be equally long, got {sorted(widths)}"
            )

    @property
    def gap(self) -> int:
        """Blanks between columns: two, or one where there are many."""
        return 2 if len(self.header) <= CROWDED else 1

    def column(self, name: str) -> tuple[str, ...]:
        """Return the words of a column."""
        place = self.header.index(name)
        return tuple(row[place] for row in self.rows)
