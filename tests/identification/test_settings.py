from __future__ import annotations

import pytest

import hydrodamp as hd
from hydrodamp.identification.methods import METHODS


@pytest.mark.parametrize("key", METHODS)
def test_a_fit_says_with_what_settings_it_was_made(
    key: str, driven, discrete_log, true_damping
) -> None:
    """By them a run that goes on tells whether the fits of a folder are its own."""
    model = hd.catalog["linear"]
    problem = hd.prepare(driven, discrete_log(true_damping(model), n=120), model)
    fit = METHODS[key].identify(problem, model)
    assert fit.provenance["settings"] == repr(METHODS[key])
    assert fit.method == key
