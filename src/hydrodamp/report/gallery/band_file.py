"""The band of the chosen replay as a file, both ways, so that a report is made again."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import FileError
from hydrodamp.simulation.replay import Trajectory
from hydrodamp.validation.bands import PredictionBand

BAND = "band.npz"
"""The file, in a folder of results."""

_AGAIN = "run the command again that wrote the folder, or delete the file to go without."

_SLACK = 1e-6
"""How far beside its band a replay may lie by rounding [m/s, rad/s]."""


def band_bytes(band: PredictionBand) -> bytes:
    """Return a band as the content of its file."""
    stream = io.BytesIO()
    np.savez(
        stream,
        allow_pickle=False,
        lower=band.lower,
        upper=band.upper,
        level=np.array(band.level),
        diverged=np.array(band.diverged),
    )
    return stream.getvalue()


def read_band(path: Path, replay: Trajectory) -> PredictionBand:
    """Read what :func:`band_bytes` made."""
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as arrays:
            lower, upper = (arrays[name].astype(np.float64) for name in ("lower", "upper"))
            level, diverged = float(arrays["level"]), float(arrays["diverged"])
    except (OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise FileError(f"{path}: is no band of hydrodamp; {_AGAIN}") from error
    if not _holds(lower, upper, replay.velocity):
        raise FileError(
            f"{path}: has the band of another replay than the comparison chooses; {_AGAIN}"
        )
    return PredictionBand(
        replay.log, replay.velocity, lower, upper, level, diverged, tuple(replay.axes)
    )


def _holds(lower: FloatArray, upper: FloatArray, velocity: FloatArray) -> bool:
    """Tell whether a replay lies in a band, wherever it has one."""
    if lower.shape != velocity.shape or upper.shape != velocity.shape:
        return False
    outside = np.fmax(lower - velocity, velocity - upper)
    return not np.any(outside > _SLACK * (1.0 + np.abs(velocity)))
