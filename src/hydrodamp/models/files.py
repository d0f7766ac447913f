"""Models in YAML and damping coefficients in JSON: pydantic models of the files, both ways."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, field_validator

from hydrodamp.arrays import MAX_MAGNITUDE, FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.errors import ModelError, did_you_mean, has_controls, list_faults
from hydrodamp.faults import faults_in, validate
from hydrodamp.files import load_json, load_yaml, save_json, save_text, wrong_kind_message
from hydrodamp.models.catalog import catalog
from hydrodamp.models.damping import Damping, VehicleStamp
from hydrodamp.models.model import DampingModel, coefficient_unit, group_axes, read_label


def _spellings(given: object) -> object:
    """Return the terms of an axis as a list of spellings; a lone 1 is the constant."""
    if isinstance(given, bool):
        raise ValueError("must be terms, such as 'u u|u|'; got true or false")
    if isinstance(given, str | int):
        return str(given).split()
    return [*map(str, given)] if isinstance(given, list) else given


def _text(given: object) -> object:
    """Return a name that YAML took for a number, or nothing, as text."""
    if given is None:
        return ""
    if isinstance(given, str) and has_controls(given):
        raise ValueError("must be text without control characters; remove them")
    plain = isinstance(given, int | float) and not isinstance(given, bool)
    return str(given) if plain else given


Text = Annotated[str, BeforeValidator(_text)]
Terms = dict[Text, Annotated[list[str], BeforeValidator(_spellings)]]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)] | None
Coefficient = (
    Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-MAX_MAGNITUDE, le=MAX_MAGNITUDE)]
    | None
)


class _Model(BaseModel):
    """Entries of a model that files of all kinds share."""

    title: Text = ""
    source: Text = ""
    note: Text = ""
    terms: Terms = {}


class ModelEntry(_Model):
    """A model in a file."""

    model_config = ConfigDict(extra="forbid", frozen=True, str_strip_whitespace=True)

    name: Annotated[Text, Field(min_length=1)]
    extends: Text = ""

    @field_validator("terms")
    @classmethod
    def _terms_once(cls, terms: Terms) -> Terms:
        counts = Counter(
            (axis, word) for axes, row in terms.items() for axis in axes.split() for word in row
        )
        twice = [f"`{word}` on {axis}" for (axis, word), count in counts.items() if count > 1]
        if twice:
            raise ValueError(f"must name each term of an axis once; given twice: {twice[0]}")
        return terms

    def build(self, known: Mapping[str, DampingModel]) -> DampingModel:
        """Return the model; one that it extends must be known."""
        if not self.terms and not self.extends:
            raise ModelError("it needs `terms`, such as {X: 'u u|u|', Y N: 'v r'}")
        words = self.model_dump(exclude={"name", "extends", "terms"})
        model = DampingModel.from_table(self.terms, key=self.name, **words)
        if not self.extends:
            return model
        if self.extends == "sparse":
            raise ModelError(
                "`sparse` is selected from each log and cannot be extended: leave `extends` out "
                "and name this model and sparse, as in `--models FILE,sparse`. Terms of yours with "
                "commands, weight or a constant are kept in the selection, others offered to it."
            )
        if self.extends not in known:
            raise ModelError(
                f"there is no model '{self.extends}' to extend.{did_you_mean(self.extends, known)}"
            )
        parent = known[self.extends]
        source = self.source or f"Extends {parent.key}. {parent.source}".strip()
        return replace(model, terms=parent.with_terms(self.terms).terms, source=source)


class ModelDocument(_Model):
    """The structure of a damping in its file."""

    key: Text


class CovarianceDocument(BaseModel):
    """The covariance of the coefficients, rows and columns in the order of their labels."""

    order: list[str]
    matrix: list[list[Number]]

    def of(self, labels: tuple[str, ...]) -> FloatArray:
        """Return the matrix in the order of the labels."""
        n = len(labels)
        if tuple(self.order) != labels:
            raise ModelError(f"covariance.order must be {' '.join(labels)}")
        if [len(row) for row in self.matrix] != [n] * n:
            raise ModelError(f"covariance.matrix must be {n} rows of {n} numbers")
        return np.array(self.matrix, dtype=np.float64).reshape(n, n)


class DampingDocument(BaseModel):
    """A damping file: the numbers, and what they mean."""

    format: Literal["hydrodamp-damping"] = "hydrodamp-damping"
    version: Literal[1] = 1
    frame: str = "FRD body axes: x forward, y starboard, z down; SI units, radians."
    reference_point: str = "Origin of the body frame of the vehicle file."
    sign_convention: str = (
        "The wrench is on the right-hand side of M dnu/dt = H(M nu) nu + K xi(nu) + G + u: "
        "negative along the motion where it dissipates."
    )
    eta: str = (
        "eta = u_c/U: u_c is the steady surge speed that the present propeller speed gives in "
        "straight level motion, U the present speed; terms carry (eta-1)."
    )
    content: str = (
        "Viscous remainder: H(M nu) nu with the full M (rigid body and added mass) is not in it."
    )
    model: ModelDocument
    coefficients: dict[str, Coefficient]
    units: dict[str, str] = {}
    covariance: CovarianceDocument | None = None
    vehicle: VehicleStamp | None = None
    source: Text = ""
    note: Text = ""

    def damping(self) -> Damping:
        """Return the numbers with their model."""
        model = DampingModel.from_table(
            self.model.terms, **self.model.model_dump(exclude={"terms"})
        )
        model.check_labels(self.coefficients)
        values = [self.coefficients[label] for label in model.labels]
        covariance = None if self.covariance is None else self.covariance.of(model.labels)
        numbers = np.array(values, dtype=np.float64)
        return Damping(model, numbers, covariance, self.vehicle, self.source, self.note)


def read_models(path: str | os.PathLike[str]) -> tuple[DampingModel, ...]:
    """Return the models of a file.

    Parameters
    ----------
    path : str or path
        YAML: one model, ``{name, title, source, note, extends, terms}``, or a list of
        such under ``models``. ``terms`` maps axes to terms, ``{X: "u u|u|", Y N: "v r"}``;
        ``extends`` names a model of the catalogue or an earlier one of the file.

    Returns
    -------
    models : tuple of DampingModel
        In the order of the file.

    Raises
    ------
    FileError
        If the file cannot be read or is no YAML, with its line.
    ModelError
        Naming every fault of the file, each with its place; or what else it is.
    """
    content = load_yaml(path)
    if message := wrong_kind_message(content, str(path), "models"):
        raise ModelError(message)
    if not isinstance(content, Mapping):
        raise ModelError(
            f"{path}: a model file must be keys and values ({' '.join(ModelEntry.model_fields)}); "
            "several models go under `models:`, as a list."
        )
    several = "models" in content
    entries = content["models"] if several else [content]
    if several and (len(content) > 1 or not isinstance(entries, list) or not entries):
        raise ModelError(
            f"{path}: `models` must be a list of at least one model, and no other key is "
            f"allowed; got {' '.join(map(str, content))}."
        )
    faults: list[str] = []
    models: dict[str, DampingModel] = {}
    for index, entry in enumerate(entries):
        where = f"models[{index}]: " if several else ""
        try:
            model = ModelEntry.model_validate(entry).build({**catalog, **models})
        except ValidationError as error:
            faults.extend(where + fault for fault in faults_in(error, entry, ModelEntry))
        except ModelError as error:
            faults.append(f"{where}{error}")
        else:
            if model.key in models:
                faults.append(f"{where}the name '{model.key}' comes twice.")
            models[model.key] = model
    if faults:
        raise ModelError(list_faults(str(path), faults))
    return tuple(models.values())


def write_model(model: DampingModel, path: str | os.PathLike[str]) -> None:
    """Write a model to a file that :func:`read_models` reads back.

    Parameters
    ----------
    model : DampingModel
        Any model.
    path : str or path
        The YAML file; written whole or not at all.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    save_text(format_model(model), path)


