"""Files of fits: JSON documents of a damping with its fit, and the fits of a folder of results."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, PlainSerializer

from hydrodamp.errors import unique_names
from hydrodamp.faults import validate
from hydrodamp.files import as_json, load_json
from hydrodamp.identification.adequacy import Adequacy, Form
from hydrodamp.identification.fit import Fit, Uncertainty
from hydrodamp.identification.grades import Grade
from hydrodamp.identification.parameters import Estimate
from hydrodamp.kernels.kalman import Noise
from hydrodamp.models.damping import Damping
from hydrodamp.models.files import damping_document, damping_from_document, finite
from hydrodamp.results import save_results
from hydrodamp.status import Status, TextEnum
from hydrodamp.vehicle.file import build_vehicle, vehicle_entry
from hydrodamp.vehicle.vehicle import Vehicle

#: Model and method of a fit.
Key = tuple[str, str]

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

#: Pushes and errors of sensors, arrays as lists.
NoiseContent = Annotated[
    Noise,
    BeforeValidator(lambda value: Noise(**value) if isinstance(value, dict) else value),
    PlainSerializer(lambda each: {key: _list_rows(value) for key, value in vars(each).items()}),
]

#: A vehicle as the content of its file.
VehicleContent = Annotated[Vehicle, BeforeValidator(_read_vehicle), PlainSerializer(vehicle_entry)]


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
    noise: NoiseContent | None = None

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


def write_fit(fit: Fit, folder: Path) -> None:
    """Write one fit into a folder of results."""
    (name,) = names_of((fit,))
    content = as_json(fit_document(fit)).encode("utf-8")
    save_results({folder / "fits" / f"{name}.json": content}, folder)


def read_finished_fits(folder: Path, digests: Mapping[Key, str]) -> dict[Key, Fit]:
    """Return the fits of a folder of results that have these digests."""
    paths = {
        (model, method): folder / "fits" / f"{model}.{method}.{digest[:8]}.json"
        for (model, method), digest in digests.items()
    }
    return {key: read_fit(path) for key, path in paths.items() if path.is_file()}
