"""Verdict and remarks on a comparison in plain sentences: the answer first, then the evidence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from hydrodamp.basis.term import AXES
from hydrodamp.identification.identifiability import Grade, Identifiability
from hydrodamp.status import Status
from hydrodamp.validation.compare import Comparison, Row, is_paper_campaign
from hydrodamp.validation.diagnostics import replay_warnings

#: Key in the provenance of an incomplete comparison; its value says how many rows there are.
UNFINISHED = "unfinished"

#: Key in the provenance of a comparison that reuses fits of an earlier run; how many.
RESUMED = "resumed"

MAX_LABELS = 8  # coefficients listed by name; beyond, their number by axis


def verdict(comparison: Comparison, grades: Identifiability | None = None) -> tuple[str, ...]:
    """Return which fit to use, its accuracy, and which coefficients are determined."""
    if all(row.rms is None for row in comparison.rows):
        outcomes = ", ".join(dict.fromkeys(row.status.word for row in comparison.rows)) or "no rows"
        return (
            f"No model can be recommended: none of {len(comparison.rows)} fits has an RMS error "
            f"(outcomes: {outcomes}).",
            "Try models with fewer terms, another method, or a log with richer excitation.",
        )
    choice = comparison.select()
    identifiability = (
        f"Identifiability of the {choice.row.n_coefficients} coefficients was not graded; the "
        "tables give standard errors where they are known."
    )
    if grades is not None:
        identifiability = f"{'; '.join(describe_grades(grades))}."
    selected = str(choice) if len(comparison.rows) == 1 else f"Use {choice}"
    return (selected, describe_accuracy(comparison, choice.row), identifiability)


def describe_accuracy(comparison: Comparison, row: Row) -> str:
    """Return the RMS error of a row and the range of its fit percentages."""
    shares = {name: value for name, value in row.score.fit_by_axis.items() if value is not None}
    overlap = comparison.provenance.get("overlap")
    data = f"data that share {overlap} with the training data" if overlap else "test data"
    error = (
        f"RMS error {row.rms:.3g} (m/s and {comparison.rate_unit}/s mixed) in open-loop replay of "
        f"{data}"
    )
    if not shares:
        return f"{error}."
    worst, best = min(shares, key=shares.__getitem__), max(shares, key=shares.__getitem__)
    return (
        f"{error}; fit between {shares[worst]:.0f} % ({worst}) and {shares[best]:.0f} % ({best}), "
        "where 100 % is exact and 0 % is as good as the mean of the data."
    )


def describe_grades(identifiability: Identifiability) -> Iterator[str]:
    """Yield how many coefficients are determined, and which are not."""
    n = len(identifiability.grades)
    n_determined = len(identifiability.labels_with(Grade.DETERMINED))
    yield f"The data determine {n_determined or 'none'} of {n} coefficients"
    for grade in tuple(Grade)[1:]:
        if labels := list(identifiability.labels_with(grade)):
            yield f"{len(labels)} {grade.word} ({list_labels(labels)})"
    poor = [axis for axis in identifiability.axes if not axis.excited]
    if poor:
        shares = ", ".join(f"{axis.axis} {100.0 * axis.r_squared:.0f} %" for axis in poor)
        yield (
            "poorly predicted axes (cross-validated share of the response), for lack of "
            f"excitation or of terms: {shares}"
        )


def list_labels(labels: list[str]) -> str:
    """Return a few labels; of more, their number by axis."""
    if len(labels) <= MAX_LABELS:
        return ", ".join(labels)
    count = Counter(label.partition("_")[0] for label in labels)
    return ", ".join(f"{axis} {count[axis]}" for axis in AXES if count[axis])


def remarks(comparison: Comparison) -> Iterator[str]:
    """Yield the notes below the table of a comparison."""
    provenance = comparison.provenance
    if missing := provenance.get(UNFINISHED):
        yield f"Incomplete comparison ({missing}): a missing row may be better than these."
    if overlap := provenance.get("overlap"):
        yield f"Training and test data share {overlap}: errors on training data are optimistic."
    if is_paper_campaign(comparison):
        yield "paper: Table I as printed; the paper's log was never published."
    yield from replay_warnings(comparison)
    yield from status_remarks(comparison)
    yield from _axes_worse_than_mean(comparison)
    yield f"Open-loop replay, eq. 24; lower is better. Attitude {comparison.attitude}."


def _axes_worse_than_mean(comparison: Comparison) -> Iterator[str]:
    if all(row.rms is None for row in comparison.rows):
        return
    fits = comparison.select().row.score.fit_by_axis
    if worse := [name for name, fit in fits.items() if fit is not None and fit < 0.0]:
        yield (
            f"The selected model predicts {' '.join(worse)} worse than the mean of the test data "
            "(fit below 0 %)."
        )


def status_remarks(comparison: Comparison) -> Iterator[str]:
    """Yield every outcome but success and divergence, with its rows."""
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
    """Return models by method; "every model" where a method has no other row."""
    total, matching = (Counter(row.method for row in group) for group in (comparison.rows, rows))
    texts = []
    for method, count in matching.items():
        models = ", ".join(row.model for row in rows if row.method == method)
        is_every = count > 1 and count == total[method]
        texts.append(f"{method}: {'every model' if is_every else models}")
    return f"[{'; '.join(texts)}]"
