"""Selection of a fit from several by their errors on held-out data.

A row with a diverged replay ranks below every row without one, then a row that has not converged
below those that have. Of the best of these classes the rows are equal for use whose relative error
of every velocity is within a quarter of that of the row of least mean, or within one jackknife
standard error of the difference over blocks of the held-out data (Breiman et al., 1984); of these
the rows of adequate form, if there are any, of these the rows that predict the most velocities
significantly better than their mean, of these the row with the fewest coefficients is selected,
then that of least error. The relative error is the mean, over the velocities that training and test
excite, of the RMS error over the standard deviation of the velocity, without the noise: it does not
depend on units. Equation 24 mixes units and decides nothing.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from hydrodamp.errors import MethodError
from hydrodamp.identification.adequacy import Adequacy, Form
from hydrodamp.identification.grades import Grade, count_determined, critical_value
from hydrodamp.simulation.block_errors import BlockErrors
from hydrodamp.status import Status

#: One-sided confidence that the fit is above zero, by Student's t over the blocks.
CONFIDENCE = 0.95


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
    def adequacy(self) -> Adequacy | None:
        """What score tests say of the form of the model; None without tests."""

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
        That of fewest coefficients among those equal for use to the least relative error, of
        adequate form if any is, that predict the most velocities.
    errors : BlockErrors
        Those of the selected row.
    velocities : tuple of str
        Those that count: the test excites them.
    ranked : tuple of Row
        The rows that could be selected, from the least relative error.
    equivalent : tuple of Row
        The other rows that are equal for use to the least relative error.
    sentence : str
        The selected row, the reason, and the margin to the runner-up.
    caveat : str
        Rows that were excluded, and replays that diverged; empty for none.
    """

    row: Candidate
    errors: BlockErrors
    velocities: tuple[str, ...]
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


def select_row(rows: Iterable[Candidate], untested: Collection[str] = ()) -> Selection[Candidate]:
    """Select the smallest row of those that are equal for use to the least relative error.

    Of the equal rows only those of adequate form count, if there are any, and of these those that
    predict the most velocities. Velocities that the test does not excite do not count, nor do those
    in ``untested``, unless none is left. Ties go to the lower error, then to more determined
    coefficients, then to the earlier row. Where every row has a diverged replay, it counts as the
    mean of the log from its divergence on.
    """
    requested = list(rows)
    scored = [(row, row.blocks) for row in requested if row.blocks is not None]
    if not scored:
        raise MethodError("no row has a replay: nothing was fitted")
    excited = scored[0][1].excited
    names = tuple(name for name in excited if name not in untested) or excited or scored[0][1].names
    best = min(_defects(row) for row, _ in scored)
    candidates = [pair for pair in scored if _defects(pair[0]) == best]

    def error(pair: tuple[Candidate, BlockErrors]) -> float:
        return pair[1].relative_error(names)

    ranked = sorted(candidates, key=lambda pair: (error(pair), *_complexity(pair[0])))
    lowest = ranked[0][1]
    equivalent = [pair for pair in ranked if pair[1].is_equivalent(lowest, names)]
    suitable = [pair for pair in equivalent if _is_adequate(pair[0])] or equivalent
    missed = [len(insignificant_fits(blocks).intersection(names)) for _, blocks in suitable]
    predicting = [pair for pair, n in zip(suitable, missed, strict=True) if n == min(missed)]
    row, errors = selected = min(predicting, key=lambda pair: pair[0].n_coefficients)
    is_smallest = row.n_coefficients == min(each.n_coefficients for each, _ in suitable)
    below = [pair[0] for pair in scored if pair[0].divergences and error(pair) < error(selected)]
    caveat = " ".join(_caveats(row, below, len(requested) - len(candidates)))
    order = tuple(each for each, _ in ranked)
    equal = tuple(each for each, _ in equivalent if each is not row)
    merits = ["are equal for use"]
    merits += ["have an adequate form"] if len(suitable) < len(equivalent) else []
    merits += [] if is_smallest else ["predict the most velocities"]
    use = " and ".join((", ".join(merits[:-1]), merits[-1]) if merits[1:] else merits)
    sentence = _sentence(row, order, len(requested), names, use)
    return Selection(row, errors, names, order, equal, sentence, caveat)


def _defects(row: Ranked) -> tuple[bool, bool]:
    """Return what ranks a row below others whatever their errors, the worse first."""
    return bool(row.divergences), not row.converged


def _is_adequate(row: Ranked) -> bool:
    """Whether score tests find the form of the model adequate."""
    return row.adequacy is not None and row.adequacy.form is Form.ADEQUATE


def _complexity(row: Ranked) -> tuple[int, int]:
    """Return what decides between rows of equal error, in order."""
    return row.n_coefficients, -(count_determined(row.grades) or 0)


