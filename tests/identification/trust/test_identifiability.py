"""Grades of the campaign, of motions that hardly move, and of a field log."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.trust.excitation import excitation
from hydrodamp.identification.trust.grades import Grade
from hydrodamp.identification.trust.identifiability import identifiability
from hydrodamp.ingest.mapping import LogMapping

PRESTERO, LINEAR = hd.catalog["prestero"], hd.catalog["linear"]


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=0, duration=200.0)


@pytest.fixture(scope="module")
def problem(campaign):
    return hd.prepare(campaign.vehicle, campaign.train, [PRESTERO, LINEAR])


@pytest.fixture(scope="module")
def graded(problem):
    return identifiability(problem, PRESTERO)


def test_the_campaign_determines_the_main_coefficients(graded):
    main = {"X_u|u|", "Y_ur", "K_p|p|", "M_uw", "N_uv", "N_ur"}
    assert main <= set(graded.labelled(Grade.DETERMINED))
    assert all(one.excited for one in graded.axes)
    assert graded.grade("Z_w|w|") is Grade.NOT_DETERMINED


def test_every_coefficient_has_one_grade(graded):
    assert tuple(graded.grades) == PRESTERO.labels == tuple(graded.inflation)
    assert sum(one.count(grade) for one in graded.axes for grade in Grade) == 30
    assert min(graded.inflation.values()) >= 1.0 - 1e-12


def test_noise_makes_grades_worse(campaign, graded):
    """Ten times the noise of the DVL."""
    log = campaign.train
    noise = 0.13 * np.random.default_rng(0).normal(size=log.velocity.shape) * [1, 1, 1, 0, 0, 0]
    noisy = replace(log, velocity=log.velocity + noise)
    found = identifiability(hd.prepare(campaign.vehicle, noisy, PRESTERO), PRESTERO)
    assert len(found.labelled(Grade.DETERMINED)) < len(graded.labelled(Grade.DETERMINED))
    assert not found.axes[2].excited


def test_a_wide_covariance_undoes_grades_and_a_narrow_one_makes_them(problem):
    wide = identifiability(problem, PRESTERO, 1e12 * np.eye(30))
    narrow = identifiability(problem, PRESTERO, 1e-12 * np.eye(30))
    assert not wide.labelled(Grade.DETERMINED)
    assert len(narrow.labelled(Grade.DETERMINED)) >= 28


def test_columns_that_do_not_move_are_not_determined(exact_log, vehicle, true_damping):
    """Sway at rest: whatever has v in it, and the whole of Y, cannot be told."""
    log = exact_log(true_damping(LINEAR), forward=1.5)
    rng = np.random.default_rng(0)
    quiet = np.array(log.velocity)
    quiet[:, 1] = 1e-3 * rng.normal(size=log.n)
    wrench = np.array(log.wrench)
    wrench[:, 1] = rng.normal(size=log.n)
    problem = hd.prepare(vehicle, replace(log, velocity=quiet, wrench=wrench), LINEAR)
    grades = identifiability(problem, LINEAR).grades
    assert {grades[label] for label in LINEAR.labels if label.startswith("Y_")} == {
        Grade.NOT_DETERMINED
    }
    assert grades["N_v"] is Grade.NOT_DETERMINED


def test_aliased_columns_are_named(problem, campaign):
    twice = hd.DampingModel.from_table({"X": "u^2 u|u|", "K": "p"}, key="twice")
    found = identifiability(hd.prepare(campaign.vehicle, campaign.train, twice), twice)
    assert ("X_u^2", "X_u|u|") in found.groups
    assert found.axes[0].condition == np.inf
    assert found.labelled(Grade.NOT_DETERMINED) == ("X_u^2", "X_u|u|")
    assert found.as_dict()["coefficients"]["X_u^2"] == {"grade": "not determined", "vif": None}


def test_fewer_axes(exact_log, vehicle, true_damping):
    planar = replace(vehicle, axes=("X", "Y", "N"))
    log = exact_log(true_damping(LINEAR), forward=1.5)
    found = identifiability(hd.prepare(planar, log, LINEAR), LINEAR)
    assert [one.axis for one in found.axes] == ["X", "Y", "N"]
    assert len(found.grades) == 9
    assert "more groups" not in str(found)


def test_printed_on_one_screen_and_written_as_strict_json(graded, problem):
    text = str(graded)
    assert len(text.splitlines()) <= 16
    assert text.startswith("prestero: ")
    content = json.loads(json.dumps(graded.as_dict(), allow_nan=False))
    assert content["axes"]["X"]["rank"] == 5
    large = str(identifiability(problem, LINEAR, 1e12 * np.eye(36)))
    assert "and 2 more groups" in large or "more groups" not in large


def test_long_lists_are_cut(campaign):
    model = hd.catalog["gertler-hagen"]
    text = str(identifiability(hd.prepare(campaign.vehicle, campaign.train, model), model))
    assert "more groups" in text
    assert " more\n" in text


def test_what_is_refused(graded, problem, campaign):
    with pytest.raises(MethodError, match=r"shape \(30, 30\)"):
        identifiability(problem, PRESTERO, np.eye(3))
    with pytest.raises(MethodError, match="Y_ur"):
        graded.grade("Y_urr")
    with pytest.raises(MethodError, match="`span` must be positive"):
        excitation(problem, PRESTERO, span=-1.0)
    first = campaign.train.segments[0].name
    short = hd.prepare(campaign.vehicle, campaign.train.select(first).between(0.0, 6.0), LINEAR)
    with pytest.raises(MethodError, match="longer log"):
        identifiability(short, LINEAR)


@pytest.fixture(scope="module")
def field_log(measured_logs):
    """The field log of a 690: turns at constant depth, in a current."""
    file = measured_logs("vt690_field") / "derived_10hz.csv"
    mapping = {
        "time": "time_s",
        "attitude": {name: f"{name}_rad" for name in ("roll", "pitch", "yaw")},
        "velocity": {name: name for name in "uvwpqr"},
        "commands": {name: f"{name}_rad" for name in ("rudder", "elevator")},
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hd.HydrodampWarning)
        return LogMapping.from_dict(mapping).read(file)


@pytest.mark.parametrize("key", ["prestero", "linear"])
def test_the_field_log_determines_yaw_and_roll_alone(field_log, key):
    """Rudder steps excite yaw and roll; the rest follows waves, the current and noise."""
    fins = {"X": "1", "Y N": "u|u|*rudder", "Z M": "u|u|*elevator"}
    model = hd.catalog[key].with_terms(fins)
    vehicle = replace(hd.fleet["vt690"], actuators=())
    found = identifiability(hd.prepare(vehicle, field_log, model), model)
    excited = {one.axis for one in found.axes if one.excited}
    assert excited == {"K", "N"}
    for label, grade in found.grades.items():
        if label[0] in "YZM":
            assert grade is Grade.NOT_DETERMINED, label
    determined = found.labelled(Grade.DETERMINED)
    assert "N_u|u|*rudder" in determined
    assert {label[0] for label in determined} <= {"K", "N"}
    assert not any("v" in label or "w" in label for label in determined)
