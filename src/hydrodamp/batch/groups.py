"""Groups of logs: assign a log to a group and a vehicle, order the groups, find change points.

Change points: at most one lasting change of each coefficient in a series of groups, by a two-sample
t-test between the groups before and after each day, weighted, with a Bonferroni correction over all
days and coefficients.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from pathlib import PurePosixPath

import numpy as np
from scipy.special import stdtr

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import MAX_RELATIVE_HALF_WIDTH, critical_value
from hydrodamp.vehicle.vehicle import Vehicle

#: Grouping keys that are dates.
DATES = frozenset({"day", "month"})

DATE_PATTERN = re.compile(r"(?<!\d)(20\d\d)[-_.]?([01]\d)[-_.]?([0-3]\d)(?!\d)")
MIN_UNIX_TIME = 1e8  # s since 1970 (in 1973); a smaller clock counts from boot

MIN_GROUPS_PER_SIDE, MIN_GROUPS = 2, 5  # before and after a change, and in all; by choice

#: Family-wise significance level over coefficients and days: a false change in 1 of 800 seasons,
#: and every growth of 5 % detected (studies/season_changes.py).
SIGNIFICANCE_LEVEL = 0.002

#: Level of the test for outlying groups, for each coefficient; by choice.
OUTLIER_LEVEL = 1e-4

Group = tuple[str, ...]


def assign_group(by: Sequence[str], address: str, vehicle: str, start: float) -> Group:
    """Return the group of a log that begins at ``start`` [s]; raise ``MethodError`` if none."""
    return tuple(_label(key, address, vehicle, start) for key in by)


def _label(key: str, address: str, vehicle: str, start: float) -> str:
    if key == "vehicle":
        return vehicle
    if key == "folder":
        return PurePosixPath(address).parent.name
    if key in DATES:
        day = _clock_day(start) if start > MIN_UNIX_TIME else _path_day(address)
        if not day:
            raise MethodError(
                "neither its clock nor its path has a date: use `--group-by folder` or "
                "`--group-by` with a regular expression of the path."
            )
        return day if key == "day" else day[:7]
    match = re.search(key, address)
    label = None if match is None else match[1] if match.re.groups else match[0]
    if not label:
        reason = "its group matches nothing in" if match else "it is not in"
        raise MethodError(f"the pattern '{key}' gives no group: {reason} the path.")
    return label


def _clock_day(start: float) -> str:
    try:
        return datetime.fromtimestamp(start, UTC).strftime("%Y-%m-%d")
    except (OverflowError, ValueError, OSError) as error:
        raise MethodError(
            f"its clock begins at {start:.4g} s since 1970, which is no date: set its unit in a "
            "mapping."
        ) from error


def _path_day(address: str) -> str:
    """Return the first valid date of a path, or nothing."""
    for match in DATE_PATTERN.finditer(address):
        try:
            return date(*map(int, match.groups())).isoformat()
        except ValueError:
            continue
    return ""


def group_order(by: Sequence[str], starts: Sequence[float]) -> str:
    """Return the key that orders groups: `date`, `clock`, or `name` if clocks count from boot."""
    if not DATES.isdisjoint(by):
        return "date"
    return "clock" if all(start > MIN_UNIX_TIME for start in starts) else "name"


def sort_groups(by: Sequence[str], starts: Mapping[Group, float]) -> list[Group]:
    """Return groups in the order of their dates, then of their clocks if all count from 1970.

    ``starts`` are the clock times of the first samples [s].
    """
    has_unix_time = group_order((), [*starts.values()]) == "clock"

    def sort_key(group: Group) -> tuple[Group, float, Group]:
        dates = tuple(label for key, label in zip(by, group, strict=True) if key in DATES)
        return dates, starts[group] if has_unix_time else 0.0, group

    return sorted(starts, key=sort_key)


def assign_vehicle(address: str, names: Sequence[str]) -> str:
    """Return the only vehicle, or the one whose name is a word of the path."""
    if len(names) == 1:
        return names[0]
    spans = {
        match.span(): name
        for name in names
        for match in re.finditer(rf"(?<![^\W_]){re.escape(name)}(?![^\W_])", address)
    }
    matches = {
        name
        for (start, stop), name in spans.items()
        if not any(a <= start and stop <= b and (a, b) != (start, stop) for a, b in spans)
    }
    if len(matches) != 1:
        matched = ", ".join(sorted(matches)) if matches else f"none of {', '.join(names)}"
        raise MethodError(f"its path has the name of {matched}: it must name one vehicle.")
    return matches.pop()


def check_grouping(by: Sequence[str], vehicles: Sequence[Vehicle]) -> None:
    """Refuse an unknown grouping key, and logs of several vehicles in one group."""
    if len(names := {each.name for each in vehicles}) < len(vehicles):
        raise MethodError(f"vehicles must have different names; got {', '.join(sorted(names))}.")
    if len(vehicles) > 1 and "vehicle" not in by:
        raise MethodError("`by` must hold `vehicle` for several vehicles: they share no fit.")
    for key in by:
        try:
            re.compile(key)
        except re.error as error:
            raise MethodError(
                f"`by` takes vehicle, day, month, folder and patterns of the path; '{key}' is "
                f"invalid: {error}."
            ) from error
    if not by:
        raise MethodError("`by` must name at least one of vehicle, day, month, folder, a pattern.")


@dataclass(frozen=True)
class ChangePoint:
    """A lasting change of one coefficient.

    ``first`` is the index of the first group after it, ``p_value`` the family-wise probability of
    so large a change of any coefficient on any day without a change.
    """

    label: str
    first: int
    before: float
    after: float
    standard_error: float
    p_value: float

    @property
    def relative_change(self) -> float:
        """Change over the value before it; positive for growth."""
        return self.after / self.before - 1.0 if self.before else np.inf


def find_change_points(fits: Sequence[Fit]) -> tuple[ChangePoint, ...]:
    """Return the coefficients that changed, the most significant first.

    ``fits`` are in the order of time. The standard error is the scatter between n groups, with
    n − 2 degrees of freedom; the standard errors of the groups are not used, as few blocks
    determine them poorly. Groups without an estimate, and coefficients that are determined on
    neither side of the change, are omitted, and so are those of :func:`find_outlying_groups`.
    """
    value, weight = _estimates(fits)
    for index, outlying in enumerate(_outlying_groups(value, weight)):
        weight[outlying, index] = 0.0
    n_coefficients, changes = value.shape[1], list[ChangePoint]()
    for index, label in enumerate(fits[0].model.labels if fits else ()):
        groups = np.flatnonzero(weight[:, index] > 0.0)
        if len(groups) < MIN_GROUPS:
            continue
        day, *change = _most_significant(value[groups, index], weight[groups, index])
        before, after, error, p_value = change
        n_days = len(groups) - 2 * MIN_GROUPS_PER_SIDE + 1
        p_value = min(p_value * n_days * n_coefficients, 1.0)
        if p_value < SIGNIFICANCE_LEVEL:
            changes.append(ChangePoint(label, int(groups[day]), before, after, error, p_value))
    return tuple(sorted(changes, key=lambda change: change.p_value))


def find_outlying_groups(fits: Sequence[Fit]) -> dict[int, tuple[str, ...]]:
    """Return the indices of groups that are far from all others, each with the coefficients."""
    labels: dict[int, tuple[str, ...]] = {}
    for index, outlying in enumerate(_outlying_groups(*_estimates(fits))):
        for group in outlying:
            labels[group] = (*labels.get(group, ()), fits[group].model.labels[index])
    return dict(sorted(labels.items()))


def _outlying_groups(value: FloatArray, weight: FloatArray) -> list[list[int]]:
    """Return the outlying groups of each coefficient, at most one in ten or one.

    Generalised extreme Studentised deviate test about the mean, or the means before and after the
    best change. A deviate is significant for errors that are the noise, and for the weights of
    :func:`_estimates`: a group of little information may be far from all others.
    """
    outlying: list[list[int]] = []
    for x, w in zip(value.T, weight.T, strict=True):
        indices, n_outlying, order = np.flatnonzero(w > 0.0), 0, list[int]()
        n_most = max(1, len(indices) // 10) if len(indices) > MIN_GROUPS else 0
        for k in range(n_most):
            n, weights = len(indices), w[indices]
            deviates = np.minimum(*(_deviates(x[indices], weights**power) for power in (1, 2)))
            index = int(deviates.argmax())
            order.append(int(indices[index]))
            p_value = 2.0 * n * stdtr(n - 3, -deviates[index])
            if p_value < OUTLIER_LEVEL:
                n_outlying = k + 1
            indices = np.delete(indices, index)
        outlying.append(order[:n_outlying])
    return outlying


def _deviates(value: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the Studentised deviate of each group: how far its omission reduces the residuals."""
    n = len(value)
    sides = _sides(weight)
    total = sides.sum(axis=2, keepdims=True)
    residual = value - (sides @ value)[..., None] / total
    square = sides * residual**2
    sums = square.sum(axis=(0, 2))
    # Without a group, its side has another mean.
    omitted = square / np.maximum(1.0 - sides / total, np.finfo(np.float64).eps)
    remaining = (sums[:, None] - omitted.sum(axis=0)).min(axis=0)
    least = np.maximum(remaining, _rounding(value) ** 2 * weight.sum())
    return np.asarray(np.sqrt(np.maximum(sums.min() - least, 0.0) / least * (n - 3)))


