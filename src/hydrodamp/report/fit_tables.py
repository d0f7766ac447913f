"""The tables of one fit and of damping models, and a model as a document."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.errors import demand, first_few
from hydrodamp.files import load_json
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import (
    MAX_RELATIVE_HALF_WIDTH,
    MINOR_CONTRIBUTION,
    Cause,
    Grade,
    critical_value,
)
from hydrodamp.identification.identifiability import Identifiability
from hydrodamp.models.model import DampingModel
from hydrodamp.report.table import FORMATS, Column, Table, coefficient
from hydrodamp.validation.compare import Comparison
from hydrodamp.validation.diagnostics import correlated_pairs

MAX_BRIEF_ROWS = 8  # coefficients on screen; `--verbose` shows all
MAX_GROUPS = 12  # groups of aliased coefficients listed; the file has all
GRADE_SOURCE = (
    "grade: by the interval of this fit, and by the weak form where its method does not replay."
)
GRADE_DEFINITIONS = {
    Grade.DETERMINED: f"interval within {100.0 * MAX_RELATIVE_HALF_WIDTH:.0f} % of the value",
    Grade.MINOR: "its uncertainty is below "
    f"{100.0 * MINOR_CONTRIBUTION:.0f} % of the response of its axis",
    Grade.WEAK: "only the sign is known",
    Grade.NOT_DETERMINED: "for the cause given",
}
MIN_CORRELATION = 0.9  # of two coefficients that are listed as known in combination only
#: Documents of the models whose terms depend on a log.
LOG_MODELS: Any = load_json(Path(__file__).with_name("log_models.json"))


def fit_table(fit: Fit, grades: Identifiability | None = None) -> Table:
    """Return the coefficients of a fit with their uncertainty, grades and aliases."""
    model, grade_column = fit.model, grade_words(fit, grades)
    numeric = (Column(name, form=coefficient) for name in ("value", "std. error", "± 95 %"))
    columns = [Column("coefficient", number=False), *numeric, Column("unit", number=False)]
    if grade_column:
        columns.append(Column("grade" if fit.grades or grades else "aliased", number=False))
    numbers = fit.damping.coefficients.tolist(), standard_errors(fit), half_widths(fit)
    texts = [model.units, grade_column] if grade_column else [model.units]
    rows = zip(model.labels, *numbers, *texts, strict=True)
    rank = "" if fit.rank is None else f", rank {fit.rank}"
    graded = (
        ()
        if grades is None
        else (grades.summary + ".", define_grades(grades.grades.values()), *_causes(fit, grades))
    )
    title = f"{model.title} by {fit.method}: {model.n_coefficients} coefficients{rank}, "
    notes = *fit.summary_lines, *_aliased(fit), *graded
    return Table(f"{title}{fit.n_samples} samples", tuple(columns), tuple(rows), notes)


def format_coefficients(subject: Fit | Comparison, form: str = "text") -> str:
    """Return the coefficients of a fit, or of the fits of a comparison, with 95 % intervals.

    Parameters
    ----------
    subject : Fit or Comparison
        A fit gives a row for each coefficient, with standard error, unit and grade; a comparison
        gives the value and the half-width of the interval of each fit side by side.
    form : {"text", "markdown", "latex", "csv"}
        LaTeX has the rules of the booktabs package; CSV has full precision.

    Returns
    -------
    text : str
        The table.

    Raises
    ------
    MethodError
        If the form is unknown.

    Examples
    --------
    >>> from hydrodamp.models.damping import Damping
    >>> from hydrodamp.status import Status
    >>> fit = Fit(Damping.from_dict(None, {"X_u": -2.0}), "ls", Status.OK)
    >>> print(format_coefficients(fit, "csv").splitlines()[1])
    X_u,-2.0,nan,nan,N/(m/s)
    """
    demand(form in FORMATS, "form", " or ".join(FORMATS), form)
    return FORMATS[form](fit_table(subject) if isinstance(subject, Fit) else _side_by_side(subject))


def _side_by_side(comparison: Comparison) -> Table:
    """Return the coefficients of the fits of a comparison, two columns for each."""
    fits = [row.fit for row in comparison.rows if row.fit.status.usable]
    units = {k: v for fit in fits for k, v in zip(fit.model.labels, fit.model.units, strict=True)}
    cells: dict[str, list[object]] = {label: [label, unit] for label, unit in units.items()}
    columns = [Column("coefficient", number=False), Column("unit", number=False)]
    for fit in fits:
        name = f"{fit.model.key} {fit.method}"
        pairs = zip(fit.damping.coefficients.tolist(), half_widths(fit).tolist(), strict=True)
        numbers = dict(zip(fit.model.labels, pairs, strict=True))
        columns += [Column(name, form=coefficient), Column("±", form=coefficient, key=f"{name} ±")]
        for label, row in cells.items():
            row += numbers.get(label, (None, None))
    rows = tuple(map(tuple, cells.values()))
    return Table("Coefficients with the half-widths of 95 % intervals", tuple(columns), rows)


def brief_fit_table(fit: Fit) -> Table:
    """Return the best determined coefficients of a fit, few enough for a screen."""
    order = [Grade.DETERMINED.word, Grade.WEAK.word, Grade.MINOR.word]
    table = fit_table(fit)
    columns = (*table.columns[:5], Column("grade", number=False))
    rows = [
        (*row[:5], grade.word)
        for row, grade in zip(table.rows, fit.grades.values(), strict=True)
        if grade is not Grade.NOT_DETERMINED
    ]
    rows.sort(key=lambda row: order.index(str(row[5])))
    listed = tuple(rows[:MAX_BRIEF_ROWS])
    n_hidden = fit.model.n_coefficients - len(listed)
    more = (f"{n_hidden} more coefficients: `--verbose`.",) if n_hidden else ()
    title = "Best determined coefficients"
    if fit.adequacy is not None and fit.adequacy.missing:
        title += f"; terms are missing on {' '.join(fit.adequacy.missing)}: weak at best there"
    return Table(title, columns, listed, more)


def standard_errors(fit: Fit) -> FloatArray:
    """Return the standard error of each coefficient, NaN where unknown."""
    covariance = fit.damping.covariance
    if covariance is None:
        return np.full(fit.model.n_coefficients, np.nan)
    with np.errstate(invalid="ignore"):
        return np.sqrt(covariance.diagonal())


def half_widths(fit: Fit) -> FloatArray:
    """Return half the width of the 95 % interval of each coefficient, NaN where unknown."""
    times = critical_value() if fit.uncertainty is None else fit.uncertainty.critical_value()
    return times * standard_errors(fit)


def grade_words(fit: Fit, grades: Identifiability | None) -> list[str]:
    """Return the grade of each coefficient, or else whether it is aliased; none if unknown."""
    if grades is None and fit.grades:
        return [fit.grades[label].word for label in fit.model.labels]
    if grades is None:
        aliased = {label for group in fit.aliased for label in group}
        labels = () if fit.rank is None else fit.model.labels
        return ["yes" if label in aliased else "no" for label in labels]
    causes = {label: f": {cause.word}" for label, cause in grades.causes.items()}
    return [f"{grade.word}{causes.get(label, '')}" for label, grade in grades.grades.items()]


def define_grades(grades: Iterable[Grade]) -> str:
    """Return the meaning of these grades."""
    present = {*grades}
    texts = [
        f"{grade.word}, {text}" for grade, text in GRADE_DEFINITIONS.items() if grade in present
    ]
    return f"{GRADE_SOURCE} {'; '.join(texts).capitalize()}." if texts else GRADE_SOURCE


def _causes(fit: Fit, grades: Identifiability) -> Iterator[str]:
    """Yield the meaning of each cause, and which open coefficients are strongly correlated."""
    causes = set(grades.causes.values())
    yield from (cause.value for cause in Cause if cause in causes)
    is_open = [
        grade is Grade.WEAK or grades.causes.get(label) is Cause.NOT_SIGNIFICANT
        for label, grade in grades.grades.items()
    ]
    pairs = [
        f"{first} with {second} ({value:.2f})"
        for first, second, value in correlated_pairs(fit, is_open, MIN_CORRELATION)
    ]
    if pairs:
        few = ", ".join(first_few(pairs, MAX_GROUPS, "such pairs"))
        yield f"Correlation of at least {MIN_CORRELATION}, so only known in combination: {few}."


def _aliased(fit: Fit) -> list[str]:
    groups = [
        f"{group[0]} is not determined: its regressor is zero or a combination of others"
        if len(group) == 1
        else f"aliased, only a combination is determined: {' '.join(group)}"
        for group in fit.aliased
    ]
    return first_few(groups, MAX_GROUPS, "such groups")


def model_document(model: DampingModel) -> dict[str, Any]:
    """Return a model as a document."""
    terms = zip(AXES, model.terms, strict=True)
    return {
        "model": model.key,
        "title": model.title,
        "n_coefficients": model.n_coefficients,
        "terms": {axis: [str(term) for term in row] for axis, row in terms},
        "commands": list(model.commands),
        "source": model.source,
        "note": model.note,
    }


def model_table(models: Iterable[Mapping[str, Any]], command: str) -> Table:
    """Return documents of models with how many terms they have on which axis."""
    rows, notes = [], [f"`{command}` shows the terms of a model."]
    for document in models:
        counts: Iterable[int | None] = [None] * len(AXES)
        if document["terms"] is None:
            notes.insert(0, document["note"])
        else:
            counts = map(len, document["terms"].values())
        rows.append((document["model"], document["n_coefficients"], *counts, document["title"]))
    return Table.of_words("Damping models", ("name", "n", *AXES, "title"), "lrrrrrrrl", rows, notes)
