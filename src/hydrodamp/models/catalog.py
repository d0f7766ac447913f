"""The paper's eight damping models, and published coefficient sets, read from package data."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.term import AXES, VELOCITIES, Term
from hydrodamp.errors import ModelError, UnknownModelError, no_such
from hydrodamp.files import PackageData, load_yaml, parse_yaml
from hydrodamp.models.damping import Damping, VehicleStamp
from hydrodamp.models.model import DampingModel, spell_label, table_of

_CONTENT: Any = load_yaml(Path(__file__).with_name("catalog.yaml"))

PAPER: str = _CONTENT["paper"]
"""The paper all eight are taken from."""

BIBTEX: str = _CONTENT["bibtex"]


def _read_entry(entry: dict[str, Any]) -> DampingModel:
    words = {**entry, "source": entry["source"].format(paper=PAPER)}
    return DampingModel.from_table(words.pop("terms"), **words)


class Catalog(Mapping[str, DampingModel]):
    """Models by key; an unknown key raises with the nearest one."""

    def __init__(self, models: Iterable[DampingModel]) -> None:
        self._models = {model.key: model for model in models}

    def __getitem__(self, key: str) -> DampingModel:
        """Return a model."""
        if key not in self._models:
            raise UnknownModelError(no_such("model", key, self))
        return self._models[key]

    def __iter__(self) -> Iterator[str]:
        """Return an iterator over the keys."""
        return iter(self._models)

    def __len__(self) -> int:
        """Return the number of models."""
        return len(self._models)

    def __repr__(self) -> str:
        """Return key, number of coefficients and title, a model a line."""
        return "\n".join(
            f"{model.key:<20}{model.n_coefficients:>4}  {model.title}" for model in self.values()
        )


catalog = Catalog(map(_read_entry, _CONTENT["models"]))
"""The paper's eight models in the order of Table I, ``coe-as-printed``, then models of ships."""

PAPER_MODELS = tuple(catalog)[:8]
"""Keys of the paper's eight models, in the order of Table I."""


def find_model(key: str) -> DampingModel:
    """Return a model of the catalogue.

    Parameters
    ----------
    key : str
        Such as ``"linear"``; see :data:`catalog`.

    Returns
    -------
    model : DampingModel
        With source and note.

    Raises
    ------
    ModelError
        If there is no such model, with the nearest key; `read_models` reads a file of models.

    Examples
    --------
    >>> find_model("gertler-hagen").n_coefficients
    88
    """
    if Path(key).suffix in (".yaml", ".yml"):
        raise UnknownModelError(f"'{key}' is no key of a model; `read_models` reads such a file.")
    return catalog[key]


def _read_published(name: str) -> Damping:
    if name not in published:
        raise ModelError(no_such("coefficient set", name, published))
    content = cast("dict[str, Any]", parse_yaml(published.text(name), name))
    values = {label: float(value) for label, value in content["coefficients"].items()}
    added = coriolis_coefficients(added_mass_matrix(content["added_mass"]))
    for label in content.get("contains_added_mass", ()):
        values[label] -= added.get(label, 0.0)
    base = catalog.get(content.get("model", ""))
    more = table_of(label for label in values if base is None or label not in base.labels)
    if base is None:
        model = DampingModel.from_table(more, key=name, source=content["source"])
    else:
        model = base.with_terms(more, key=name) if more else base
    return Damping.from_dict(
        model,
        {**dict.fromkeys(model.labels, 0.0), **values},
        vehicle=VehicleStamp(**content["vehicle"]) if "vehicle" in content else None,
        source=content["source"],
        note=content["note"],
    )


published = PackageData(Path(__file__).parent / "published", _read_published)
"""Published coefficient sets by name: ``vt690-sname2022``, ``remus100-prestero-theory``, ..."""


def added_mass_matrix(derivatives: Mapping[str, float]) -> FloatArray:
    """Return the added mass matrix of SNAME derivatives, such as ``Y_vdot``."""
    matrix = np.zeros((6, 6))
    for name, value in derivatives.items():
        axis, _, velocity = name.removesuffix("dot").partition("_")
        matrix[AXES.index(axis), VELOCITIES.index(velocity)] = -value
    return frozen((matrix + matrix.T) / 2.0)


def coriolis_coefficients(matrix: npt.ArrayLike) -> dict[str, float]:
    """Return ``H(A nu) nu`` as coefficients of products of two velocities."""
    mass, products = np.asarray(matrix, dtype=np.float64), np.zeros((6, 6, 6))
    for k, momentum in enumerate(mass.T):  # H(p) nu = [p1 x omega ; p1 x nu1 + p2 x omega]
        force, moment = (np.cross(half, np.eye(3)).T for half in np.split(momentum, 2))
        products[k, :3, 3:] = products[k, 3:, :3] = force
        products[k, 3:, 3:] = moment
    coefficients: dict[str, float] = {}
    for first, axis, second in np.argwhere(products).tolist():
        label = spell_label(AXES[axis], Term((VELOCITIES[first], VELOCITIES[second])))
        value = float(products[first, axis, second])
        coefficients[label] = coefficients.get(label, 0.0) + value
    return {label: value for label, value in coefficients.items() if value != 0.0}
