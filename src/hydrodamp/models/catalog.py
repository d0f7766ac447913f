"""The paper's eight damping models, each a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.errors import ModelError, no_such
from hydrodamp.models.model import DampingModel

PAPER = (
    "Gibson, McCarter, Stilwell, Neu: A Comparison of Hydrodynamic Damping Models using "
    "Least-Squares and Adaptive Identifier Methods for Autonomous Underwater Vehicles"
)
"""The paper all eight are taken from."""

BIBTEX = """@inproceedings{gibson-mccarter-stilwell-neu,
  author    = {Gibson, Scott B. and McCarter, Brian and Stilwell, Daniel J. and Neu, Wayne L.},
  title     = {A Comparison of Hydrodynamic Damping Models using Least-Squares and Adaptive
               Identifier Methods for Autonomous Underwater Vehicles},
  booktitle = {OCEANS 2015},
  year      = {2015}
}"""

ALL_AXES = " ".join(AXES)

MCFARLAND_WHITCOMB = DampingModel.from_table(
    {ALL_AXES: [f"{signed}|{other}|" for signed in VELOCITIES for other in VELOCITIES]},
    key="mcfarland-whitcomb",
    title="McFarland-Whitcomb",
    source=f"{PAPER}, II.C.2; after McFarland and Whitcomb, adaptive identification "
    "(C. McFarland, PhD thesis, Johns Hopkins University, 2013)",
    note="The printed product of a matrix, diag(nu) and |nu| would give 36 numbers; Table I says "
    "216, which is the sum over i of |nu_i| D_i nu: all 36 products a|b| on every axis.",
)

PITCH_YAW = DampingModel.from_table(
    {
        "X Y N": "r v r^2 |r| u^2 v^2 |u| |v| u|r| r|v| v|r| u|v| v|v| ur vr uv r|r|",
        "X Z M": "q w q^2 |q| u^2 |u| w^2 |w| u|q| q|w| w|q| u|w| w|w| uq wq uw q|q|",
    },
    key="pitch-yaw",
    title="Pitch-yaw",
    source=f"{PAPER}, II.C.3",
    note="The printed X row is garbled (29 terms). As the text says, X superimposes the yaw and "
    "the pitch set: 17 + 17 less the shared u^2 and |u| = 32, and 32 + 4*17 = 100 as in Table I. "
    "The K row is empty: any residual roll moment stays unmodelled.",
)

GERTLER_HAGEN = DampingModel.from_table(
    {
        "X": "q^2 r^2 u^2 v^2 w^2 v^2(eta-1) w^2(eta-1) pr vr wq",
        "Y": "u^2 vV pq qr up ur vq wp wr uv vw |r|V_v p|p| vV(eta-1) ur(eta-1) uv(eta-1)",
        "Z": "p^2 r^2 u^2 v^2 u|w| wV pr uq vp vr uw |q|V_w |w|V wV(eta-1) uq(eta-1) uw(eta-1)",
        "K": "u^2 u^2(eta-1) vV pq qr up ur vq wp wr uv vw p|p|",
        "M": "p^2 r^2 u^2 v^2 qV wV pr uq vp vr uw |w|V q|q| u|w| wV(eta-1) uq(eta-1) uw(eta-1)",
        "N": "u^2 rV vV pq qr up ur vq wp wr uv vw r|r| vV(eta-1) ur(eta-1) uv(eta-1)",
    },
    key="gertler-hagen",
    title="Gertler-Hagen",
    source=f"{PAPER}, II.C.4; after M. Gertler and G. R. Hagen, Standard Equations of Motion for "
    "Submarine Simulation, NSRDC report 2510, 1967",
    note="Print does not say that V = sqrt(v^2+w^2) is the crossflow speed, V_v = sign(v) V, "
    "V_w = sign(w) V, and eta = u_c/U: the steady speed of the present propeller speed over the "
    "present speed. Without a propeller speed eta is one and the 15 terms with (eta-1) vanish.",
)

LINEAR = DampingModel.from_table(
    {ALL_AXES: VELOCITIES},
    key="linear",
    title="Linear",
    source=f"{PAPER}, II.C.1",
    note="Every axis linear in all six velocities; the paper's preferred model.",
)

COE = DampingModel.from_table(
    {"X Z M": "u^2 v^2 w^2 p^2 q^2 r^2 w|w| q|q|", "Y K N": "v|v| p|p| r|r|"},
    key="coe",
    title="Coe",
    source=f"{PAPER}, II.C.5; after R. Coe, PhD dissertation, Virginia Tech, 2013",
    note="Print gives 36 terms, Table I says 33. While u > 0 the columns u^2 and u|u| are one and "
    "the same; u|u| is left out of X, Z and M, which gives the 33 of the table. The 36 are "
    "coe-as-printed.",
)

COE_AS_PRINTED = replace(
    COE.with_terms({"X Z M": "u|u|"}, key="coe-as-printed"),
    title="Coe as printed",
    note="The printed equations give 36 terms where Table I says 33. While u > 0 the columns u^2 "
    "and u|u| are one and the same, so these 36 columns have rank 33. See coe.",
)

PRESTERO = DampingModel.from_table(
    {
        "X": "q^2 wq r^2 vr u|u|",
        "Y N": "v|v| pq ur wp uv r|r|",
        "Z M": "w|w| pr uq vp uw q|q|",
        "K": "p|p|",
    },
    key="prestero",
    title="Prestero",
    source=f"{PAPER}, II.C.6; after T. Prestero, Verification of a Six-Degree of Freedom "
    "Simulation Model for the REMUS Autonomous Underwater Vehicle, MSc thesis, MIT/WHOI, 2001",
    note="Axial drag, crossflow drag and body lift; the K row has p|p| alone.",
)

UNCOUPLED = DampingModel.from_table(
    {axis: f"{of} {of}^2 |{of}| {of}|{of}|" for axis, of in zip(AXES, VELOCITIES, strict=True)},
    key="uncoupled",
    title="Uncoupled",
    source=f"{PAPER}, II.C.7",
    note="The printed labels do not tell nu_i^2, |nu_i| and nu_i|nu_i| apart: row i has all three "
    "and nu_i. While u > 0 the X row has rank 2.",
)

FOSSEN = DampingModel.from_table(
    {axis: f"{of} {of}|{of}|" for axis, of in zip(AXES, VELOCITIES, strict=True)},
    key="fossen",
    title="Fossen",
    source=f"{PAPER}, II.C.8; after T. I. Fossen's textbook on marine craft",
    note="Uncoupled motion and three planes of symmetry: linear and quadratic drag on each axis.",
)

catalog: Mapping[str, DampingModel] = MappingProxyType(
    {
        model.key: model
        for model in (
            *(MCFARLAND_WHITCOMB, PITCH_YAW, GERTLER_HAGEN, LINEAR, COE, PRESTERO),
            *(UNCOUPLED, FOSSEN, COE_AS_PRINTED),
        )
    }
)
"""The paper's eight models in the order of Table I, then ``coe-as-printed``, by key."""

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
        If there is no such model, with the nearest key.

    Examples
    --------
    >>> find_model("gertler-hagen").n_coefficients
    88
    """
    if key not in catalog:
        raise ModelError(no_such("model", key, catalog))
    return catalog[key]
