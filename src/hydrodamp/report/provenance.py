"""Provenance of a report: run, files, versions, numbers of the vehicle and settings of methods."""

from __future__ import annotations

import ast
import platform
from datetime import date
from typing import NamedTuple

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.report.documents import provenance_of
from hydrodamp.report.narrative import TRAINING_DATA, describe_data
from hydrodamp.report.table import Table
from hydrodamp.simulation.campaign.reenact import TRUTHS, CampaignSetup
from hydrodamp.validation.compare import MISSIONS, Comparison, Row
from hydrodamp.vehicle.vehicle import Vehicle

MIN_TRACK_POINTS, MAX_TRACK_POINTS = 2, 400

_SHOWN_ELSEWHERE = ("files", "warnings", MISSIONS)


def describe_run(comparison: Comparison, selected: Row | None) -> str:
    """Return data, duration and sampling rate of a run in one line."""
    texts = comparison.provenance
    sentences = []
    if trained := texts.get("train_segments"):
        duration = "" if selected is None else selected.fit.provenance.get("duration", "")
        rate = "" if selected is None else selected.fit.provenance.get("rate", "")
        details = " at ".join(filter(None, [duration, rate]))
        sentences.append(f"Trained on {trained}" + (f" ({details})" if details else ""))
    if describe_data(comparison) == TRAINING_DATA:
        sentences.append(f"replayed on the {TRAINING_DATA}")
    elif tested := texts.get("test_segments"):
        sentences.append(f"tested on {tested}")
        if selected is not None and selected.trajectory is not None:
            log = selected.trajectory.log
            sentences[-1] += f" ({log.duration:.4g} s at {log.sample_rate:.3g} Hz)"
    return "; ".join(sentences)


def timeline(comparison: Comparison, selected: Row | None) -> list[tuple[str, float, str]]:
    """Return name, duration [s] and kind (train or test) of the data, for a bar of the run."""
    if selected is None or selected.trajectory is None:
        return []
    log, training = selected.trajectory.log, selected.fit.provenance.get("duration", "")
    is_training = describe_data(comparison) == TRAINING_DATA
    segments = [
        (
            f"{each.name} ({TRAINING_DATA})" if is_training else each.name,
            float(log.time[each.stop - 1] - log.time[each.start]),
            "train" if is_training else "test",
        )
        for each in log.segments
    ]
    if is_training or not training:
        return segments
    return [("training", float(training.removesuffix(" s")), "train"), *segments]


class Track(NamedTuple):
    """Horizontal track as SVG points in a square of 100 px, and the size of the square [m]."""

    points: str
    size: float


def horizontal_track(log: Log | None) -> Track | None:
    """Return the horizontal track of a log, if it has one."""
    if log is None or log.position is None or len(log.position) < MIN_TRACK_POINTS:
        return None
    step = max(len(log.position) // MAX_TRACK_POINTS, 1)
    east, north = log.position[::step, 1], -log.position[::step, 0]
    size = max(float(np.ptp(east)), float(np.ptp(north)))
    if not np.isfinite(size) or size <= 0.0:
        return None
    x, y = (100.0 * (values - values.min()) / size for values in (east, north))
    pairs = zip(x.tolist(), y.tolist(), strict=True)
    return Track(" ".join(f"{a:.1f},{b:.1f}" for a, b in pairs), size)


def today() -> str:
    """Return the date of a page that is made now."""
    return date.today().isoformat()


def provenance_facts() -> dict[str, str]:
    """Return the program that made a page."""
    import hydrodamp

    version = f"hydrodamp {hydrodamp.__version__}, Python {platform.python_version()}"
    return {"report made by": version}


class Origin(NamedTuple):
    """Facts, input files and settings of methods."""

    facts: dict[str, str]
    files: Table
    settings: Table


def provenance_tables(comparison: Comparison, selected: Row | None) -> Origin:
    """Return the provenance of a comparison: facts, files and settings."""
    texts = provenance_of(comparison)
    files = [line.strip().partition("  ") for line in texts.get("files", "").splitlines()]
    read = [(name or digest, digest if name else "") for digest, _, name in files]
    facts = {
        key.replace("_", " "): text
        for key, text in texts.items()
        if text and key not in _SHOWN_ELSEWHERE
    }
    if selected is not None and selected.fit.vehicle is not None:
        facts |= vehicle_facts(selected.fit.vehicle)
    settings = {row.method: row.fit.provenance.get("settings") for row in comparison.rows[::-1]}
    used = [
        (method, describe_settings(text))
        for method in comparison.methods
        if (text := settings[method])
    ]
    return Origin(
        facts,
        Table.of_words("Input files", ("file", "SHA-256"), "ll", read),
        Table.of_words("Settings of the methods", ("method", "settings"), "ll", used),
    )


def vehicle_facts(vehicle: Vehicle) -> dict[str, str]:
    """Return the numbers of a vehicle as text."""
    diagonal = ", ".join(f"{value:.4g}" for value in np.diag(vehicle.mass_matrix))
    centres = "; ".join(
        " ".join(f"{value:.3g}" for value in centre)
        for centre in (vehicle.center_of_gravity, vehicle.center_of_buoyancy)
    )
    return {
        "mass matrix, diagonal [kg, kg m²]": diagonal,
        "weight and buoyancy [N]": f"{vehicle.weight:.5g}, {vehicle.buoyancy:.5g}",
        "centres of gravity and buoyancy [m]": centres,
    }


def describe_settings(text: str) -> str:
    """Return the settings of a method, which are recorded as a call, in words."""
    try:
        call = ast.parse(text, mode="eval").body
    except SyntaxError:
        return text
    return "; ".join(_describe_arguments(call)) if isinstance(call, ast.Call) else text


def _describe_arguments(call: ast.Call) -> list[str]:
    named = [(each.arg or "", each.value) for each in call.keywords]
    listed = [*(("", value) for value in call.args), *named]
    texts = [(name.replace("_", " "), _describe_value(value)) for name, value in listed]
    return [f"{name} {text}".strip() for name, text in texts]


def _describe_value(value: ast.expr) -> str:
    """Return a value in words: None, True and calls are no words of a reader of reports."""
    if isinstance(value, ast.Call):
        inner = ", ".join(_describe_arguments(value))
        return f"by {ast.unparse(value.func)}" + (f" ({inner})" if inner else "")
    if isinstance(value, ast.Tuple | ast.List):
        return ", ".join(map(_describe_value, value.elts)) or "chosen from the log"
    text = ast.unparse(value)
    return {"None": "automatic", "True": "yes", "False": "no"}.get(text, text.strip("'"))


def true_coefficients(comparison: Comparison) -> dict[str, float]:
    """Return the true coefficients of a simulated campaign; none of another log."""
    truth = comparison.provenance.get("truth")
    return CampaignSetup.of(truth).truth.damping.as_dict() if truth in TRUTHS else {}
