"""The tables of the study of coverage, from its rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from benchmark_tables import table
from consistency import measure
from hydrodamp.basis.term import AXES
from hydrodamp.identification.grades import MAX_RELATIVE_HALF_WIDTH, Grade

TRUE, PSEUDO_TRUE, WHOLE = "true", "pseudo-true", "whole"
"""Draws that are none: the targets of simulated logs, and an entire log."""

MEASURED = "measured"
"""Errors of measured logs."""

TARGETS = {TRUE: "truth", PSEUDO_TRUE: "pseudo-true value", MEASURED: "other half"}


class Row(NamedTuple):
    """What the default says of the coefficients of a model; empty where it fails."""

    log: str
    errors: str
    draw: str
    model: str
    labels: Sequence[str] = ()
    estimate: Sequence[float] = ()
    error: Sequence[float] = ()
    half: Sequence[float] = ()
    grades: Sequence[str] = ()
    bound: Sequence[Sequence[float]] = ()


class Outcome(NamedTuple):
    """One coefficient against its target."""

    case: tuple[str, str, str, str]
    draw: str
    label: str
    grade: str
    is_covered: bool
    is_near: bool


def compare_with_targets(rows: Sequence[Row]) -> Iterator[Outcome]:
    """Yield the outcomes of simulated draws, and those of pairs of halves."""
    targets = {row[:2] + row[3:4]: row for row in rows if row.draw in (TRUE, PSEUDO_TRUE)}
    halves = {row[:2] + row[3:4]: row for row in rows if row.draw == "1"}
    for row in rows:
        is_measured = row.errors == MEASURED
        if row.draw in TARGETS or row.draw == WHOLE or (is_measured and row.draw != "0"):
            continue
        other = (halves if is_measured else targets).get(row[:2] + row[3:4])
        if other is None or not row.labels or not other.labels:
            continue
        case = row.log, row.model, row.errors, TARGETS[MEASURED if is_measured else other.draw]
        miss = np.abs(np.subtract(row.estimate, other.estimate))
        half = np.array(row.half)
        if is_measured:
            half = 1.96 * np.hypot(row.error, other.error)
        near = miss <= MAX_RELATIVE_HALF_WIDTH * np.abs(other.estimate)
        grades = other.grades if is_measured else row.grades
        for k, label in enumerate(row.labels):
            if row.grades[k] == grades[k]:
                yield Outcome(
                    case, row.draw, label, row.grades[k], bool(miss[k] <= half[k]), bool(near[k])
                )


def share(some: Sequence[Outcome], values: Sequence[bool]) -> str:
    """Return a share in per cent with its standard error over draws."""
    draws = np.array([each.draw for each in some])
    deviation = np.array(values, dtype=float) - np.mean(values)
    sums = [deviation[draws == draw].sum() for draw in np.unique(draws)]
    error = f" ± {100 * np.sqrt(np.sum(np.square(sums))) / len(some):.1f}" if len(sums) > 1 else ""
    return f"{100 * np.mean(values):.1f}{error}"


def promise_table(outcomes: Sequence[Outcome]) -> str:
    """Return coverage by log, model, errors and grade."""
    lines = []
    for case in dict.fromkeys(each.case for each in outcomes):
        for grade in Grade:
            some = [each for each in outcomes if each.case == case and each.grade == grade.word]
            if some:
                covered = share(some, [each.is_covered for each in some])
                is_narrow = grade is Grade.DETERMINED
                near = share(some, [each.is_near for each in some]) if is_narrow else ""
                lines.append(
                    [case[0], f"`{case[1]}`", *case[2:], grade.word, str(len(some)), covered, near]
                )
    head = ["log", "model", "errors", "target", "grade", "coefficients"]
    return table([*head, "covered [%]", "within 25 % [%]"], lines)


def misses_table(outcomes: Sequence[Outcome]) -> str:
    """Return the determined coefficients that are wrong in a fifth of three draws or more."""
    lines = []
    kept = [
        each
        for each in outcomes
        if each.grade == Grade.DETERMINED.word and MEASURED not in each.case
    ]
    for case, label in dict.fromkeys((each.case, each.label) for each in kept):
        some = [each for each in kept if (each.case, each.label) == (case, label)]
        covered = np.mean([each.is_covered for each in some])
        near = np.mean([each.is_near for each in some])
        if len(some) >= 3 and min(covered, near) < 0.8:
            cells = f"{100 * covered:.0f}", f"{100 * near:.0f}"
            name = label.replace("|", r"\|")
            lines.append([case[0], f"`{case[1]}`", case[2], f"`{name}`", str(len(some)), *cells])
    head = ["log", "model", "errors", "coefficient", "draws", "covered [%]", "within 25 % [%]"]
    return table(head, lines)


def axes_table(outcomes: Sequence[Outcome]) -> str:
    """Return coverage by axis of coefficients whose truth is known."""
    lines = []
    known = [each for each in outcomes if each.case[3] == TARGETS[TRUE]]
    for case in dict.fromkeys(each.case for each in known):
        for grade in (Grade.DETERMINED, Grade.MINOR):
            some = [each for each in known if each.case == case and each.grade == grade.word]
            rows = [[each for each in some if each.label[0] == axis] for axis in AXES]
            cells = (
                f"{100 * np.mean([each.is_covered for each in row]):.0f} ({len(row)})"
                if row
                else ""
                for row in rows
            )
            if some:
                lines.append([case[0], case[2], grade.word, *cells])
    return table(["log", "errors", "grade", *AXES], lines)


def bound_table(rows: Sequence[Row]) -> str:
    """Return widths and errors over the Cramér-Rao bound."""
    lines = []
    truths = {row[:2]: row.estimate for row in rows if row.draw == TRUE}
    for case, truth in truths.items():
        some = [row for row in rows if row[:2] == case and row.bound]
        if not some:
            continue
        misses = np.array([row.estimate for row in some]) - truth
        bounds = np.array([row.bound for row in some])
        variances = np.diagonal(bounds, axis1=1, axis2=2)
        width = np.median([row.error for row in some] / np.sqrt(variances))
        ratio = np.median(np.sqrt(np.mean(misses**2 / variances, axis=0)))
        cells = [*case, str(len(some)), f"{width:.2f}", f"{ratio:.2f}", ""]
        if case[0] == "slender":
            metric = measure("coloured")[0]
            squares = np.einsum("di,ij,dj->d", misses, metric, misses)
            expected = np.einsum("ij,dji->d", metric, bounds)
            cells[-1] = f"{np.sqrt(np.mean(squares) / np.mean(expected)):.2f}"
        lines.append(cells)
    return table(["log", "errors", "draws", "width", "coefficient error", "replay error"], lines)


def grades_table(rows: Sequence[Row]) -> str:
    """Return the number of coefficients of each grade in entire logs."""
    lines = [
        [row.log, f"`{row.model}`", *(str(list(row.grades).count(grade.word)) for grade in Grade)]
        for row in rows
        if row.draw == WHOLE
    ]
    return table(["log", "model", *(grade.word for grade in Grade)], lines)


def summarise(rows: Sequence[Row]) -> str:
    """Return all tables."""
    outcomes = list(compare_with_targets(rows))
    parts = {
        "Coefficients that are right": promise_table(outcomes),
        "`determined` coefficients right in less than 80 % of draws": misses_table(outcomes),
        "Widths and errors over the Cramér-Rao bound": bound_table(rows),
        "Covered coefficients by axis [%] (number)": axes_table(outcomes),
        "Coefficients of each grade in entire logs": grades_table(rows),
    }
    return "\n\n".join(f"**{title}**\n\n{text}" for title, text in parts.items())
