"""Errors in blocks, excitation of training and test data, and the verdict of both."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.simulation.block_errors import BlockErrors, block_errors, pool
from hydrodamp.validation.excitation import compare_logs, describe_folds, select_folds
from hydrodamp.validation.verdict import judge_axes

RNG = np.random.default_rng(3)


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=1, duration=60.0)


@pytest.fixture(scope="module")
def table(campaign):
    models = [hd.catalog[key] for key in ("linear", "prestero", "fossen")]
    problem = hd.prepare(campaign.vehicle, campaign.train, models)
    fits = hd.grade_fits(problem, hd.identify_all(problem, models, hd.WeakForm()))
    return hd.compare(fits, campaign.vehicle, campaign.test)


def test_blocks_add_up_to_equation_24_and_to_the_fits(table):
    for row in table.rows:
        if row.rms is not None:
            assert row.blocks.rms == pytest.approx(row.rms, rel=1e-12)
            assert row.blocks.fit_by_axis == pytest.approx(row.score.fit_by_axis, rel=1e-9)
            assert row.blocks.standard_error > 0.0


def test_the_standard_error_of_a_mean_square_is_that_of_independent_blocks():
    """The jackknife of a mean is its standard error (Miller, 1974), here of 4000 squares."""
    squares = RNG.chisquare(4.0, size=(4000, 1))
    n = len(squares)
    blocks = BlockErrors(("u",), np.ones(n), squares, np.ones((n, 1)), np.zeros(n, bool))
    by_delta_method = np.sqrt(8.0 / n) / (2.0 * 2.0)  # of √mean, with mean 4 and variance 8
    assert blocks.standard_error == pytest.approx(by_delta_method, rel=0.05)


def test_a_diverged_replay_counts_as_the_mean_of_the_log_from_its_divergence(table):
    run = next(row.trajectory for row in table.rows if row.rms is not None)
    first, *_ = run.log.segments
    velocity = run.velocity.copy()
    velocity[first.stop - 5 : first.stop] = np.nan
    lost = replace(run, velocity=velocity, diverged=((first.name, 1.0),))
    blocks, whole = block_errors(lost), block_errors(run)
    np.testing.assert_array_equal(blocks.error[blocks.diverged], blocks.deviation[blocks.diverged])
    np.testing.assert_array_equal(blocks.error[~blocks.diverged], whole.error[~blocks.diverged])
    assert blocks.diverged.sum() >= 1
    assert not blocks.diverged[-1]
    velocity[:] = np.nan
    nothing = block_errors(replace(lost, velocity=velocity))
    assert nothing.rms == pytest.approx(nothing.rms_of_mean)
    assert set(nothing.fit_by_axis.values()) == {0.0}
    assert pool([blocks, whole]).n == blocks.n + whole.n


def test_a_velocity_that_only_one_log_excites_is_named(campaign):
    axes = campaign.vehicle.axes
    still = campaign.train.velocity.copy()
    still[:, 4] *= 0.1
    train = replace(campaign.train, velocity=still)
    imbalance = compare_logs(train, campaign.train, axes)
    assert set(imbalance.test_only) == {"q"}
    assert imbalance.reasons == {"q": "not excited in training"}
    assert imbalance.sentences[0].startswith("Only the test data excite q (")
    back = compare_logs(campaign.train, train, axes)
    assert back.sentences[0].endswith("the test cannot assess them.")
    same = compare_logs(train, train, axes)
    assert not same.sentences
    assert select_folds([imbalance, same]) == (False, True)
    assert select_folds([imbalance, imbalance]) == (True, True)
    (sentence,) = describe_folds([imbalance, same], [("a",), ("b",)])
    assert sentence.startswith("Only fold 1 of 2 (segment a) excites q (")
    assert sentence.endswith("so it does not count.")


def test_lights_follow_fit_identifiability_and_doubts():
    names = ("u", "v", "w", "p")
    fits = np.array([90.0, 30.0, -5.0, 90.0])
    error = np.broadcast_to((1.0 - fits / 100.0) ** 2, (6, 4))
    blocks = BlockErrors(names, np.ones(6), error, np.ones((6, 4)), np.zeros(6, bool))
    grades = {"Y_v": hd.Grade.DETERMINED, "K_p": hd.Grade.NOT_DETERMINED}
    axes = {axis.velocity: axis for axis in judge_axes(blocks, grades, {})}
    assert [axis.light.name for axis in axes.values()] == ["GREEN", "AMBER", "RED", "AMBER"]
    assert axes["p"].reason == "no coefficient determined"
    (doubtful, *_) = judge_axes(blocks, grades, {"u": "excited in fold 3 only"})
    assert (doubtful.light, doubtful.reason) == (hd.Light.AMBER, "excited in fold 3 only")


def test_a_verdict_names_the_row_of_the_selection_and_how_much_of_it_is_determined(table):
    verdict = table.verdict()
    assert (verdict.model, verdict.method) == (table.best().model, "weak")
    assert verdict.recommended
    assert str(verdict).startswith(f"Use {verdict.model} by weak: {verdict.n_coefficients} coeff")
    assert f"{verdict.n_determined} determined" in verdict.headline
    flat = [replace(row, blocks=replace(row.blocks, error=2.0 * row.blocks.deviation))
            for row in table.rows]  # fmt: skip
    useless = replace(table, rows=tuple(flat)).verdict()
    assert not useless.recommended
    assert useless.headline.startswith("Use none of these models")


def test_a_selected_fit_that_stopped_is_told(table):
    rows = tuple(replace(row, fit=replace(row.fit, status=hd.Status.STOPPED)) for row in table.rows)
    told = "The optimiser stopped before it converged."
    assert told in replace(table, rows=rows).verdict().reasons
    assert told not in table.verdict().reasons
