"""Coefficient sets from the literature, as the viscous remainder this package works with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any, cast

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import ModelError, did_you_mean
from hydrodamp.files import parse_yaml
from hydrodamp.models.added_mass import added_mass_matrix, coriolis_coefficients
from hydrodamp.models.catalog import find_model
from hydrodamp.models.damping import Damping, VehicleStamp
from hydrodamp.models.labels import read_label
from hydrodamp.models.model import DampingModel

_SUFFIX = ".yaml"


class PublishedSets(Mapping[str, Damping]):
    """The published coefficient sets by name, each read when it is first asked for."""

    def __getitem__(self, name: str) -> Damping:
        """Return a set, or raise a ModelError naming the nearest."""
        return find_published(name)

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a set of this name."""
        return name in _names()

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names, sorted."""
        return iter(_names())

    def __len__(self) -> int:
        """Return the number of sets."""
        return len(_names())


published: Mapping[str, Damping] = PublishedSets()
"""Published coefficient sets by name: ``vt690-sname2022``, ``remus100-prestero-theory``, ..."""


def find_published(name: str) -> Damping:
    """Return a published coefficient set."""
    _check_name(name)
    content = _content(name)
    values = {label: float(value) for label, value in content["coefficients"].items()}
    added = coriolis_coefficients(added_mass_of(name))
    for label in content.get("contains_added_mass", ()):
        values[label] -= added.get(label, 0.0)
    model = _model(content, tuple(values))
    return Damping.from_dict(
        model,
        {**dict.fromkeys(model.labels, 0.0), **values},
        vehicle=VehicleStamp(**content["vehicle"]) if "vehicle" in content else None,
        source=content["source"],
        note=content["note"],
    )


def added_mass_of(name: str) -> FloatArray:
    """Return the added mass matrix that a published set goes with."""
    _check_name(name)
    return added_mass_matrix(_content(name)["added_mass"])


def _check_name(name: str) -> None:
    if name not in _names():
        raise ModelError(
            f"No coefficient set is called '{name}'; published are {', '.join(_names())}."
            f"{did_you_mean(name, _names())}"
        )


@lru_cache
def _names() -> tuple[str, ...]:
    from importlib.resources import files

    entries = (files("hydrodamp.models") / "published").iterdir()
    return tuple(sorted(e.name.removesuffix(_SUFFIX) for e in entries if e.name.endswith(_SUFFIX)))


@lru_cache
def _content(name: str) -> dict[str, Any]:
    from importlib.resources import files

    text = (files("hydrodamp.models") / "published" / f"{name}{_SUFFIX}").read_text("utf-8")
    return cast("dict[str, Any]", parse_yaml(text, name))


def _model(content: Mapping[str, Any], labels: tuple[str, ...]) -> DampingModel:
    """Return the model of a set: the one it extends, if any, with the further labels it has."""
    base = find_model(content["model"]) if "model" in content else None
    extra: dict[str, list[str]] = {}
    for axis, term in map(read_label, labels):
        if base is None or f"{axis}_{term}" not in base.labels:
            extra.setdefault(axis, []).append(str(term))
    if base is None:
        return DampingModel.from_table(extra, key=content["name"], source=content["source"])
    return base.with_terms(extra, key=content["name"]) if extra else base
