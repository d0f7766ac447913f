"""Damping coefficients as a JSON file that says what its numbers mean."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path

from hydrodamp.basis.axes import AXES
from hydrodamp.errors import ForeignVehicleWarning, ModelError
from hydrodamp.files import load_json, load_yaml, mistaken, save_json
from hydrodamp.models.damping import Damping, VehicleStamp
from hydrodamp.models.damping_reader import read_document
from hydrodamp.models.labels import coefficient_unit, spell_label

FORMAT = "hydrodamp-damping"
VERSION = 1

MEANING = {
    "frame": "FRD body axes: x forward, y starboard, z down; SI units, radians.",
    "reference_point": "Origin of the body frame of the vehicle file.",
    "sign_convention": "The wrench stands on the right-hand side of M dnu/dt = H(M nu) nu + "
    "K xi(nu) + G + u: negative along the motion where it dissipates.",
    "eta": "eta = u_c/U: u_c is the steady surge speed that the present propeller speed gives in "
    "straight level motion, U the present speed; terms carry (eta-1).",
    "content": "Viscous remainder: H(M nu) nu with the full M (rigid body and added mass) is not "
    "in it.",
}
"""What every damping file says about its numbers."""


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
    """
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
    written = Path(path).suffix.lower() not in (".yaml", ".yml")
    # YAML is a vehicle, a mapping or a model of the user's: it is read to tell which.
    document = load_json(path) if written else load_yaml(path)
    return damping_from_document(document, str(path))


def damping_document(damping: Damping) -> dict[str, object]:
    """Return a damping as what its JSON file holds; for embedding in larger files."""
    model, stamp = damping.model, damping.vehicle
    return {
        "format": FORMAT,
        "version": VERSION,
        **MEANING,
        "model": {
            "key": model.key,
            "title": model.title,
            "source": model.source,
            "note": model.note,
            "terms": {
                axis: [str(term) for term in row]
                for axis, row in zip(AXES, model.terms, strict=True)
            },
        },
        "coefficients": {label: _finite(value) for label, value in damping.as_dict().items()},
        "units": dict(_units(damping)),
        "covariance": _covariance(damping),
        "vehicle": None
        if stamp is None
        else {
            "name": stamp.name,
            "weight": stamp.weight,
            "buoyancy": stamp.buoyancy,
            "mass_matrix_digest": stamp.mass_matrix_digest,
        },
        "source": damping.source,
        "note": damping.note,
    }


def damping_from_document(document: object, source: str = "damping") -> Damping:
    """Return the damping of a document."""
    if other := mistaken(document, source, "damping"):
        raise ModelError(other)
    if not isinstance(document, Mapping) or document.get("format") != FORMAT:
        raise ModelError(
            f"{source}: `format` must be '{FORMAT}': a damping file is written by hydrodamp "
            "identify --out, or by write_damping."
        )
    if document.get("version") != VERSION:
        raise ModelError(
            f"{source}: `version` must be {VERSION}; got {document.get('version')!r}. Read it with "
            "the release that wrote it."
        )
    return read_document(document, source)


def warn_if_foreign(damping: Damping, stamp: VehicleStamp) -> None:
    """Warn when coefficients are used with a vehicle they do not belong to."""
    own = damping.vehicle
    differences = [] if own is None else list(_differences(own, stamp))
    if own is not None and differences:
        warnings.warn(
            f"These coefficients belong to vehicle '{own.name}', used with '{stamp.name}': "
            f"{'; '.join(differences)}. The same forces have other coefficients under another "
            "mass matrix: identify them again, or use the vehicle they belong to.",
            ForeignVehicleWarning,
            stacklevel=2,
        )


def _differences(own: VehicleStamp, other: VehicleStamp) -> Iterator[str]:
    digests = own.mass_matrix_digest, other.mass_matrix_digest
    if all(digests) and digests[0] != digests[1]:
        yield "the mass matrix is another"
    for quantity in ("weight", "buoyancy"):
        theirs, ours = getattr(own, quantity), getattr(other, quantity)
        if not math.isclose(theirs, ours, rel_tol=1e-6, abs_tol=1e-6):
            yield f"{quantity} {theirs:g} N there, {ours:g} N here"


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _units(damping: Damping) -> Iterator[tuple[str, str]]:
    for axis, row in zip(AXES, damping.model.terms, strict=True):
        for term in row:
            yield spell_label(axis, term), coefficient_unit(axis, term)


def _covariance(damping: Damping) -> dict[str, object] | None:
    if damping.covariance is None:
        return None
    rows = [[_finite(value) for value in row] for row in damping.covariance]
    return {"order": list(damping.model.labels), "matrix": rows}
