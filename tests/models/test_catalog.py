"""The eight models against the paper, Table I and section II.C; models of ships in use."""

import re

import numpy as np
import pytest

from hydrodamp.basis.basis import UNION, Basis
from hydrodamp.errors import ModelError
from hydrodamp.models.catalog import PAPER_MODELS, catalog, find_model

# Table I, column n bar; the last is what the printed equations of section II.C.5 give.
COUNTS = {
    "mcfarland-whitcomb": 216,
    "pitch-yaw": 100,
    "gertler-hagen": 88,
    "linear": 36,
    "coe": 33,
    "prestero": 30,
    "uncoupled": 24,
    "fossen": 12,
    "coe-as-printed": 36,
}

# Of ships, in the horizontal plane.
SHIPS = {"abkowitz": 33, "mmg-hull": 17, "nomoto": 1}

# What each printed row of the longer models sums to when every coefficient is one, as formulas.
# h = eta - 1, cross = V = sqrt(v^2 + w^2), signed_v = sign(v) V, signed_w = sign(w) V.


def pitch_yaw(u, v, w, p, q, r, h):
    shared = u**2 + abs(u)
    yaw = r + v + r**2 + abs(r) + v**2 + abs(v)
    yaw = yaw + u * abs(r) + r * abs(v) + v * abs(r) + u * abs(v) + v * abs(v) + r * abs(r)
    yaw = yaw + u * r + v * r + u * v
    pitch = q + w + q**2 + abs(q) + w**2 + abs(w)
    pitch = pitch + u * abs(q) + q * abs(w) + w * abs(q) + u * abs(w) + w * abs(w) + q * abs(q)
    pitch = pitch + u * q + w * q + u * w
    return [shared + yaw + pitch, shared + yaw, shared + pitch, 0 * u, shared + pitch, shared + yaw]


def gertler_hagen(u, v, w, p, q, r, h):
    cross = np.hypot(v, w)
    signed_v, signed_w = np.sign(v) * cross, np.sign(w) * cross
    lateral = u**2 + v * cross + p * q + q * r + u * p + u * r + v * q + w * p + w * r
    lateral = lateral + u * v + v * w
    normal = p**2 + r**2 + u**2 + v**2 + w * cross + p * r + u * q + v * p + v * r + u * w
    normal = normal + u * abs(w) + abs(w) * cross + h * (w * cross + u * q + u * w)
    lateral_eta = h * (v * cross + u * r + u * v)
    axial = q**2 + r**2 + u**2 + v**2 + w**2 + h * (v**2 + w**2) + p * r + v * r + w * q
    return [
        axial,
        lateral + abs(r) * signed_v + p * abs(p) + lateral_eta,
        normal + abs(q) * signed_w,
        lateral + h * u**2 + p * abs(p),
        normal + q * cross + q * abs(q),
        lateral + r * cross + r * abs(r) + lateral_eta,
    ]


def prestero(u, v, w, p, q, r, h):
    lateral = v * abs(v) + p * q + u * r + w * p + u * v + r * abs(r)
    normal = w * abs(w) + p * r + u * q + v * p + u * w + q * abs(q)
    axial = q**2 + w * q + r**2 + v * r + u * abs(u)
    return [axial, lateral, normal, p * abs(p), normal, lateral]


FORMULAS = {"pitch-yaw": pitch_yaw, "gertler-hagen": gertler_hagen, "prestero": prestero}


def test_the_counts_of_table_1():
    assert {key: model.n_coefficients for key, model in catalog.items()} == COUNTS | SHIPS
    assert tuple(COUNTS)[:8] == PAPER_MODELS


def test_the_union_of_all_models_is_the_85_terms():
    assert Basis.union(*(catalog[key].basis for key in PAPER_MODELS)) == UNION


@pytest.mark.parametrize("key", FORMULAS)
def test_a_model_sums_to_the_printed_equations(key):
    """All coefficients one: each axis is the plain sum of its printed terms."""
    rng = np.random.default_rng(24)
    velocity, ratio = rng.normal(size=(50, 6)), rng.uniform(0.5, 1.5, 50)
    model = catalog[key]
    regressor = model.basis.evaluate(velocity, propulsion_ratio=ratio)
    found = regressor @ model.unpack(np.ones(model.n_coefficients)).T
    expected = np.stack(FORMULAS[key](*velocity.T, ratio - 1.0), axis=1)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("key", catalog)
def test_every_model_says_where_it_comes_from(key):
    model = catalog[key]
    assert re.search(
        "Gibson, McCarter, Stilwell, Neu" if key in COUNTS else r"19\d\d|20\d\d", model.source
    )
    assert model.note
    assert len(str(model).splitlines()) <= 24


@pytest.mark.parametrize("key", SHIPS)
def test_models_of_ships_have_horizontal_terms(key):
    assert {label[0] for label in catalog[key].labels} <= set("XYN")


def test_abkowitz_spans_the_series_of_mariner():
    """Chislett and Strom-Tejsen, in the perturbation of 7.7175 m/s: but for the constant."""
    u, v, r = np.random.default_rng(3).normal(size=(3, 60))
    velocity = np.column_stack([7.7175 + u, v, *np.zeros((3, 60)), r])
    series = {
        0: [u, u**2, u**3, v**2, r**2, r * v],
        1: [v, r, v**3, v**2 * r, v * u, r * u, u, u**2],
    }
    for axis, forces in series.items():
        terms = Basis(catalog["abkowitz"].terms[axis]).evaluate(velocity)
        columns = np.column_stack([terms, np.ones(60)])
        coefficients, *_ = np.linalg.lstsq(columns, np.transpose(forces))
        np.testing.assert_allclose(columns @ coefficients, np.transpose(forces), atol=1e-8)


def test_find_model_names_the_nearest(refused):
    assert find_model("linear") is catalog["linear"]
    refused(ModelError, find_model, "liner")
    refused(ModelError, find_model, "mine.yaml")
