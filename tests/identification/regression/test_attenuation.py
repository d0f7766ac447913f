"""What noise in the terms does to least squares, against its law."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.basis.basis import Basis
from hydrodamp.identification.regression.attenuation import attenuation
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.models.model import DampingModel

DRAG = DampingModel.from_table({"X": "u"}, key="drag")


def rows(surge, drag=-10.0, seconds=0.1):
    """Rows of a linear drag, the wrench exact."""
    n = len(surge)
    true = np.sin(0.5 * seconds * np.arange(n))
    target = np.outer(drag * true, [1.0, 0, 0, 0, 0, 0])
    time = seconds * np.arange(n)
    return Rows(Basis(DRAG.terms[0]), surge[:, None], target, np.zeros(n, dtype=int), time), true


@pytest.mark.parametrize("noise", [0.1, 0.5, 1.0])
def test_the_shift_is_what_attenuation_takes(noise):
    """Fuller (1987), section 1.1: the estimate is the truth times s^2 / (s^2 + noise^2)."""
    n = 20000
    _, true = rows(np.zeros(n))
    error = noise * np.random.default_rng(1).normal(size=n)
    noisy, _ = rows(true + error)
    kept = np.var(true) / (np.var(true) + noise**2)
    scatter = 10.0 * noise / np.sqrt(n * 0.5 * kept)  # of two-stage least squares
    assert attenuation(noisy, DRAG)[0] == pytest.approx(-10.0 * (1.0 - kept), abs=3.0 * scatter)


def test_exact_terms_leave_nothing_to_allow_for():
    n = 4000
    _, true = rows(np.zeros(n))
    exact, _ = rows(true)
    assert abs(attenuation(exact, DRAG)[0]) < 1e-9


def test_a_log_too_short_for_instruments_has_no_shift():
    _, true = rows(np.zeros(40))
    short, _ = rows(true)
    assert attenuation(short, DRAG).tolist() == [0.0]


def test_a_model_without_terms():
    """No coefficients, no shift."""
    exact, _ = rows(np.zeros(10))
    assert attenuation(exact, DampingModel.from_table({}, key="none")).shape == (0,)
