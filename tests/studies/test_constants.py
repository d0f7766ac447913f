"""The study of constants: what is found, that a variant is what the package sees, and the table."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd
from constant_variants import scale

SCRIPT = Path(__file__).parents[2] / "studies" / "constant_variants.py"


def test_named_numbers_are_constants_and_tolerances_are_not_tuned(study):
    found = study.find_constants()
    lengths = found["identification.continuation.RELATIVE_LENGTHS"]
    assert (lengths.value, lengths.meaning.split()[0]) == ("(0.75, 1.5, 3.0, 6.0)", "Window")
    assert {
        "identification.adequacy.MAX_MISSING_SHARE",
        "identification.gauss_newton.FINAL_TOLERANCE",
        "identification.weak_form.WeakRegression.overlap",
        "data.record.MIN_GAP_STEPS",
    } <= set(found)
    assert "identification.regression.RANK_TOLERANCE" not in found
    assert "identification.weak_form._CHUNK_STEPS" not in found


def test_every_stated_name_is_that_of_a_constant(study):
    names = {key.partition(".")[2] for key in study.find_constants()}
    for stated in study.STATED["origin"]:
        assert any(f".{name}".endswith(f".{stated}") for name in names), stated


@pytest.mark.parametrize(
    ("value", "factor", "expected"),
    [
        (0.5, 2.0, 1.0),
        (0.9, 2.0, 0.8),
        (3, 0.5, 2),
        (1, 0.5, 1),
        ((0.75, 3.0), 2.0, (1.5, 6.0)),
        ((5, 7, 9), 0.5, (3, 5)),
        (((600, 0.1), (1800, 0.005)), 0.5, ((300, 0.05), (900, 0.0025))),
    ],
)
def test_a_variant_is_half_or_twice(value, factor, expected):
    np.testing.assert_allclose(scale(value, factor), expected)


def test_the_package_sees_the_variant_and_what_derives_from_it():
    code = (
        "import constant_variants as v\n"
        "v.change_constant('hydrodamp.identification.command_curves', 'STALL_ANGLE', 2.0)\n"
        "from hydrodamp.identification.command_curves import *\n"
        "from hydrodamp.identification import command_curves as c\n"
        "print(c.STALL_ANGLE, c.DEFLECTIONS[0], c.STALL_STD)"
    )
    call = [sys.executable, "-c", code]
    printed = subprocess.check_output(call, text=True, cwd=SCRIPT.parent)
    assert printed.split() == ["0.7", "0.35", "0.4"]


def test_a_variant_changes_the_result_of_its_method_only(study, tmp_path):
    """The ridge of `ridge` is not that of `ls`."""
    campaign = hd.reenact(seed=3, duration=10.0)
    logs = campaign.vehicle, campaign.train, campaign.test
    content = (*logs, hd.catalog["fossen"], ("ls", "ridge"), {})
    (tmp_path / "small.pickle").write_bytes(pickle.dumps(content))
    constant = study.find_constants()["identification.least_squares._STRENGTHS"]
    rows = [study.run_variant(tmp_path, ["small"], *each) for each in ((), (constant, 2.0))]
    assert [row.failure for row in rows] == ["", ""]
    nominal, changed = ({each["case"]: each for each in row.results} for row in rows)
    assert json.dumps(nominal["small, ls"]) == json.dumps(changed["small, ls"])
    assert nominal["small, ridge"]["values"] != changed["small, ridge"]["values"]
    half = rows[1]._replace(factor=0.5)
    text = study.summarise([rows[0], half, rows[1]], {constant.key: constant})
    assert constant.key in text


def test_the_largest_change_is_reported_in_either_direction(study):
    def row(factor, error, width, word):
        case = {"case": "a", "error": error, "width": width, "decisions": [word], "values": [1.0]}
        return study.Row(study.NONE.key if factor == 1.0 else "m.A", factor, "", [case])

    rows = [row(1.0, 1.0, 0.0, "ok"), row(0.5, 0.5, np.log(2.0), "ok"), row(2.0, 1.0, 0.0, "ok")]
    constant = study.Constant("m", "A", "3.0", "A share.")
    [line] = study.summarise(rows, {"m.A": constant}).splitlines()[2:]
    assert line == "| `m.A` | `3.0` | A share | choice | -50 %, +100 %, 0 | none |"
