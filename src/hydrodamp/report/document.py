"""Results as documents of strict JSON: null where there is no number, never NaN."""

from __future__ import annotations

import math

from hydrodamp.identification.fit import Fit
from hydrodamp.identification.intervals import Uncertainty
from hydrodamp.models.files import damping_document
from hydrodamp.report.fit_names import fit_names
from hydrodamp.simulation.score import Score
from hydrodamp.validation.comparison import Comparison, Row

Document = dict[str, object]


def comparison_document(comparison: Comparison) -> Document:
    """Return what ``comparison.json`` holds."""
    import hydrodamp

    return {
        "rows": [
            {**row_document(row), "fit": name}
            for row, name in zip(
                comparison.rows, fit_names(row.fit for row in comparison.rows), strict=True
            )
        ],
        "units": _units(comparison),
        "provenance": {
            **comparison.provenance,
            "attitude": comparison.attitude,
            "rate_unit": comparison.rate_unit,
            "hydrodamp": hydrodamp.__version__,
        },
    }


def row_document(row: Row) -> Document:
    """Return a row of a comparison as ``comparison.json`` has it."""
    fit = row.fit
    values = fit.damping.as_dict()
    known = fit.status.usable
    return {
        "model": row.model,
        "method": row.method,
        "n_coefficients": fit.model.n_coefficients,
        "rank": fit.rank,
        **_score(row.score),
        "status": row.status.word,
        "diverged_at": diverged_at(row.score),
        "coefficients": {
            label: number(value) if known else None for label, value in values.items()
        },
    }


def score_document(score: Score, attitude: str) -> Document:
    """Return a score as a document."""
    return {
        **_score(score),
        "status": score.status.word,
        "diverged_at": diverged_at(score),
        "units": error_units(score.rate_unit),
        "attitude": attitude,
    }


def fit_document(fit: Fit) -> Document:
    """Return a fit as a document that is also a damping file."""
    return {
        **damping_document(fit.damping),
        "fit": {
            "method": fit.method,
            "status": fit.status.word,
            "rank": fit.rank,
            "aliased": [list(group) for group in fit.aliased],
            "n_samples": fit.n_samples,
            "provenance": fit.provenance,
            "remarks": list(fit.remarks),
            "uncertainty": _uncertainty(fit.uncertainty),
        },
    }


def diverged_at(score: Score) -> list[Document] | None:
    """Return where and when a replay diverged."""
    return [{"segment": name, "time": moment(time)} for name, time in score.diverged] or None


def error_units(rate_unit: str) -> Document:
    """Return the units of errors and fits."""
    linear, angular = dict.fromkeys("uvw", "m/s"), dict.fromkeys("pqr", f"{rate_unit}/s")
    return {
        "rms": f"m/s and {rate_unit}/s mixed (eq. 24)",
        "rms_by_axis": {**linear, **angular},
        "fit_by_axis": "%, 100 (1 - rmse/std)",
        "diverged_at": "s since the start of the segment",
    }


def number(value: float | None) -> float | None:
    """Return a number that strict JSON can hold."""
    return None if value is None or not math.isfinite(value) else float(value)


def moment(time: float) -> float:
    """Return a time to the nanosecond [s], without the rounding of a difference of clocks."""
    return round(float(time), 9)


def _score(score: Score) -> Document:
    return {
        "rms": number(score.rms),
        "rms_by_axis": {name: number(value) for name, value in score.rms_by_axis.items()},
        "fit_by_axis": {name: number(value) for name, value in score.fit_by_axis.items()},
    }


def _uncertainty(found: Uncertainty | None) -> Document | None:
    """Return what intervals are made with; their covariance stands in the damping."""
    if found is None:
        return None
    noise = None if found.noise is None else [number(value) for value in found.noise.diagonal()]
    return {
        "degrees_of_freedom": number(found.degrees_of_freedom),
        "method": found.method,
        "block": number(found.block),
        "n_blocks": found.n_blocks,
        "allowance": found.allowance,
        "noise_variances": noise,
    }


def _units(comparison: Comparison) -> Document:
    return {
        **error_units(comparison.rate_unit),
        "coefficients": "SI, radians; N or N m on the right-hand side, by label in fits/*.json",
    }
