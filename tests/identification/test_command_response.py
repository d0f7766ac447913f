"""Lag and dead time of commands, and interpolation between samples, of logs of known truth."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.conditioning.interpolation import set_interpolation
from hydrodamp.errors import LogError, MethodError
from hydrodamp.identification.command_response import (
    estimate_command_response,
    interpolation_remarks,
)
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.simulation.campaign.conditions import WHITE_NOISE
from hydrodamp.simulation.campaign.reenact import CampaignSetup

LINEAR = hd.catalog["linear"]
LAG = 0.3


@pytest.fixture(scope="module")
def vehicle(campaign):
    return campaign.vehicle


@pytest.fixture(scope="module")
def log(campaign):
    return campaign.train


@pytest.fixture(scope="module")
def lagged():
    """The log of a vehicle whose fins follow their commands with a first-order lag."""
    setup = CampaignSetup.of("sname")
    truth = replace(setup.truth, fin_lag=LAG)
    return replace(setup, truth=truth).simulate([3], 40.0, WHITE_NOISE)[0].train


@pytest.mark.slow
def test_a_lag_is_estimated_within_its_interval(vehicle, lagged):
    problem = hd.prepare(vehicle, lagged, LINEAR)
    response = estimate_command_response(problem, LINEAR, ("lag", "delay"))
    assert response.is_significant
    low, high = response.intervals["lag"]
    assert low <= LAG <= high


@pytest.mark.slow
def test_a_log_without_lag_has_none(vehicle, log):
    response = estimate_command_response(hd.prepare(vehicle, log, LINEAR), LINEAR)
    assert not response.is_significant
    assert response.intervals["lag"][0] == 0.0
    assert response.apply(log) is log
    assert "no significant first-order lag" in str(response)


@pytest.mark.slow
def test_a_delayed_recording_has_that_dead_time(vehicle, log):
    steps = 3
    early = replace(log, commands=np.roll(log.commands, -steps, axis=0))
    problem = hd.prepare(vehicle, early, LINEAR)
    response = estimate_command_response(problem, LINEAR, ("delay",))
    low, high = response.intervals["delay"]
    assert low <= steps * np.median(log.steps) <= high
    assert response.is_significant


@pytest.mark.slow
def test_recommended_reports_a_lag_and_the_step_that_applies_it(vehicle, log, lagged):
    fit = hd.Recommended().identify(hd.prepare(vehicle, lagged, LINEAR), LINEAR)
    assert "apply_first_order_lag" in fit.remarks[-1]
    fit = hd.Recommended().identify(hd.prepare(vehicle, log, LINEAR), LINEAR)
    assert not any("lag" in remark for remark in fit.remarks)


def test_a_held_wrench_leads_by_half_a_step_unless_set(vehicle, log):
    problem = hd.prepare(vehicle, log, LINEAR)
    table = problem.equations
    regressor = problem.regressor()[:, : table.n_known]
    actuators = [bool(term.commands) for term in vehicle.known_columns()]
    known = regressor[:, actuators] @ table.known[actuators]
    recorded = replace(log, wrench=known, commands=np.zeros((log.n, 0)), command_names=())
    rows = WeakRegression(support=1.0)
    expected = rows.rows(problem).target
    linear, held = (
        np.linalg.norm(rows.rows(hd.prepare(vehicle, each, LINEAR)).target - expected)
        for each in (recorded, set_interpolation(recorded, wrench="held"))
    )
    assert held < 0.2 * linear
    model = hd.catalog["prestero"]
    (remark,) = interpolation_remarks(hd.prepare(vehicle, recorded, model), model)
    assert "set_interpolation: {wrench: held}" in remark
    assert not interpolation_remarks(hd.prepare(vehicle, log, model), model)


def test_faults_of_the_settings(vehicle, log):
    problem = hd.prepare(vehicle, log, LINEAR)
    with pytest.raises(MethodError, match="lag, delay or both"):
        estimate_command_response(problem, LINEAR, ("gain",))
    with pytest.raises(LogError, match="held or linear"):
        set_interpolation(log, wrench="spline")
    silent = replace(log, commands=np.zeros((log.n, 0)), command_names=(), wrench=log.velocity)
    with pytest.raises(MethodError, match="uses a command"):
        estimate_command_response(hd.prepare(vehicle, silent, LINEAR), LINEAR)
