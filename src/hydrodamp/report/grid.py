"""A table of words: what every rendering starts from."""

from __future__ import annotations

from dataclasses import dataclass

CROWDED = 10
"""Columns beyond which they stand closer together."""


@dataclass(frozen=True)
class Grid:
    """A title, a header, rows of words and remarks below them.

    Parameters
    ----------
    title : str
        What the table shows.
    header : tuple of str
        One word a column.
    rows : tuple of tuple of str
        As many words a row.
    align : str
        ``l`` or ``r`` for each column.
    notes : tuple of str, optional
        Sentences below the table.
    best : frozenset of (int, int), optional
        Row and column of the cells to stress.
    dim : frozenset of int, optional
        Columns of secondary interest.

    Raises
    ------
    ValueError
        If header, rows and ``align`` differ in length.

    Examples
    --------
    >>> Grid("counts", ("model", "n"), (("linear", "36"),), "lr").column("n")
    ('36',)
    """

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
        """Return the words of a column.

        Parameters
        ----------
        name : str
            As in the header.

        Returns
        -------
        words : tuple of str
            From top to bottom.
        """
        place = self.header.index(name)
        return tuple(row[place] for row in self.rows)
