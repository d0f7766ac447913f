"""Units of clocks, by the rates: those in which they are the derivative of the attitude."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from hydrodamp.ingest.inspection.columns import Series, TopicClock, decimate
from hydrodamp.ingest.inspection.frames import MAX_ANGLE_RAD, match_rates

_RATES = ("velocity.p", "velocity.q", "velocity.r")

Clocks = dict[str, TopicClock]


def confirm_clocks(clocks: Clocks, roles: dict[str, Series]) -> tuple[Clocks, dict[str, Series]]:
    """Return clocks and series in the units in which the rates match the attitude, if any do."""
    for name in {item.topic for role, item in roles.items() if role in (*_RATES, *MAX_ANGLE_RAD)}:
        for clock in clocks[name].alternatives[1:]:
            changed = {**clocks, name: clock}
            moved = {role: with_clock(item, changed) for role, item in roles.items()}
            if match_rates(moved).unit is not None:
                return changed, moved
    return clocks, roles


def with_clock(series: Series, clocks: Mapping[str, TopicClock]) -> Series:
    """Return a series with the times of the clock of its topic."""
    return replace(series, seconds=decimate(clocks[series.topic].seconds))
