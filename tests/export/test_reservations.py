"""What a fit is not for goes with its export: on the card and in the files."""

from dataclasses import replace

import pytest

import hydrodamp as hd
from hydrodamp.identification.adequacy import Adequacy, ScoreTest

CRAFT = hd.fleet["vt690"]
DAMPING = hd.published["vt690-sname2022"]


@pytest.mark.slow
@pytest.mark.parametrize(("target", "file"), [("python", "auv_vt690.py"), ("c", "auv_vt690.h")])
def test_an_export_states_the_form_and_the_velocities_of_its_fit(tmp_path, target, file):
    fit = hd.Fit(DAMPING, "oe", hd.Status.OK, training_range={"u": (0.5, 1.25)}, vehicle=CRAFT)
    card = hd.export(DAMPING, CRAFT, target, tmp_path / "a", fit=fit)
    assert "Form: not tested by the method oe." in str(card)
    tests = {"K": ScoreTest(210.0, 10, 2000)}
    adequacy = Adequacy.judge(tests, {"K": 0.0}, {"K": 0.2})
    fit = replace(fit, adequacy=adequacy, status=hd.Status.STOPPED)
    card = hd.export(DAMPING, CRAFT, target, tmp_path / "b", fit=fit)
    text = " ".join((tmp_path / "b" / file).read_text("utf-8").replace("\n * ", " ").split())
    for words in (
        "Its estimate: stopped",
        "Form: inadequate for p",
        "do not confirm it for p",
        "u 0.5 to 1.25 m/s",
    ):
        assert words in str(card)
        assert words in text
