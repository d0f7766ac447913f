"""The front of error against complexity: what each further coefficient buys."""

from __future__ import annotations

from typing import Protocol, TypeVar

from hydrodamp.validation.choice import Ranked, error_of

Some = TypeVar("Some", bound=Ranked)
Some_co = TypeVar("Some_co", bound=Ranked, covariant=True)


class Table(Protocol[Some_co]):
    """Anything with rows that can be ranked: a comparison, a cross-validation."""

    @property
    def rows(self) -> tuple[Some_co, ...]:
        """Its rows."""
        ...


def front(table: Table[Some]) -> tuple[Some, ...]:
    """Return the rows that no other row beats in both error and complexity.

    Parameters
    ----------
    table : Comparison or CrossValidation
        Rows without an RMS error are left out: one that diverged beats nothing.

    Returns
    -------
    rows : tuple of Row
        From the fewest coefficients to the lowest error; each has more coefficients
        and a lower error than the one before. Of equal rows the first one is there.

    Examples
    --------
    >>> from hydrodamp.validation.comparison import Comparison
    >>> front(Comparison(()))
    ()
    """
    scored = [row for row in table.rows if row.rms is not None]
    chosen: list[Some] = []
    for row in sorted(scored, key=lambda row: (row.n_coefficients, error_of(row))):
        if not chosen or error_of(row) < error_of(chosen[-1]):
            chosen.append(row)
    return tuple(chosen)