def significant_fits(errors: BlockErrors) -> dict[str, float]:
    """Return the least fit [%] of each velocity that is significantly above that of its mean."""
    critical = critical_value(2.0 * CONFIDENCE - 1.0, max(errors.n - 1, 1))
    deviations = errors.standard_error_by_axis
    return {name: critical * (deviation or 0.0) for name, deviation in deviations.items()}


def insignificant_fits(errors: BlockErrors) -> set[str]:
    """Return the velocities that are not predicted significantly better than by their mean."""
    least = significant_fits(errors)
    fits = errors.fit_by_axis.items()
    return {name for name, fit in fits if fit is None or fit <= least[name]}


def _sentence(
    row: Ranked, ranked: Sequence[Ranked], n_rows: int, names: Collection[str], use: str
) -> str:
    """Give the reason for the selected row, and the margin to the runner-up."""
    text, lowest = f"{describe_error(row, names)} of the motion", ranked[0]
    if n_rows == 1:
        return f"{row_name(row)} is the only row: error {text}."
    if row is not lowest:
        return (
            f"{row_name(row)} has the fewest coefficients, {row.n_coefficients}, of the models "
            f"that {use}: error {text}; least {describe_error(lowest, names)} by "
            f"{lowest.n_coefficients} coefficients, {row_name(lowest)}."
        )
    if len(ranked) == 1:
        return f"{row_name(row)}: the others are excluded; error {text}."
    second = ranked[1]
    return (
        f"{row_name(row)} has the least error of {_replays(len(ranked))}, {text}; second is "
        f"{row_name(second)}, {describe_error(second, names)}."
    )


def _caveats(row: Ranked, below: Sequence[Ranked], n_excluded: int) -> Iterable[str]:
    """Yield what limits a selection; ``below`` are the diverged rows of lower error."""
    if not row.converged:
        yield "The selected fit has not converged."
    if row.divergences:
        yield f"It diverged in {_first(row.divergences)}; no replay ended."
    elif below:
        texts = [f"{row_name(each)} diverged in {_first(each.divergences)}" for each in below]
        yield f"{_first(texts)}."
    if n_excluded:
        yield f"Excluded: {_replays(n_excluded)} that diverged, failed or did not converge."


def _first(texts: Sequence[str]) -> str:
    """Return the first text and the number of the others."""
    return texts[0] + (f" (and {len(texts) - 1} more)" if len(texts) > 1 else "")


class Table(Protocol[Candidate_co]):
    """A comparison or cross-validation: rows that can be ranked."""

    @property
    def rows(self) -> tuple[Candidate_co, ...]:
        """Its rows."""

    def select(self) -> Selection[Any]:
        """Select a row."""


def pareto_front(table: Table[Candidate]) -> tuple[Candidate, ...]:
    """Return the Pareto front of relative error and number of coefficients.

    Parameters
    ----------
    table : Comparison or CrossValidation
        Rows without an error are excluded.

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
    pairs = list(zip(table.rows, relative_errors(table), strict=True))
    front, least = list[Candidate](), math.inf
    for row, error in sorted(pairs, key=lambda pair: (pair[0].n_coefficients, pair[1])):
        if error < least:
            front.append(row)
            least = error
    return tuple(front)


def relative_errors(table: Table[Candidate]) -> tuple[float, ...]:
    """Return the relative error of each row [%], infinite without a replay that ended."""
    if all(row.rms is None for row in table.rows):
        return (math.inf,) * len(table.rows)
    names = table.select().velocities
    return tuple(
        math.inf
        if row.rms is None or row.blocks is None
        else relative_percent(row.blocks, names)[0]
        for row in table.rows
    )


def row_name(row: Ranked) -> str:
    """Return model and method of a row."""
    return f"{row.model} by {row.method}"


def describe_error(row: Ranked, names: Collection[str]) -> str:
    """Return the relative error of a row with its standard error."""
    if row.divergences or row.blocks is None:
        return Status.DIVERGED.word
    error, deviation = relative_percent(row.blocks, names)
    return f"{error:.3g}{margin(deviation)} %"


def relative_percent(errors: BlockErrors, names: Collection[str]) -> tuple[float, float | None]:
    """Return the relative error and its standard error [%]."""
    deviation = errors.relative_standard_error(names)
    error = 100.0 * errors.relative_error(names)
    return error, None if deviation is None else 100.0 * deviation


def row_text(row: Ranked) -> str:
    """Return model and method of a row with equation 24 and its standard error."""
    name, errors = row_name(row), row.blocks
    if row.divergences:
        return f"{name} ({Status.DIVERGED.word})"
    return name if errors is None else f"{name} ({errors.rms:.3g}{margin(errors.standard_error)})"


def margin(standard_error: float | None) -> str:
    """Return a standard error as text behind its value; empty where unknown or zero."""
    return f" ± {standard_error:.2g}" if standard_error else ""


def _replays(count: int) -> str:
    return "1 replay" if count == 1 else f"{count} replays"
