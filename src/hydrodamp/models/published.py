"""Coefficient sets from the literature, as the viscous remainder this package works with."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.errors import ModelError, no_such
from hydrodamp.files import PackageData, parse_yaml
from hydrodamp.models.catalog import catalog
from hydrodamp.models.damping import Damping, VehicleStamp
from hydrodamp.models.model import DampingModel, spell_label, table_of


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
