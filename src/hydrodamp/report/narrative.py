"""Remarks on a comparison in plain sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from hydrodamp.data.intervals import ALL_TEST_DATA
from hydrodamp.identification.adequacy import Form
from hydrodamp.status import Status
from hydrodamp.validation.compare import Comparison, Row, is_paper_campaign
from hydrodamp.validation.cross_validation import ValidatedRow
from hydrodamp.validation.diagnostics import replay_warnings
from hydrodamp.validation.workflow import UNFINISHED

#: Data of a comparison whose test data are training data.
TRAINING_DATA = "training data"


def explain_failure(comparison: Comparison) -> tuple[str, str]:
    """Return why no fit can be recommended, where none has a replay, and what to do."""
    outcomes = ", ".join(dict.fromkeys(row.status.word for row in comparison.rows)) or "no rows"
    return (
        f"No model can be recommended: none of {len(comparison.rows)} fits has a replay "
        f"(outcomes: {outcomes}).",
        "Try models with fewer terms, another method, or a log with richer excitation.",
    )


def describe_data(comparison: Comparison) -> str:
    """Return which data the errors of a comparison are of."""
    if comparison.overlap == ALL_TEST_DATA:
        return TRAINING_DATA
    return "test data, partly training data" if comparison.overlap else "test data"


def remarks(comparison: Comparison) -> Iterator[str]:
    """Yield all notes on a comparison."""
    yield from limits(comparison)
    yield from replay_warnings(comparison)
    yield from status_remarks(comparison, [status for status in Status if status.usable])
    yield f"Open-loop replay, eq. 24; lower is better. Attitude {comparison.attitude}."


def limits(comparison: Comparison) -> Iterator[str]:
    """Yield the notes on missing rows and on the forms of several models."""
    provenance = comparison.provenance
    if missing := provenance.get(UNFINISHED):
        yield f"Incomplete comparison ({missing}): a missing row may be better than these."
    if is_paper_campaign(comparison):
        yield "paper: Table I as printed; the paper's log was never published."
    yield from status_remarks(comparison, [status for status in Status if not status.usable])
    yield from describe_forms(comparison.rows)


def describe_forms(rows: Sequence[Row | ValidatedRow]) -> Iterator[str]:
    """Yield which of several models score tests find adequate, effective and inadequate."""
    known = [(row.model, row.adequacy.form) for row in rows if row.adequacy and len(rows) > 1]
    models = {form: dict.fromkeys(model for model, each in known if each is form) for form in Form}
    clauses = [f"{form.word} {', '.join(names)}" for form, names in models.items() if names]
    if clauses:
        yield f"Forms by score tests: {'; '.join(clauses)}."


def status_remarks(comparison: Comparison, statuses: Iterable[Status]) -> Iterator[str]:
    """Yield outcomes but success and divergence, with their rows."""
    for status in statuses:
        if status in (Status.OK, Status.DIVERGED):
            continue
        rows = [row for row in comparison.rows if row.fit.status is status]
        if rows:
            mark = "~ " if status is Status.NOT_CONVERGED else ""
            yield f"{mark}{status.value} {describe_rows(comparison, rows)}"
        if status is Status.REFUSED:
            yield from (f"{row.model} by {row.method}: {' '.join(row.fit.remarks)}" for row in rows)


def describe_rows(comparison: Comparison, rows: list[Row]) -> str:
    """Return models by method; "every model" where a method has no other row."""
    total, matching = (Counter(row.method for row in group) for group in (comparison.rows, rows))
    texts = []
    for method, count in matching.items():
        models = ", ".join(row.model for row in rows if row.method == method)
        is_every = count > 1 and count == total[method]
        texts.append(f"{method}: {'every model' if is_every else models}")
    return f"[{'; '.join(texts)}]"