def _rounding(value: FloatArray) -> float:
    """Return the least scatter of estimates: half of their digits, as rounding grows in a fit."""
    limits = np.finfo(np.float64)
    return float(max(np.abs(value).max() * limits.eps**0.5, limits.tiny**0.5))


def _sides(weight: FloatArray) -> FloatArray:
    """Return the weights before and after each day, shape (2, days, groups)."""
    n = len(weight)
    days = np.arange(MIN_GROUPS_PER_SIDE, n - MIN_GROUPS_PER_SIDE + 1)
    late = np.arange(n) >= days[:, None]
    return np.where(np.stack([~late, late]), weight, 0.0)


def _estimates(fits: Sequence[Fit]) -> tuple[FloatArray, FloatArray]:
    """Return coefficients and weights, shape (groups, coefficients); weight 0 for no estimate.

    Weights are the inverse standard errors under white noise: a compromise between equal weights
    and inverse variances, as model-form error varies less between manoeuvres than noise.
    """
    n = fits[0].model.n_coefficients if fits else 0
    value, weight = np.zeros((len(fits), n)), np.zeros((len(fits), n))
    for index, fit in enumerate(fits):
        if fit.uncertainty is None:
            continue
        leverage = fit.uncertainty.leverage
        if leverage is None:
            leverage = np.full(n, 1.0 / max(fit.n_samples, 1))
        coefficients = fit.damping.coefficients
        aliased = {label for labels in fit.aliased for label in labels}
        used = np.isfinite(coefficients) & np.isfinite(leverage) & (leverage > 0.0)
        used &= [label not in aliased for label in fit.model.labels]
        value[index, used], weight[index, used] = coefficients[used], leverage[used] ** -0.5
    return value, weight


