"""Geographic positions: degrees and minutes, and the plane that touches the ellipsoid WGS 84."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray

_EQUATORIAL_RADIUS_M = 6_378_137.0  # of WGS 84
_ECCENTRICITY_SQUARED = 6.694_379_990_14e-3  # of WGS 84
_MINUTES = 60.0  # of a degree


def unfold_minutes(values: FloatArray) -> FloatArray:
    """Return the degrees of numbers ``ddmm.mmmm``: degrees times one hundred, plus minutes."""
    degrees, minutes = np.divmod(np.abs(values), 100.0)
    return np.copysign(degrees + minutes / _MINUTES, values)


def tangent_plane(
    latitude: FloatArray, longitude: FloatArray
) -> tuple[FloatArray, FloatArray, tuple[float, float]]:
    """Return north and east [m] of the first known position, and that position [deg].

    The arguments are in radians. North and east are arcs with the radii of curvature at the first
    position. A receiver without a fix writes latitude and longitude zero: such positions are NaN.
    """
    is_known = np.isfinite(latitude) & np.isfinite(longitude)
    has_fix = is_known & ((latitude != 0.0) | (longitude != 0.0))
    is_valid = has_fix if has_fix.any() else is_known
    first = int(np.argmax(is_valid))
    start, meridian = float(latitude[first]), float(longitude[first])
    shrinkage = 1.0 - _ECCENTRICITY_SQUARED * np.sin(start) ** 2
    prime_vertical = _EQUATORIAL_RADIUS_M / np.sqrt(shrinkage)
    along_meridian = prime_vertical * (1.0 - _ECCENTRICITY_SQUARED) / shrinkage
    north = np.where(is_valid, along_meridian * (latitude - start), np.nan)
    turn = np.remainder(longitude - meridian + np.pi, 2.0 * np.pi) - np.pi  # across 180 degrees
    east = np.where(is_valid, prime_vertical * np.cos(start) * turn, np.nan)
    return north, east, (float(np.degrees(start)), float(np.degrees(meridian)))
