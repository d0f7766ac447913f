"""JSON documents of results, written and read; a number that is not finite is null."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer

from hydrodamp.errors import unique_names
from hydrodamp.faults import validate
from hydrodamp.files import load_json
from hydrodamp.identification.adequacy import Adequacy, Form
from hydrodamp.identification.fit import Fit, Uncertainty
from hydrodamp.identification.grades import Grade, count_determined
from hydrodamp.identification.parameters import Estimate
from hydrodamp.models.damping import Damping
from hydrodamp.models.files import damping_document, damping_from_document, finite
from hydrodamp.simulation.replay import AttitudeSource, Horizon, HorizonScore, RateUnit, Score
from hydrodamp.status import Status, TextEnum
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.validation.cross_validation import CrossValidation
from hydrodamp.validation.verdict import AxisVerdict, Verdict
from hydrodamp.vehicle.file import build_vehicle, vehicle_entry
from hydrodamp.vehicle.vehicle import Vehicle

Text = TypeVar("Text", bound=TextEnum)


def _read_word(kind: type[Text], value: object) -> Text:
    """Return the member of an enumeration by its word."""
    if isinstance(value, kind):
        return value
    members = {member.word: member for member in kind}
    if str(value) not in members:
        raise ValueError(f"must be one of {', '.join(members)}; got {value!r}")
    return members[str(value)]


def _read_vehicle(value: object) -> object:
    return build_vehicle(value, "vehicle") if isinstance(value, dict) else value


#: A finite number, or null.
Number = Annotated[float | None, AfterValidator(finite)]

#: A status as its word.
_WORD = PlainSerializer(lambda member: member.word)
Outcome = Annotated[Status, BeforeValidator(partial(_read_word, Status)), _WORD]

#: A grade as its word.
GradeWord = Annotated[Grade, BeforeValidator(partial(_read_word, Grade)), _WORD]


def _read_estimate(value: object) -> object:
    """Return an estimate with NaN for the standard error that is null."""
    if isinstance(value, dict) and value.get("standard_error") is None:
        return value | {"standard_error": math.nan}
    return value


def _read_adequacy(value: object) -> object:
    """Return what score tests say, with the form by its word."""
    if isinstance(value, dict) and "form" in value:
        return value | {"form": _read_word(Form, value["form"])}
    return value


def adequacy_document(adequacy: Adequacy | None) -> dict[str, Any] | None:
    """Return what score tests say of a form as a document."""
    return None if adequacy is None else {**asdict(adequacy), "form": adequacy.form.word}


#: An estimate with its grade.
EstimateContent = Annotated[
    Estimate,
    BeforeValidator(_read_estimate),
    PlainSerializer(lambda each: {**asdict(each), "grade": each.grade.word}),
]

#: What score tests say of a form; the form by its word.
AdequacyContent = Annotated[
    Adequacy,
    BeforeValidator(_read_adequacy),
    PlainSerializer(adequacy_document),
]

#: A vehicle as the content of its file.
VehicleContent = Annotated[Vehicle, BeforeValidator(_read_vehicle), PlainSerializer(vehicle_entry)]


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


def names_of(fits: Iterable[Fit]) -> tuple[str, ...]:
    """Return a unique name of each fit from model, method and digest."""
    return unique_names(
        ".".join(filter(None, (fit.model.key, fit.method, fit.provenance.get("digest", "")[:8])))
        for fit in fits
    )


def _list_rows(matrix: object) -> object:
    return matrix.tolist() if isinstance(matrix, np.ndarray) else matrix


def _variances(noise: object) -> object:
    return noise.diagonal().tolist() if isinstance(noise, np.ndarray) else noise


class UncertaintyDocument(BaseModel):
    """Settings of confidence intervals; the covariance is a field of the damping."""

    degrees_of_freedom: Number
    method: str
    block: Number
    n_blocks: int
    bias_allowance: str
    noise: Annotated[tuple[Number, ...] | None, BeforeValidator(_variances)]
    bias: Annotated[tuple[Number, ...] | None, BeforeValidator(_list_rows)] = None

    def uncertainty(self, covariance: np.ndarray) -> Uncertainty:
        """Return the uncertainty with the covariance of its damping."""
        fields = self.model_dump()
        if self.degrees_of_freedom is None:
            fields["degrees_of_freedom"] = math.inf
        if self.noise is not None:
            fields["noise"] = np.diag(np.array(self.noise, dtype=np.float64))
        return Uncertainty(covariance, **fields)


class FitDocument(BaseModel):
    """Fields of a file of ``fits`` in addition to its damping."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    method: str
    status: Outcome
    rank: int | None
    aliased: tuple[tuple[str, ...], ...]
    n_samples: int
    provenance: dict[str, str]
    remarks: tuple[str, ...] = ()
    uncertainty: UncertaintyDocument | None = None
    training_range: dict[str, tuple[float, float]] = {}
    grades: dict[str, GradeWord] = {}
    vehicle: VehicleContent | None = None
    estimates: dict[str, EstimateContent] = {}
    parameter_covariance: Annotated[
        tuple[tuple[Number, ...], ...] | None, BeforeValidator(_list_rows)
    ] = None
    indirect: tuple[str, ...] = ()
    unconverged: tuple[str, ...] = ()
    held_out_r_squared: dict[str, float] = {}
    form_errors: dict[str, tuple[float, float, float]] = {}
    adequacy: AdequacyContent | None = None
    command_range: dict[str, tuple[float, float]] = {}

    def fit(self, damping: Damping) -> Fit:
        """Return the fit of a damping."""
        fields = {key: getattr(self, key) for key in type(self).model_fields}
        if self.uncertainty is not None and damping.covariance is not None:
            fields["uncertainty"] = self.uncertainty.uncertainty(damping.covariance)
        return Fit(damping=damping, **fields)


def fit_document(fit: Fit) -> dict[str, Any]:
    """Return a fit as a document that is also a damping file."""
    facts = FitDocument.model_validate(fit, from_attributes=True)
    return {**damping_document(fit.damping), "fit": facts.model_dump(mode="json")}


def read_fit(path: Path) -> Fit:
    """Return the fit of a file."""
    return _build_fit(load_json(path), path)


def read_damping_file(path: Path) -> tuple[Damping, Fit | None]:
    """Return the damping of a file, and its fit; None for a file of coefficients alone."""
    content = load_json(path)
    if isinstance(content, dict) and "fit" in content:
        fit = _build_fit(content, path)
        return fit.damping, fit
    return damping_from_document(content, str(path)), None


def _build_fit(content: object, path: Path) -> Fit:
    damping = damping_from_document(content, str(path))
    facts = content.get("fit") if isinstance(content, dict) else None
    return validate(FitDocument, facts, f"{path}, `fit`").fit(damping)


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
