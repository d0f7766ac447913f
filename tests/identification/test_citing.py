"""References of a fit: the model's and the method's, each entry once."""

from __future__ import annotations

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.fit import Fit

LINEAR = hd.catalog["linear"]


def fit_by(method: str) -> Fit:
    return Fit(hd.Damping(LINEAR, np.zeros(36)), method, hd.Status.OK)


@pytest.mark.parametrize(
    ("method", "entries"),
    [("ls", 1), ("weak", 2), ("ridge", 2), ("recommended", 3), ("oe", 1), ("mine", 1)],
)
def test_each_entry_stands_once(method: str, entries: int) -> None:
    said = hd.cite(fit_by(method))
    assert said.startswith(f"Method: {method} of hydrodamp.")
    assert said.count("@") == entries
    assert said.count("gibson-mccarter-stilwell-neu") == 1


def test_models_and_coefficients_as_before() -> None:
    assert hd.cite(LINEAR).count("@") == 1
    assert "Coefficients:" in hd.cite(hd.published["vt690-sname2022"])
