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


def mask_missing_fixes(
    values: FloatArray, time: FloatArray, partner: FloatArray, partner_time: FloatArray
) -> FloatArray:
    """Return latitudes (or longitudes) with NaN where they and the partner are zero.

    A receiver without a fix writes both as zero. Zeros on the path of the others are a position.
    """
    if not (_is_far_from_zero(values) or _is_far_from_zero(partner)):
        return values
    is_partner_zero = partner == 0.0
    if time is not partner_time:
        is_partner_zero = np.interp(time, partner_time, is_partner_zero) > 0.0
    return np.where((values == 0.0) & is_partner_zero, np.nan, values)


def _is_far_from_zero(values: FloatArray) -> bool:
    """Return whether the distance of nonzero values from zero exceeds their range."""
    nonzero = values[np.isfinite(values) & (values != 0.0)]
    return bool(len(nonzero) and np.abs(nonzero).min() > np.ptp(nonzero))


def tangent_plane(
    latitude: FloatArray, longitude: FloatArray
) -> tuple[FloatArray, FloatArray, tuple[float, float]]:
    """Return north and east [m] of the first known position, and that position [deg].

    The arguments are in radians. North and east are arcs with the radii of curvature at the first
    position.
    """
    is_valid = np.isfinite(latitude) & np.isfinite(longitude)
    first = int(np.argmax(is_valid))
    start, meridian = float(latitude[first]), float(longitude[first])
    shrinkage = 1.0 - _ECCENTRICITY_SQUARED * np.sin(start) ** 2
    prime_vertical = _EQUATORIAL_RADIUS_M / np.sqrt(shrinkage)
    along_meridian = prime_vertical * (1.0 - _ECCENTRICITY_SQUARED) / shrinkage
    north = np.where(is_valid, along_meridian * (latitude - start), np.nan)
    turn = np.remainder(longitude - meridian + np.pi, 2.0 * np.pi) - np.pi  # across 180 degrees
    east = np.where(is_valid, prime_vertical * np.cos(start) * turn, np.nan)
    return north, east, (float(np.degrees(start)), float(np.degrees(meridian)))
