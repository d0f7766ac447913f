"""Selection of a fit from several by their errors on held-out data.

A row with a diverged replay ranks below every row without one, then a row that has not converged
below those that have. Of the best of these classes the one-standard-error rule (Breiman et al.,
1984) selects a row: of those whose RMS error is within one jackknife standard error of the lowest,
over blocks of the held-out data, that with the fewest coefficients, then the most determined ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from hydrodamp.errors import MethodError
from hydrodamp.identification.grades import Grade, count_determined
from hydrodamp.simulation.block_errors import BlockErrors
from hydrodamp.status import Status


class Ranked(Protocol):
    """Protocol of rows that can be ranked."""

    @property
    def model(self) -> str:
        """Key of the model."""

    @property
    def method(self) -> str:
        """Key of the method."""

    @property
    def n_coefficients(self) -> int:
        """Number of coefficients of the model."""

    @property
    def grades(self) -> Mapping[str, Grade]:
        """The grade of each coefficient by the training data; empty where not graded."""

    @property
    def rms(self) -> float | None:
        """The RMS error; None where a replay diverged or there is none."""

    @property
    def blocks(self) -> BlockErrors | None:
        """The errors of all replays in blocks; None where nothing was identified."""

    @property
    def divergences(self) -> tuple[str, ...]:
        """Where its replays diverged."""

    @property
    def converged(self) -> bool:
        """Whether there is a replay, and the fit has converged."""


Candidate = TypeVar("Candidate", bound=Ranked)
Candidate_co = TypeVar("Candidate_co", bound=Ranked, covariant=True)


@dataclass(frozen=True)
class Selection(Generic[Candidate]):
    """The selected row, with the reason.

    Attributes
    ----------
    row : Row
        That of fewest coefficients among those within one standard error of the lowest error.
    errors : BlockErrors
        Those of the selected row.
    ranked : tuple of Row
        The rows that could be selected, from the lowest error.
    equivalent : tuple of Row
        The other rows within one standard error of the lowest error.
    sentence : str
        The selected row, the reason, and the margin to the runner-up.
    caveat : str
        Rows that were excluded, and replays that diverged; empty for none.
    """

    row: Candidate
    errors: BlockErrors
    ranked: tuple[Candidate, ...]
    equivalent: tuple[Candidate, ...]
    sentence: str
    caveat: str = ""

    @property
    def runner_up(self) -> Candidate | None:
        """The lowest error, or the second where the lowest is selected; None for a single row."""
        return next((row for row in self.ranked if row is not self.row), None)

    def __str__(self) -> str:
        """Return the sentence and the caveat."""
        return f"{self.sentence} {self.caveat}".rstrip()

    __repr__ = __str__


def select_row(rows: Iterable[Candidate]) -> Selection[Candidate]:
    """Select the smallest row within one standard error of the lowest error.

    Ties go to the lower error, then to the earlier row. Where every row has a diverged replay, it
    counts as the mean of the log from its divergence on.
    """
    requested = list(rows)
    scored = [(row, row.blocks) for row in requested if row.blocks is not None]
    if not scored:
        raise MethodError("no row has an RMS error: nothing was fitted")
    best = min(_defects(row) for row, _ in scored)
    candidates = [pair for pair in scored if _defects(pair[0]) == best]
    ranked = sorted(candidates, key=lambda pair: (pair[1].rms, pair[0].n_coefficients))
    lowest = ranked[0][1]
    equivalent = [pair for pair in ranked if pair[1].is_equivalent(lowest)]
    row, errors = min(equivalent, key=lambda pair: _complexity(pair[0]))
    order = tuple(each for each, _ in ranked)
    below = [each for each, blocks in scored if each.divergences and blocks.rms < errors.rms]
    caveat = " ".join(_caveats(row, below, len(requested) - len(candidates)))
    equal = tuple(each for each, _ in equivalent if each is not row)
    return Selection(row, errors, order, equal, _sentence(row, order, len(requested)), caveat)


def _defects(row: Ranked) -> tuple[bool, bool]:
    """Return what ranks a row below others whatever their errors, the worse first."""
    return bool(row.divergences), not row.converged


def _complexity(row: Ranked) -> tuple[int, int]:
    """Return what decides between equivalent rows, in order."""
    return row.n_coefficients, -(count_determined(row.grades) or 0)


def _sentence(row: Ranked, ranked: Sequence[Ranked], n_rows: int) -> str:
    """Give the reason for the selected row, and the margin to the runner-up."""
    if n_rows == 1:
        return f"{row_text(row)}, the only row."
    lowest = ranked[0]
    if row is not lowest:
        return (
            f"{row_text(row)}: fewest coefficients ({row.n_coefficients}) within one standard "
            f"error of the lowest RMS error, {row_text(lowest)} with {lowest.n_coefficients}."
        )
    if len(ranked) == 1:
        return f"{row_text(row)}: the others are excluded."
    errors = [each.blocks.rms for each in ranked[:2] if each.blocks is not None]
    excess = f", {100.0 * (errors[1] / errors[0] - 1.0):+.0f} %" if errors[0] else ""
    return (
        f"{row_text(row)}: lowest RMS error of {_replays(len(ranked))}; runner-up "
        f"{row_text(ranked[1])}{excess}."
    )


def _caveats(row: Ranked, below: Sequence[Ranked], n_excluded: int) -> Iterable[str]:
    """Yield what limits a selection; ``below`` are the diverged rows of lower error."""
    if not row.converged:
        yield "The selected fit has not converged."
    if row.divergences:
        yield f"It diverged in {'; '.join(row.divergences)}; no replay ended."
    else:
        yield from (
            f"{row_name(each)} diverged in {'; '.join(each.divergences)}." for each in below
        )
    if n_excluded:
        yield f"Excluded: {_replays(n_excluded)} that diverged, failed or did not converge."


class Table(Protocol[Candidate_co]):
    """A comparison or cross-validation: rows that can be ranked."""

    @property
    def rows(self) -> tuple[Candidate_co, ...]:
        """Its rows."""


def pareto_front(table: Table[Candidate]) -> tuple[Candidate, ...]:
    """Return the Pareto front of RMS error and number of coefficients.

    Parameters
    ----------
    table : Comparison or CrossValidation
        Rows without an RMS error are excluded.

    Returns
    -------
    rows : tuple of Row
        From the fewest coefficients to the lowest error; each has more coefficients
        and a lower error than the one before. Of equal rows the first is included.

    Examples
    --------
    >>> from hydrodamp.validation.compare import Comparison
    >>> pareto_front(Comparison(()))
    ()
    """
    scored = [row for row in table.rows if row.rms is not None]
    front: list[Candidate] = []
    for row in sorted(scored, key=lambda row: (row.n_coefficients, rms_or_infinity(row))):
        if not front or rms_or_infinity(row) < rms_or_infinity(front[-1]):
            front.append(row)
    return tuple(front)


def rms_or_infinity(row: Ranked) -> float:
    """Return the RMS error of a row, infinite where there is none."""
    return float("inf") if row.rms is None else row.rms


def row_name(row: Ranked) -> str:
    """Return model and method of a row."""
    return f"{row.model} by {row.method}"


def row_text(row: Ranked) -> str:
    """Return model, method and error of a row with its standard error."""
    name, errors = row_name(row), row.blocks
    if row.divergences:
        return f"{name} ({Status.DIVERGED.word})"
    return name if errors is None else f"{name} ({errors.rms:.3g}{margin(errors.standard_error)})"


def margin(standard_error: float | None) -> str:
    """Return a standard error as text behind its value; empty where unknown."""
    return "" if standard_error is None else f" ± {standard_error:.2g}"


def _replays(count: int) -> str:
    return "1 replay" if count == 1 else f"{count} replays"
