"""How numbers are written in tables: short enough to compare at a glance."""

from __future__ import annotations

import math

NOTHING = "-"
"""Stands where there is no number."""

BOUND = "\u00a0"
"""A space at which no line breaks."""


def error_size(value: float | None, decimals: int = 3) -> str:
    """Return an error with a fixed number of decimals, so that points stand in line."""
    if value is None or math.isnan(value):
        return NOTHING
    if 0.0 < value < 0.5 * 10.0**-decimals:
        return f"<.{'1':>0{decimals}}"
    for limit, most in ((100.0, decimals), (1000.0, 1), (99999.5, 0)):
        if value < limit:
            return f"{value:.{min(most, decimals)}f}"
    return f"{value:.0e}"


def percent(value: float | None) -> str:
    """Return a fit in percent in at most three characters."""
    if value is None or math.isnan(value):
        return NOTHING
    return "<0" if value < 0.0 else f"{value:.0f}"


def coefficient(value: float | None) -> str:
    """Return a coefficient with four significant digits."""
    return NOTHING if value is None or not math.isfinite(value) else f"{value:.4g}"


def seconds(value: float) -> str:
    """Return a time with as many digits as a reader needs."""
    return f"{value:.{1 if abs(value) < 100.0 else 0}f}{BOUND}s"
