"""How numbers are written in tables: short enough to compare at a glance."""

from __future__ import annotations

import math

NOTHING = "-"
"""Stands where there is no number."""

BOUND = "\u00a0"
"""A space at which no line breaks."""


def error_size(value: float | None, decimals: int = 3) -> str:
    """Return an error with a fixed number of decimals, so that points stand in line.

    From 100 on, where an error is anything but small, they make room.

    Parameters
    ----------
    value : float or None
        Zero or more.
    decimals : int, optional
        How many.

    Returns
    -------
    word : str
        In powers of ten from 100 000 on.

    Examples
    --------
    >>> [error_size(x) for x in (0.0463, 0.0002, 12.345, 175.89, 1234.5, 123456.0, None)]
    ['0.046', '<.001', '12.345', '175.9', '1234', '1e+05', '-']
    """
    if value is None or math.isnan(value):
        return NOTHING
    if 0.0 < value < 0.5 * 10.0**-decimals:
        return f"<.{'1':>0{decimals}}"
    for limit, most in ((100.0, decimals), (1000.0, 1), (99999.5, 0)):
        if value < limit:
            return f"{value:.{min(most, decimals)}f}"
    return f"{value:.0e}"


def percent(value: float | None) -> str:
    """Return a fit in percent in at most three characters.

    Parameters
    ----------
    value : float or None
        100 at best; below zero the replay is worse than a constant.

    Returns
    -------
    word : str
        A whole number, or ``<0``.

    Examples
    --------
    >>> percent(97.34), percent(-190.0), percent(None)
    ('97', '<0', '-')
    """
    if value is None or math.isnan(value):
        return NOTHING
    return "<0" if value < 0.0 else f"{value:.0f}"


def coefficient(value: float | None) -> str:
    """Return a coefficient with four significant digits.

    Examples
    --------
    >>> coefficient(-3.24412), coefficient(0.0), coefficient(None)
    ('-3.244', '0', '-')
    """
    return NOTHING if value is None or not math.isfinite(value) else f"{value:.4g}"


def seconds(value: float) -> str:
    """Return a time with as many digits as a reader needs.

    Examples
    --------
    >>> seconds(12.3456).split(), seconds(1234.5).split()
    (['12.3', 's'], ['1234', 's'])
    """
    return f"{value:.{1 if abs(value) < 100.0 else 0}f}{BOUND}s"
