"""From the files of a comparison back to its value."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITY_OF
from hydrodamp.data.log import Log, Segment
from hydrodamp.errors import FileError
from hydrodamp.files import load_json
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.intervals import Uncertainty
from hydrodamp.models.files import damping_from_document
from hydrodamp.report.fit_names import fit_path
from hydrodamp.simulation.replay import AttitudeSource, Trajectory
from hydrodamp.simulation.score import RateUnit, Score
from hydrodamp.simulation.status import Status
from hydrodamp.validation.comparison import Comparison, Row

_STATUS = {status.word: status for status in Status}


def read_rows(home: Path) -> Comparison:
    """Return the comparison of a folder."""
    path = home / "comparison.json"
    document = _document(path)
    try:
        words = {key: str(value) for key, value in document["provenance"].items()}
        attitude = cast("AttitudeSource", words.pop("attitude"))
        unit = cast("RateUnit", words.pop("rate_unit"))
        words.pop("hydrodamp", None)
        entries: Sequence[Mapping[str, Any]] = document["rows"]
        names = [str(entry["fit"]) for entry in entries]
        scores = [_score(entry, unit) for entry in entries]
    except (KeyError, TypeError, AttributeError) as error:
        raise FileError(f"{path}: is no comparison of hydrodamp: {error!r}.") from error
    fits = [read_fit(fit_path(home, name)) for name in names]
    log, velocities = _replays(home / "replays.npz", words.get("test", ""))
    trajectories = [
        None
        if log is None or name not in velocities
        else Trajectory(log, velocities[name], score.diverged, attitude, _axes(score))
        for name, score in zip(names, scores, strict=True)
    ]
    rows = tuple(map(Row, fits, scores, trajectories))
    return Comparison(rows=rows, rate_unit=unit, attitude=attitude, provenance=words)


def _document(path: Path) -> dict[str, Any]:
    document = load_json(path)
    if not isinstance(document, dict):
        got = "a list" if isinstance(document, list) else repr(document)[:60]
        raise FileError(f"{path}: must hold one object, got {got}.")
    return document


def _score(entry: Mapping[str, Any], unit: RateUnit) -> Score:
    places = entry["diverged_at"] or ()
    return Score(
        rms=entry["rms"],
        rms_by_axis=dict(entry["rms_by_axis"]),
        fit_by_axis=dict(entry["fit_by_axis"]),
        rate_unit=unit,
        diverged=tuple((str(place["segment"]), float(place["time"])) for place in places),
    )


def _axes(score: Score) -> tuple[str, ...]:
    return tuple(axis for axis in AXES if VELOCITY_OF[axis] in score.rms_by_axis)


def read_fit(path: Path) -> Fit:
    """Return the fit of a file of ``fits``."""
    document = _document(path)
    damping = damping_from_document(document, str(path))
    try:
        trust = document["fit"]
        return Fit(
            damping=damping,
            method=str(trust["method"]),
            status=_STATUS[trust["status"]],
            rank=trust["rank"],
            aliased=tuple(tuple(group) for group in trust["aliased"]),
            n_samples=int(trust["n_samples"]),
            provenance=dict(trust["provenance"]),
            remarks=tuple(map(str, trust.get("remarks", ()))),
            uncertainty=_uncertainty(trust.get("uncertainty"), damping.covariance),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise FileError(f"{path}: `fit` is missing or incomplete: {error!r}.") from error


def _uncertainty(
    found: Mapping[str, Any] | None, covariance: FloatArray | None
) -> Uncertainty | None:
    """Return what intervals are made with; of the noise only its variances were kept."""
    if found is None or covariance is None:
        return None
    known, noise = found["degrees_of_freedom"], found["noise_variances"]
    return Uncertainty(
        covariance,
        degrees_of_freedom=np.inf if known is None else float(known),
        method=str(found["method"]),
        noise=None if noise is None else np.diag(np.array(noise, dtype=np.float64)),
        block=found["block"],
        n_blocks=int(found["n_blocks"]),
        allowance=str(found["allowance"]),
    )


def _replays(path: Path, source: str) -> tuple[Log | None, dict[str, FloatArray]]:
    try:
        # From memory: a damaged archive that is opened by its name stays open.
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as arrays:
            found = {name: arrays[name] for name in arrays.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise FileError(f"{path}: cannot be read: {error}.") from error
    if "time" not in found:
        return None, {}
    segments = tuple(
        Segment(str(name), int(start), int(stop))
        for name, (start, stop) in zip(found["segment_names"], found["segment_bounds"], strict=True)
    )
    log = Log(found["time"], found["measured"], segments=segments, source=source)
    simulated = "simulated."
    return log, {
        name.removeprefix(simulated): values
        for name, values in found.items()
        if name.startswith(simulated)
    }
