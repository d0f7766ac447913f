"""What is said of a comparison in sentences: the verdict, and remarks beside the numbers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from hydrodamp.basis.atoms import AXES
from hydrodamp.identification.identifiability import Grade, Identifiability
from hydrodamp.identification.operating_range import (
    energy_injection_warnings,
    join_ranges,
    range_exceedance_warnings,
    velocity_ranges,
)
from hydrodamp.simulation.status import Status
from hydrodamp.validation.compare import Comparison, Row, is_paper_campaign

#: Key in the provenance of a comparison that lacks rows; its value says how many.
UNFINISHED = "unfinished"

#: Key in the provenance of a comparison that goes on with fits of an earlier run; how many.
RESUMED = "resumed"

_NAMED = 8  # coefficients that are named; of more, the number by axis


def verdict(comparison: Comparison, grades: Identifiability | None = None) -> tuple[str, ...]:
    """Return which fit to take, how good it is, and which coefficients are not known."""
    if all(row.rms is None for row in comparison.rows):
        outcomes = ", ".join(dict.fromkeys(row.status.word for row in comparison.rows)) or "no rows"
        return (
            f"No model can be recommended: none of {len(comparison.rows)} fits has an RMS error; "
            f"the outcomes are: {outcomes}.",
            "Try models with fewer terms, another method, or a log with richer manoeuvres.",
        )
    choice = comparison.select()
    which = str(choice) if len(comparison.rows) == 1 else f"Take {choice}"
    how_known = (
        f"How well the log determines the {choice.row.n_coefficients} coefficients was not graded; "
        "the tables have their standard errors, where there are any."
    )
    if grades is not None:
        how_known = f"{'; '.join(describe_grades(grades))}."
    return (which, describe_accuracy(comparison, choice.row), how_known)


def describe_accuracy(comparison: Comparison, row: Row) -> str:
    shares = {name: value for name, value in row.score.fit_by_axis.items() if value is not None}
    shared = comparison.provenance.get("overlap")
    unseen = (
        f"data that share {shared} with the training data" if shared else "data it has not seen"
    )
    words = (
        f"Replayed open loop on {unseen}, it errs by {row.rms:.3g} "
        f"(RMS of m/s and {comparison.rate_unit}/s together)"
    )
    if not shares:
        return f"{words}."
    worst, best = min(shares, key=shares.__getitem__), max(shares, key=shares.__getitem__)
    return (
        f"{words}; its fit is {shares[worst]:.0f} % for {worst} at worst and {shares[best]:.0f} % "
        f"for {best} at best, where 100 % is exact and 0 % no better than the mean."
    )


def describe_grades(found: Identifiability) -> Iterator[str]:
    """Say how many coefficients are determined, and which are not."""
    n, sure = len(found.grades), len(found.labels_with(Grade.DETERMINED))
    if sure == n:
        yield f"The log determined all {n} coefficients of this model"
        return
    yield f"The log determined {sure or 'none'} of its {n} coefficients"
    for grade in tuple(Grade)[1:]:
        if labels := list(found.labels_with(grade)):
            yield f"{len(labels)} {grade.word}{list_labels(labels)}"
    quiet = [
        f"{axis.axis} {100.0 * axis.r_squared:.0f} %" for axis in found.axes if not axis.excited
    ]
    if quiet:
        yield (
            "axes whose force is not predicted at each moment, for want of motion or of the right "
            f"terms, whatever the replay sums up to (share): {', '.join(quiet)}"
        )


def list_labels(labels: list[str]) -> str:
    """Name a few; of more, say how many stand on each axis."""
    if len(labels) <= _NAMED:
        return f" ({', '.join(labels)})"
    count = Counter(label.partition("_")[0] for label in labels)
    return f" ({', '.join(f'{axis} {count[axis]}' for axis in AXES if count[axis])})"


def remarks(comparison: Comparison) -> Iterator[str]:
    """Yield the sentences that stand below the table of a comparison."""
    given = comparison.provenance
    if lacking := given.get(UNFINISHED):
        yield f"Unfinished, {lacking}. What is missing may be better than what is here."
    if shared := given.get("overlap"):
        yield f"Training and test data share {shared}: errors on data that were fitted say little."
    if is_paper_campaign(comparison):
        yield "paper: Table I as printed; the paper's own log was never published."
    yield from replay_remarks(comparison)
    yield from status_remarks(comparison)
    yield from _worse_than_none(comparison)
    yield f"Open-loop replay, eq. 24; lower is better. Attitude {comparison.attitude}."


def _worse_than_none(comparison: Comparison) -> Iterator[str]:
    if all(row.rms is None for row in comparison.rows):
        return
    fits = comparison.select().row.score.fit_by_axis
    if worse := [name for name, fit in fits.items() if fit is not None and fit < 0.0]:
        yield (
            f"The chosen model replays {' '.join(worse)} worse than no model: its fit there is "
            "below 0 %, that of the mean of the test data."
        )


def replay_remarks(comparison: Comparison) -> Iterator[str]:
    """Say where the test goes beyond the training, where replays diverged, and what damping fed."""
    scored = any(row.rms is not None for row in comparison.rows)
    chosen = comparison.select().row if scored else None
    tested: dict[str, tuple[float, float]] = {}
    for row in comparison.rows:
        if not tested and (run := row.trajectory) is not None:
            tested = velocity_ranges(run.log.velocity, run.axes)
            yield from range_exceedance_warnings(row.fit.training_range, tested)
        name = f"{row.model} by {row.method}"
        ranges = join_ranges(row.fit.training_range, tested)
        if row.score.divergence_text:
            feeds = energy_injection_warnings(row.fit.damping, ranges, "Its")
            yield " ".join((f"{name} diverged in {row.score.divergence_text}.", *feeds))
        elif row is chosen:
            yield from energy_injection_warnings(row.fit.damping, ranges, f"{name}: its")


def status_remarks(comparison: Comparison) -> Iterator[str]:
    """Say every other outcome in its sentence, with the rows that have it."""
    for status in Status:
        if status in (Status.OK, Status.DIVERGED):
            continue
        rows = [row for row in comparison.rows if row.fit.status is status]
        if rows:
            mark = "~ " if status is Status.NOT_CONVERGED else ""
            yield f"{mark}{status.value} {describe_rows(comparison, rows)}"
        if status is Status.REFUSED:
            yield from (f"{row.model} by {row.method}: {' '.join(row.fit.remarks)}" for row in rows)


def describe_rows(comparison: Comparison, rows: list[Row]) -> str:
    """Return models by method; all models of a method in two words."""
    all_of, of = (Counter(row.method for row in each) for each in (comparison.rows, rows))
    words = []
    for method, count in of.items():
        every = count > 1 and count == all_of[method]
        models = ", ".join(row.model for row in rows if row.method == method)
        words.append(f"{method}: {'every model' if every else models}")
    return f"[{'; '.join(words)}]"
