"""From the document of a damping file to a damping, with every fault at once."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import ModelError, did_you_mean, list_faults
from hydrodamp.models.damping import Damping, VehicleStamp
from hydrodamp.models.model import DampingModel
from hydrodamp.models.table import read_table


def read_document(document: Mapping[str, object], source: str) -> Damping:
    """Return the damping of a document whose format and version are right."""
    faults: list[str] = []
    model = _model(document.get("model"), faults)
    stamp = _stamp(document.get("vehicle"), faults)
    values = _values(document.get("coefficients"), model, faults)
    covariance = _covariance(document.get("covariance"), model, faults)
    if faults or model is None:
        raise ModelError(list_faults(source, faults))
    coefficients = np.array([values[label] for label in model.labels], dtype=np.float64)
    words = {field: str(document.get(field) or "") for field in ("source", "note")}
    return Damping(model, coefficients, covariance, stamp, **words)


def _model(content: object, faults: list[str]) -> DampingModel | None:
    if not isinstance(content, Mapping) or not isinstance(content.get("terms"), Mapping):
        faults.append("model: must hold `key` and `terms`, a list of terms for each axis.")
        return None
    terms = {str(axis): _spellings(row) for axis, row in content["terms"].items()}
    wrong = read_table(terms)[1]
    faults.extend(f"model.terms: {fault}" for fault in wrong)
    if wrong:
        return None
    words = {field: str(content.get(field) or "") for field in ("key", "title", "source", "note")}
    try:
        return DampingModel.from_table(terms, **words)
    except ModelError as error:
        faults.append(f"model.key: {error}")
        return None


def _spellings(row: object) -> list[str]:
    return [str(each) for each in row] if isinstance(row, list) else str(row).split()


def _stamp(content: object, faults: list[str]) -> VehicleStamp | None:
    if content is None:
        return None
    if not isinstance(content, Mapping):
        faults.append("vehicle: must be null or hold name, weight, buoyancy, mass_matrix_digest.")
        return None
    weight, buoyancy = (
        _number(content.get(field), f"vehicle.{field}", faults) for field in ("weight", "buoyancy")
    )
    digest = str(content.get("mass_matrix_digest") or "")
    return VehicleStamp(str(content.get("name") or ""), weight, buoyancy, digest)


def _values(content: object, model: DampingModel | None, faults: list[str]) -> dict[str, float]:
    if not isinstance(content, Mapping):
        faults.append("coefficients: must map labels to numbers, such as {'Y_v|v|': -120.0}.")
        return {}
    values = {
        str(label): _number(value, f"coefficients.{label}", faults, null=True)
        for label, value in content.items()
    }
    labels = model.labels if model is not None else tuple(values)
    for label in values:
        if label not in labels:
            near = did_you_mean(label, labels)
            faults.append(f"coefficients.{label}: the model has no such coefficient.{near}")
    faults.extend(f"coefficients.{label}: is missing." for label in labels if label not in values)
    return values


def _covariance(
    content: object, model: DampingModel | None, faults: list[str]
) -> FloatArray | None:
    if content is None or model is None:
        return None
    n = model.n_coefficients
    if not isinstance(content, Mapping) or content.get("order") != list(model.labels):
        faults.append("covariance: must hold `matrix` and `order`, the labels as in coefficients.")
        return None
    rows = content.get("matrix")
    if not isinstance(rows, list) or [len(row) for row in rows if isinstance(row, list)] != [n] * n:
        faults.append(f"covariance.matrix: must be {n} rows of {n} numbers.")
        return None
    numbers = [
        [_number(value, f"covariance.matrix[{i}][{j}]", faults, null=True) for j, value in cells]
        for i, cells in enumerate(map(enumerate, rows))
    ]
    return np.array(numbers, dtype=np.float64).reshape(n, n)


def _number(value: object, place: str, faults: list[str], *, null: bool = False) -> float:
    if value is None and null:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        faults.append(f"{place}: must be a finite number; got {value!r}.")
        return math.nan
    return float(value)