def format_model(model: DampingModel) -> str:
    """Return the text of a model file."""
    import yaml

    terms = {
        " ".join(axes): " ".join(map(str, row)) for row, axes in group_axes(model).items() if row
    }
    words = {"name": model.key, "title": model.title, "source": model.source, "note": model.note}
    document = {**{name: text for name, text in words.items() if text}, "terms": terms}
    return str(yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=88))


def write_damping(damping: Damping, path: str | os.PathLike[str]) -> None:
    """Write a damping to a JSON file that :func:`read_damping` reads back.

    Parameters
    ----------
    damping : Damping
        Its numbers are written in full precision; one that is not finite as null.
    path : str or path
        The file; written whole or not at all.

    Raises
    ------
    FileError
        If the file cannot be written.
    ModelError
        If no coefficient has a number, as after a fit that was refused.
    """
    if damping.coefficients.size and not np.isfinite(damping.coefficients).any():
        raise ModelError(f"{path}: not written: no coefficient of the damping has a number.")
    save_json(damping_document(damping), path)


def read_damping(path: str | os.PathLike[str]) -> Damping:
    """Return the damping of a file.

    Parameters
    ----------
    path : str or path
        A JSON file written by :func:`write_damping`.

    Returns
    -------
    damping : Damping
        The same numbers, bit for bit.

    Raises
    ------
    FileError
        If the file cannot be read or is no JSON, with its line.
    ModelError
        Naming every fault of the file.
    """
    # YAML is a vehicle, a mapping or a model of the user's: it is read to say which.
    is_yaml = Path(path).suffix.lower() in (".yaml", ".yml")
    damping = damping_from_document(load_yaml(path) if is_yaml else load_json(path), str(path))
    if damping.coefficients.size and not np.isfinite(damping.coefficients).any():
        raise ModelError(
            f"{path}: no coefficient has a number: the fit that it comes from was refused or"
            " failed, and its `fit` says why. Give a fit that succeeded."
        )
    return damping


def damping_document(damping: Damping) -> dict[str, Any]:
    """Return a damping as what its JSON file holds; for embedding in larger files."""
    model, covariance = damping.model, damping.covariance
    terms = {axis: [*map(str, row)] for axis, row in zip(AXES, model.terms, strict=True)}
    return DampingDocument(
        model=ModelDocument(
            key=model.key, title=model.title, source=model.source, note=model.note, terms=terms
        ),
        coefficients={label: finite(value) for label, value in damping.as_dict().items()},
        units={label: coefficient_unit(*read_label(label)) for label in model.labels},
        covariance=None
        if covariance is None
        else CovarianceDocument(
            order=[*model.labels],
            matrix=[[finite(value) for value in row] for row in covariance.tolist()],
        ),
        vehicle=damping.vehicle,
        source=damping.source,
        note=damping.note,
    ).model_dump(mode="json")


def damping_from_document(document: object, source: str = "damping") -> Damping:
    """Return the damping of a document."""
    if message := wrong_kind_message(document, source, "damping"):
        raise ModelError(message)
    content = validate(DampingDocument, document, source, ModelError)
    try:
        return content.damping()
    except ModelError as error:
        raise ModelError(f"{source}: {error}") from error


def finite(value: float | None) -> float | None:
    """Return a number that strict JSON can hold."""
    return value if value is None or math.isfinite(value) else None