def _most_significant(
    value: FloatArray, weight: FloatArray
) -> tuple[int, float, float, float, float]:
    """Return the index of the least p-value, both means, the standard error and the p-value."""
    n = len(value)
    sides = _sides(weight)
    total = sides.sum(axis=2)
    before, after = means = (sides @ value) / total
    residual = value - np.where(sides[1] > 0.0, after[:, None], before[:, None])
    errors = np.sqrt((residual**2 @ weight) / (n - 2) / total)
    error = np.hypot(*errors)
    half = critical_value(degrees_of_freedom=n - 2) * errors
    determined = np.any(half <= MAX_RELATIVE_HALF_WIDTH * np.abs(means), axis=0)
    ratio = np.abs(after - before) / np.maximum(error, _rounding(value))
    p_values = np.where(determined, 2.0 * stdtr(n - 2, -ratio), 1.0)
    best = int(p_values.argmin())
    means = float(before[best]), float(after[best])
    return best + MIN_GROUPS_PER_SIDE, *means, float(error[best]), float(p_values[best])


def group_reasons(failed: Mapping[str, str]) -> list[str]:
    """Return each reason once, with its first log and how many more logs it concerns."""
    logs: dict[str, list[str]] = {}
    for log, reason in failed.items():
        logs.setdefault(reason, []).append(log)
    return [
        f"{first}{f' and {len(more)} more' if more else ''}: {reason}"
        for reason, (first, *more) in logs.items()
    ]
