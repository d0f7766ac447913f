"""JSON documents of results, written and read; a number that is not finite is null."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from hydrodamp.identification.fit_files import adequacy_document, names_of
from hydrodamp.identification.grades import count_determined
from hydrodamp.simulation.replay import AttitudeSource, Horizon, HorizonScore, RateUnit, Score
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.validation.cross_validation import CrossValidation
from hydrodamp.validation.verdict import AxisVerdict, Verdict


class Divergence(BaseModel):
    """Segment and time of a divergence [s]."""

    segment: str
    time: float


class WindowsDocument(BaseModel):
    """Errors over prediction windows of a given length [s]."""

    seconds: Horizon
    n: int
    n_diverged: int
    rms: float | None
    rms_by_axis: dict[str, float | None]
    fit_by_axis: dict[str, float | None]

    @classmethod
    def of(cls, score: HorizonScore) -> WindowsDocument:
        """Return the document of a score."""
        errors = {key: getattr(score.score, key) for key in ("rms", "rms_by_axis", "fit_by_axis")}
        return cls(seconds=score.horizon, n=score.n_windows, n_diverged=score.n_diverged, **errors)

    def score(self, rate_unit: RateUnit) -> HorizonScore:
        """Return the errors."""
        score = Score(self.rms, self.rms_by_axis, self.fit_by_axis, rate_unit, ())
        return HorizonScore(self.seconds, score, self.n, self.n_diverged)


class RowDocument(BaseModel):
    """Fields read from a row of ``comparison.json``; its fit has a separate file."""

    fit: Annotated[str, Field(pattern=r"^[^/\\]+$")]  # a plain file name
    rms: float | None
    rms_by_axis: dict[str, float | None]
    fit_by_axis: dict[str, float | None]
    rms_by_segment: dict[str, float | None]
    diverged_at: tuple[Divergence, ...] | None
    windows: WindowsDocument | None = None

    def score(self, rate_unit: RateUnit) -> Score:
        """Return the score of the row."""
        diverged = tuple((at.segment, at.time) for at in self.diverged_at or ())
        errors = self.rms, self.rms_by_axis, self.fit_by_axis, rate_unit
        return Score(*errors, diverged, self.rms_by_segment)


class Provenance(BaseModel):
    """Provenance of a comparison: settings and free text."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, str]

    attitude: AttitudeSource
    rate_unit: RateUnit


class ComparisonDocument(BaseModel):
    """Fields read from ``comparison.json``."""

    rows: tuple[RowDocument, ...]
    provenance: Provenance


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """Return the content of ``comparison.json``."""
    names = names_of(row.fit for row in comparison.rows)
    return {
        "format": "hydrodamp-comparison",
        "version": 1,
        "verdict": selection_document(comparison),
        "rows": [_row(row, name) for row, name in zip(comparison.rows, names, strict=True)],
        "units": {
            **error_units(comparison.rate_unit),
            "coefficients": "SI, radians; N or N m on the right-hand side, by label in fits/*.json",
        },
        "provenance": provenance_of(comparison),
    }


def _row(row: Row, name: str) -> dict[str, Any]:
    values = row.fit.damping.as_dict()
    return {
        **{key: getattr(row, key) for key in ("model", "method", "n_coefficients")},
        "rank": row.fit.rank,
        "n_determined": count_determined(row.grades),
        "adequacy": adequacy_document(row.adequacy),
        "standard_error": None
        if row.blocks is None or row.divergences
        else row.blocks.standard_error,
        **score_fields(row.score),
        "status": row.status.word,
        "coefficients": values if row.fit.status.usable else dict.fromkeys(values),
        "fit": name,
        **({"windows": WindowsDocument.of(row.windows).model_dump()} if row.windows else {}),
    }


def provenance_of(comparison: Comparison) -> dict[str, str]:
    """Return the provenance of a comparison with settings and version."""
    import hydrodamp

    texts = dict(comparison.provenance)
    version = texts.pop("hydrodamp", hydrodamp.__version__)
    settings = {"attitude": comparison.attitude, "rate_unit": comparison.rate_unit}
    return {**texts, **settings, "hydrodamp": version}


def score_document(score: Score, attitude: str) -> dict[str, Any]:
    """Return a score as a document."""
    units = error_units(score.rate_unit)
    return {**score_fields(score), "units": units, "attitude": attitude}


def score_fields(score: Score) -> dict[str, Any]:
    """Return the fields of a score in documents."""
    # Rounded to 1 ns, the resolution of clock differences.
    divergences = [{"segment": name, "time": round(float(t), 9)} for name, t in score.diverged]
    kinds = ("rms", "rms_by_axis", "fit_by_axis", "rms_by_segment")
    errors = {key: getattr(score, key) for key in kinds}
    return {**errors, "status": score.status.word, "diverged_at": divergences or None}


def error_units(rate_unit: str) -> dict[str, str | dict[str, str]]:
    """Return the units of errors and fits."""
    return {
        "rms": f"m/s and {rate_unit}/s mixed (eq. 24)",
        "rms_by_axis": {**dict.fromkeys("uvw", "m/s"), **dict.fromkeys("pqr", f"{rate_unit}/s")},
        "fit_by_axis": "%, 100 (1 - rmse/std)",
        "diverged_at": "s since the start of the segment",
    }


def selection_document(table: Comparison | CrossValidation) -> dict[str, Any] | None:
    """Return the verdict on fits as a document; None where nothing was identified."""
    if all(row.blocks is None for row in table.rows):
        return None
    return verdict_document(table.verdict())


def verdict_document(verdict: Verdict) -> dict[str, Any]:
    """Return a verdict as a document."""
    return {**asdict(verdict), "axes": axes_document(verdict.axes), "text": str(verdict)}


def axes_document(axes: Iterable[AxisVerdict]) -> dict[str, Any]:
    """Return the lights of velocities as a document."""
    return {
        axis.velocity: {
            "light": axis.light.word,
            "fit": axis.fit,
            "standard_error": axis.standard_error,
            "reason": axis.reason,
        }
        for axis in axes
    }
