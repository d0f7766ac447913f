"""Verdict on a comparison or a cross-validation: which model is usable, on which axes, and why.

The fit of a velocity over the held-out data, with its standard error, gives the light of its axis:
green from :data:`MIN_FIT` on, red where it is not significantly above zero, the mean of the data,
and amber between. Significant means above zero with the one-sided confidence of the selection.
Where test or training do not excite the velocity, or the test data are training data, wholly or in
part, it is grey: neither fit is a prediction that was tested.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.data.intervals import ALL_TEST_DATA
from hydrodamp.identification.adequacy import Form
from hydrodamp.identification.grades import Grade, count_determined
from hydrodamp.simulation.block_errors import BlockErrors
from hydrodamp.simulation.replay import RateUnit
from hydrodamp.status import TextEnum
from hydrodamp.validation.excitation import describe_overlap
from hydrodamp.validation.selection import (
    Candidate,
    Ranked,
    Selection,
    insignificant_fits,
    relative_percent,
    row_name,
    significant_fits,
)

#: Least fit [%] of a green light: half of the error of predicting the mean of the data.
MIN_FIT = 50.0

#: Reason of a velocity of a replay that diverged.
DIVERGED = "a replay diverged"


class Light(TextEnum):
    """Whether the predictions of an axis are usable.

    Examples
    --------
    >>> Light.GREEN.word
    'usable'
    """

    GREEN = f"usable: the fit is at least {MIN_FIT:.0f} % and its terms are identifiable."
    AMBER = "usable with care: the fit or the identifiability is low."
    RED = "not usable: not significantly better than the mean of the data."
    GREY = "not tested: test or training do not excite the velocity, or they share data."


@dataclass(frozen=True)
class AxisVerdict:
    """Light of one velocity, its fit [%] with standard error, and the reason."""

    velocity: str
    light: Light
    fit: float | None
    standard_error: float | None
    reason: str = ""

    @property
    def fit_text(self) -> str:
        """The fit with its standard error; empty where the data do not vary."""
        error = f" ± {self.standard_error:.0f}" if (self.standard_error or 0.0) >= 0.5 else ""
        return "" if self.fit is None else f"{self.fit:.0f}{error} %"


@dataclass(frozen=True)
class Verdict:
    """Which model is usable, how well it predicts each velocity, and why.

    Attributes
    ----------
    model, method : str
        Keys of the selected row.
    recommended : bool
        Whether it predicts a velocity of the held-out data significantly better than its mean.
    n_coefficients : int
        Number of coefficients.
    n_determined : int or None
        How many the training data determine; None where not graded.
    relative_error, relative_standard_error : float or None
        Mean error of the velocities that count relative to their motion [%], and its standard error
        over blocks of the held-out data; None where a replay diverged or for a single block.
    rms, standard_error : float or None
        Equation 24, which decides nothing, likewise.
    rate_unit : {"deg", "rad"}
        Unit of angular rates in the error.
    axes : tuple of AxisVerdict
        Light, fit and reason of each velocity.
    alternatives : dict of str to str
        Row that predicts a velocity with a better light, or with a larger fit where both are to be
        used with care, by velocity.
    equivalent : tuple of str
        Rows that are equal for use to the selected one.
    reasons : tuple of str
        Why it was selected, and what limits the verdict.
    overlap : str
        Test data that are also training data; empty for none.
    """

    model: str
    method: str
    recommended: bool
    n_coefficients: int
    n_determined: int | None
    relative_error: float | None
    relative_standard_error: float | None
    rms: float | None
    standard_error: float | None
    rate_unit: RateUnit
    axes: tuple[AxisVerdict, ...]
    alternatives: Mapping[str, str]
    equivalent: tuple[str, ...]
    reasons: tuple[str, ...]
    overlap: str = ""

    @property
    def headline(self) -> str:
        """For which velocities the model is usable, and models for the others."""
        return " ".join((f"{self._usability}.", *self._describe_alternatives()))

    @property
    def _usability(self) -> str:
        """For which velocities the model is usable, by their lights."""
        row, names = f"{self.model} by {self.method}", self._by_light()
        red, grey = names.get(Light.RED, ""), names.get(Light.GREY, "")
        if self.overlap and not red:
            share = "all" if self.overlap == ALL_TEST_DATA else "part of the"
            return f"Not tested: {row}, because {share} test data are training data"
        if not self.recommended and not red:
            return f"Not tested: {row}, because the test excites no velocity"
        if not self.recommended:
            reasons = {axis.reason for axis in self.axes if axis.light is Light.RED}
            cause = f"it predicts {red} not significantly better than their mean"
            if reasons == {DIVERGED}:
                cause = DIVERGED
            return f"Not usable: {row}, because {cause}" + (f"; not tested {grey}" if grey else "")
        uses = {Light.GREEN: "for {}", Light.AMBER: "with care for {}", Light.RED: "not for {}"}
        clauses = [use.format(names[light]) for light, use in uses.items() if light in names]
        clauses += [f"not tested for {grey}"] if grey else []
        return f"Usable{' for part' if red else ''}: {row} {', '.join(clauses)}"

    def _by_light(self) -> dict[Light, str]:
        """Return the velocities of each light that there is."""
        names = {
            light: " ".join(axis.velocity for axis in self.axes if axis.light is light)
            for light in Light
        }
        return {light: text for light, text in names.items() if text}

    def _describe_alternatives(self) -> Iterator[str]:
        """Yield which other models to take for which velocities, and for which there is none."""
        velocities: dict[str, list[str]] = {}
        for name, row in self.alternatives.items():
            velocities.setdefault(row, []).append(name)
        texts = [f"for {' '.join(names)}: {row}" for row, names in velocities.items()]
        if texts:
            yield f"Best {'; '.join(texts)}."
            red = self._by_light().get(Light.RED, "").split()
            if none := " ".join(name for name in red if name not in self.alternatives):
                yield f"No model of this set predicts {none}."

    @property
    def remedy(self) -> str:
        """What to do where no velocity is usable; else empty."""
        if self.recommended:
            return ""
        if not self.overlap and Light.RED not in self._by_light():
            return "test on data with more motion."
        if Light.RED not in self._by_light():
            return (
                "test on data that the training did not use, or run `hydrodamp compare LOG "
                "--folds 5`."
            )
        return (
            "check units, axes and signs with `hydrodamp probe LOG --vehicle FILE`; `hydrodamp "
            "plan` designs a dive with more excitation."
        )

    @property
    def lines(self) -> tuple[str, ...]:
        """Headline, fits by light, reasons, and what to do if no velocity is usable."""
        next_step = (f"Next: {self.remedy}",) if self.remedy else ()
        return (self.headline, describe_fits(self.axes), *self.reasons, *next_step)

    def __str__(self) -> str:
        """Return the lines."""
        return "\n".join(self.lines)

    __repr__ = __str__


def judge_selection(
    selection: Selection[Candidate],
    rate_unit: RateUnit,
    remarks: Iterable[str] = (),
    doubts: dict[str, str] | None = None,
    untested: Mapping[str, str] | None = None,
    overlap: str = "",
) -> Verdict:
    """Return the verdict on a selected row.

    ``doubts`` are reasons not to trust the fit of a velocity, ``untested`` reasons why the test
    cannot assess it; ``overlap`` names test data that are training data. The reasons of the verdict
    are why the row was selected, then ``remarks``, then what limits its use.
    """
    row, errors = selection.row, selection.errors
    if overlap:
        untested = dict.fromkeys(errors.names, "training data")

    def judge_row(each: Ranked) -> tuple[AxisVerdict, ...]:
        blocks, form = errors if each.blocks is None else each.blocks, each.adequacy
        poor = form.axes if form is not None and form.form is Form.INADEQUATE else ()
        of_form = {VELOCITY_OF[axis]: "its form is inadequate" for axis in poor}
        return tuple(judge_axes(blocks, each.grades, of_form | (doubts or {}), untested or {}))

    axes = judge_row(row)
    is_usable = not {axis.light for axis in axes} <= {Light.RED, Light.GREY}
    limits = _limits(row, errors, overlap, is_usable)
    reasons = (_describe_selection(selection), *remarks, *limits)
    judged = {row_name(each): judge_row(each) for each in selection.ranked if each is not row}
    relative, deviation = relative_percent(errors, selection.velocities)
    return Verdict(
        row.model,
        row.method,
        is_usable,
        row.n_coefficients,
        count_determined(row.grades),
        None if row.divergences else relative,
        None if row.divergences else deviation,
        None if row.divergences else errors.rms,
        None if row.divergences else errors.standard_error,
        rate_unit,
        axes,
        dict(_find_alternatives(axes, judged)),
        tuple(map(row_name, selection.equivalent)),
        tuple(filter(None, reasons)),
        overlap,
    )


def _describe_selection(selection: Selection[Candidate]) -> str:
    """Return why the row was selected; only the caveat of a single row."""
    return selection.caveat if selection.runner_up is None else f"Why: {selection}"


def _limits(row: Ranked, errors: BlockErrors, overlap: str, is_usable: bool) -> Iterator[str]:
    """Yield what limits the use of a row, or of its errors."""
    if overlap:
        yield describe_overlap(overlap)
    n_determined = count_determined(row.grades)
    is_set = row.adequacy is not None and row.adequacy.form is not Form.ADEQUATE  # it says so
    is_open = n_determined is not None and 2 * n_determined < row.n_coefficients
    if is_usable and is_open and not is_set:
        yield "Most coefficients are not determined singly: use them together."
    if errors.standard_error is None:
        yield "The held-out data are too short for a standard error."


def _find_alternatives(
    axes: Sequence[AxisVerdict], judged: Mapping[str, Sequence[AxisVerdict]]
) -> Iterator[tuple[str, str]]:
    """Yield each velocity that another row predicts better, and the best of these rows.

    Better is a better light or, where both are to be used with care, a larger fit.
    """
    order = [*Light]
    for number, axis in enumerate(axes):
        of_axis = {name: row[number] for name, row in judged.items()}
        better = [
            (order.index(each.light), -(each.fit or 0.0), name)
            for name, each in of_axis.items()
            if order.index(each.light) < order.index(axis.light)
            or (each.light is axis.light is Light.AMBER and _is_larger(each.fit, axis.fit))
        ]
        if better:
            yield axis.velocity, min(better)[-1]


def _is_larger(fit: float | None, least: float | None) -> bool:
    """Whether a fit is larger, as printed."""
    return round(fit or 0.0) > round(least or 0.0)


def describe_fits(axes: Sequence[AxisVerdict]) -> str:
    """Return the fit of each velocity by light, those of one reason together."""
    texts = []
    for light in Light:
        groups: dict[str, list[str]] = {}
        for axis in axes:
            if axis.light is light:
                text = f"{axis.velocity} {axis.fit_text}".rstrip()
                groups.setdefault(axis.reason, []).append(text)
        clauses = [", ".join(group) + f" ({why})" * bool(why) for why, group in groups.items()]
        texts += [f"{light.word} {', '.join(clauses)}"] * bool(clauses)
    return f"Fit: {'; '.join(texts)}."


def judge_axes(
    errors: BlockErrors,
    grades: Mapping[str, Grade],
    doubts: Mapping[str, str],
    untested: Mapping[str, str],
) -> Iterator[AxisVerdict]:
    """Yield the light of each velocity; after a divergence red, without a fit."""
    deviations, least = errors.standard_error_by_axis, significant_fits(errors)
    insignificant = insignificant_fits(errors)
    still = dict.fromkeys(errors.names, "no motion above the noise in the test")
    untested = {**still, **dict.fromkeys(errors.excited, ""), **untested}
    for name, fit in errors.fit_by_axis.items():
        deviation, light, reason = deviations[name], Light.GREEN, doubts.get(name, "")
        if errors.diverged.any():
            yield AxisVerdict(name, Light.RED, None, None, DIVERGED)
            continue
        if not reason and not _is_identifiable(name, grades):
            reason = "no coefficient determined"
        if untested[name]:
            light, reason = Light.GREY, untested[name]
        elif fit is None or name in insignificant:
            is_worse = fit is not None and fit < -least[name]
            word = "worse" if is_worse else "not significantly better"
            light, reason = Light.RED, reason or f"{word} than the mean"
        elif reason or fit < MIN_FIT:
            light = Light.AMBER
        yield AxisVerdict(name, light, fit, deviation, reason)


def _is_identifiable(name: str, grades: Mapping[str, Grade]) -> bool:
    """Whether a coefficient of the axis is better than not determined; also where unknown."""
    axis = next(axis for axis in AXES if VELOCITY_OF[axis] == name)
    of_axis = [grade for label, grade in grades.items() if label.partition("_")[0] == axis]
    return not of_axis or any(grade is not Grade.NOT_DETERMINED for grade in of_axis)
