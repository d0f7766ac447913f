"""What a reader of a comparison must know beside its numbers, in sentences."""

from __future__ import annotations

from collections.abc import Iterator

from hydrodamp.report.numbers import seconds
from hydrodamp.simulation.status import Status
from hydrodamp.validation.comparison import Comparison, Row
from hydrodamp.validation.paper import beside_paper, rank_correlation

#: Key in the provenance of a comparison that lacks rows; its value says how many.
UNFINISHED = "unfinished"


def remarks(comparison: Comparison) -> tuple[str, ...]:
    """Return the sentences that stand below the table of a comparison."""
    return (
        *_unfinished(comparison),
        *_overlap(comparison),
        *_chosen(comparison),
        *_likeness(comparison),
        *_diverged(comparison),
        *_outcomes(comparison),
        *_refused(comparison),
        f"Open-loop replay, eq. 24; lower is better. Attitude {comparison.attitude}.",
    )


def _unfinished(comparison: Comparison) -> Iterator[str]:
    if lacking := comparison.provenance.get(UNFINISHED):
        yield f"Unfinished, {lacking}. What is missing may be better than what is here."


def _overlap(comparison: Comparison) -> Iterator[str]:
    if shared := comparison.provenance.get("overlap"):
        yield (
            f"Training and test data share {shared}: errors on data that were fitted say little."
        )


def _chosen(comparison: Comparison) -> Iterator[str]:
    """Say which row has the lowest error and which is next; what was left out is said below."""
    if any(row.rms is not None for row in comparison.rows):
        so_far = "So far " if UNFINISHED in comparison.provenance else ""
        yield f"{so_far}{comparison.choice().sentence}"


def _likeness(comparison: Comparison) -> Iterator[str]:
    """Say how like Table I each method orders the models."""
    if not beside_paper(comparison):
        return
    likeness = [(method, rank_correlation(comparison, method)) for method in comparison.methods]
    words = [f"{method} {rho:+.2f}" for method, rho in likeness if rho is not None]
    if words:
        yield (
            f"Rank correlation with the paper's order: {', '.join(words)} "
            "(+1 same order, 0 none, -1 reversed; diverged ranks last)."
        )
    yield "paper: Table I as printed; the paper's own log was never published."


def _diverged(comparison: Comparison) -> Iterator[str]:
    for method in comparison.methods:
        rows = [row for row in comparison.rows if row.method == method and row.score.diverged]
        if rows:
            yield f"diverged by {method}: {'; '.join(map(divergence, rows))}."


def divergence(row: Row) -> str:
    """Return where and when a row's replay diverged."""
    where = ", ".join(f"{name} after {seconds(time)}" for name, time in row.score.diverged)
    return f"{row.model} (in {where})"


def _outcomes(comparison: Comparison) -> Iterator[str]:
    """Name the rows of every other outcome, then the sentence of that outcome."""
    for status in Status:
        if status in (Status.OK, Status.DIVERGED):
            continue
        rows = [row for row in comparison.rows if row.fit.status is status]
        if rows:
            mark = "~ " if status is Status.NOT_SETTLED else ""
            yield f"{mark}{status.value} {_named(comparison, rows)}"


def _refused(comparison: Comparison) -> Iterator[str]:
    for row in comparison.rows:
        if row.status is Status.REFUSED:
            yield f"{row.model} by {row.method}: {' '.join(row.fit.remarks)}"


def _named(comparison: Comparison, rows: list[Row]) -> str:
    """Return models by method; all models of a method in two words."""
    words = []
    for method in dict.fromkeys(row.method for row in rows):
        models = [row.model for row in rows if row.method == method]
        every = len(models) > 1 and len(models) == len(
            [row for row in comparison.rows if row.method == method]
        )
        words.append(f"{method}: {'every model' if every else ', '.join(models)}")
    return f"[{'; '.join(words)}]"
