"""Errors in blocks, excitation of training and test data, and the verdict of both."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.adequacy import Adequacy, ScoreTest
from hydrodamp.simulation.block_errors import BlockErrors, block_errors, pool
from hydrodamp.validation.cross_validation import CrossValidation, ValidatedRow
from hydrodamp.validation.excitation import (
    compare_logs,
    describe_folds,
    find_shared_segments,
    find_untested,
    select_folds,
)
from hydrodamp.validation.verdict import Light, judge_axes
from value_changes import set_values


@pytest.fixture(scope="module")
def campaign():
    return hd.reenact(seed=1, duration=60.0)


@pytest.fixture(scope="module")
def table(campaign):
    models = [hd.catalog[key] for key in ("linear", "prestero", "fossen")]
    problem = hd.prepare(campaign.vehicle, campaign.train, models)
    fits = hd.identify_all(problem, models, hd.WeakForm())
    return hd.compare(fits, campaign.vehicle, campaign.test)


@pytest.mark.slow
def test_blocks_add_up_to_equation_24_and_to_the_fits(table):
    for row in table.rows:
        if row.rms is not None:
            assert row.blocks.rms == pytest.approx(row.rms, rel=1e-12)
            assert row.blocks.fit_by_axis == pytest.approx(row.score.fit_by_axis, rel=1e-9)
            assert row.blocks.standard_error > 0.0


@pytest.mark.slow
def test_the_standard_error_of_a_mean_square_is_that_of_independent_blocks():
    """The jackknife of a mean is its standard error (Miller, 1974), here of 4000 squares."""
    blocks = blocks_of_squares(u=np.random.default_rng(3).chisquare(4.0, size=4000))
    by_delta_method = np.sqrt(8.0 / 4000) / (2.0 * 2.0)  # of √mean, with mean 4 and variance 8
    assert blocks.standard_error == pytest.approx(by_delta_method, rel=0.05)


@pytest.mark.slow
def test_a_diverged_replay_counts_as_the_mean_of_the_log_from_its_divergence(table):
    run = next(row.trajectory for row in table.rows if row.rms is not None)
    first, *_ = run.log.segments
    lost = set_values(run, "velocity", (np.s_[first.stop - 5 : first.stop], np.nan))
    lost = replace(lost, diverged=((first.name, 1.0),))
    blocks, whole = block_errors(lost), block_errors(run)
    np.testing.assert_array_equal(blocks.error[blocks.diverged], blocks.deviation[blocks.diverged])
    np.testing.assert_array_equal(blocks.error[~blocks.diverged], whole.error[~blocks.diverged])
    assert blocks.diverged.sum() >= 1
    assert not blocks.diverged[-1]
    nothing = block_errors(set_values(lost, "velocity", (np.s_[:], np.nan)))
    assert nothing.rms == pytest.approx(nothing.rms_of_mean)
    assert set(nothing.fit_by_axis.values()) == {0.0}
    assert pool([blocks, whole]).n == blocks.n + whole.n


@pytest.mark.slow
def test_a_velocity_that_only_one_log_excites_is_named(campaign, snapshot):
    axes = campaign.vehicle.axes
    train = set_values(campaign.train, "velocity", (np.s_[:, 4], lambda q: 0.1 * q))
    imbalance = compare_logs(train, campaign.train, axes)
    assert set(imbalance.test_only) == {"q"}
    assert imbalance.untested == {"q": "not excited in training"}
    back = compare_logs(campaign.train, train, axes)
    assert back.untested == {"q": "not excited in the test"}
    same = compare_logs(train, train, axes)
    assert not same.sentences
    assert select_folds([imbalance, same]) == (False, True)
    assert select_folds([imbalance, imbalance]) == (True, True)
    # a comparison is one fold: the same rule as for a cross-validation
    assert find_untested([imbalance]) == {"q": "not excited in training"}
    assert find_untested([imbalance, back]) == {"q": "excited in fold 1 only"}
    assert not find_untested([imbalance, same])
    folds = describe_folds([imbalance, same], [("a",), ("b",)])
    assert [*imbalance.sentences, *back.sentences, *folds] == snapshot


def blocks_of_squares(**squares):
    """Return mean squares of errors in blocks of equal length, of motions with a square of one."""
    error = np.column_stack([*squares.values()])
    n, ones, zeros = len(error), np.ones_like(error), np.zeros_like(error)
    return BlockErrors((*squares,), np.ones(n), error, ones, zeros, np.zeros(n, bool))


def blocks_of(**fits):
    """Return errors in six blocks of velocities with a fit, or a fit in each block [%]."""
    squares = {name: (1.0 - np.array(fit) / 100.0) ** 2 for name, fit in fits.items()}
    return blocks_of_squares(**{name: np.broadcast_to(it, 6) for name, it in squares.items()})


def test_lights_follow_fit_identifiability_and_doubts():
    blocks = blocks_of(u=90.0, v=30.0, w=-5.0, p=90.0)
    grades = {"Y_v": hd.Grade.DETERMINED, "K_p": hd.Grade.NOT_DETERMINED}
    axes = {axis.velocity: axis for axis in judge_axes(blocks, grades, {}, {})}
    assert [axis.light.name for axis in axes.values()] == ["GREEN", "AMBER", "RED", "AMBER"]
    assert axes["p"].reason == "no coefficient determined"
    (doubtful, *_) = judge_axes(blocks, grades, {"u": "excited in fold 3 only"}, {})
    assert (doubtful.light, doubtful.reason) == (Light.AMBER, "excited in fold 3 only")
    still = replace(blocks, noise=0.6 * blocks.deviation * [1.0, 0.0, 0.0, 0.0])
    lights = [axis.light.name for axis in judge_axes(still, grades, {}, {"v": "not excited"})]
    assert lights == ["GREY", "GREY", "RED", "AMBER"]


def test_a_fit_that_is_not_significantly_above_zero_is_red():
    """One-sided 95 % of Student's t with five degrees of freedom: 2.015 standard errors."""
    spread = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
    blocks = blocks_of(u=10.0 + 7.0 * spread, v=10.0 + 15.0 * spread, w=-2.0 + 7.0 * spread)
    u, v, w = judge_axes(blocks, {}, {}, {})
    assert u.fit > 2.015 * u.standard_error
    assert v.standard_error < v.fit < 2.015 * v.standard_error
    assert [axis.light.name for axis in (u, v, w)] == ["AMBER", "RED", "RED"]


def with_blocks(row, key, blocks, **fields):
    """Return a row of a model of another key with given errors, which all terms determine."""
    model = replace(row.fit.damping.model, key=key)
    fit = replace(row.fit, damping=replace(row.fit.damping, model=model), grades={})
    return replace(row, fit=fit, blocks=blocks, **fields)


@pytest.mark.slow
def test_the_headline_names_what_is_usable_for_each_velocity_in_all_rows(table, snapshot):
    """Rates in deg/s do not decide: the selected row has the least error relative to the motion."""
    first, *_ = table.rows
    scale = np.array([1.0, 1.0, 1.0, 100.0, 100.0, 100.0])

    def scaled(**fits):
        blocks = blocks_of(**fits)
        return replace(blocks, error=blocks.error * scale, deviation=blocks.deviation * scale)

    bad = with_blocks(first, "turns", scaled(u=-9, v=20, w=-9, p=-9, q=-9, r=60))
    good = with_blocks(first, "drag", scaled(u=61, v=59, w=52, p=-20, q=-20, r=-20))
    lost = scaled(u=90, v=90, w=90, p=90, q=90, r=90)
    diverged = replace(lost, diverged=np.ones(6, bool))
    wild = with_blocks(first, "wild", diverged, divergences=("segment a after 1 s",))

    coarse = with_blocks(first, "coarse", scaled(u=61, v=59, w=20, p=-20, q=-20, r=-20))
    finer = with_blocks(first, "finer", scaled(u=51, v=51, w=32, p=-20, q=-20, r=-20))
    weak = with_blocks(first, "weak", scaled(u=-9, v=-9, w=-9, p=-9, q=-9, r=30))
    none = with_blocks(first, "none", scaled(u=-9, v=-9, w=-9, p=-9, q=-9, r=-9))
    tables = [(wild, good, bad), (coarse, finer), (weak,), (none, wild), (wild,)]
    verdicts = [replace(table, rows=rows).verdict() for rows in tables]
    assert [verdict.headline for verdict in verdicts] == snapshot
    assert verdicts[0].alternatives == {"r": "turns by weak"}
    assert [verdict.recommended for verdict in verdicts] == [True, True, True, False, False]
    *_, alone, only = verdicts
    assert [alone.lines[-1], *only.lines] == snapshot
    assert (only.rms, {axis.light for axis in only.axes}) == (None, {Light.RED})
    assert {axis.reason for axis in only.axes} == {"a replay diverged"}


def test_lights_from_training_data_are_grey(table, campaign):
    fits = [row.fit for row in table.rows]
    assert not table.overlap
    verdict = hd.compare(fits, campaign.vehicle, campaign.train).verdict()
    assert {axis.light for axis in verdict.axes} == {Light.GREY}
    assert not verdict.recommended
    assert verdict.headline.startswith("Not tested: ")
    assert verdict.headline.endswith(", because all test data are training data.")
    assert "Errors are those of the training data, not prediction errors." in verdict.reasons
    mixed = hd.concatenate([campaign.train.select(campaign.train.segments[0].name), campaign.test])
    partly = hd.compare(fits, campaign.vehicle, mixed)
    assert partly.overlap == f"segments {campaign.train.segments[0].name}"
    assert {axis.light for axis in partly.verdict().axes} == {Light.GREY}
    assert ", because part of the test data are training data." in partly.verdict().headline


def training_fit(campaign, log):
    """Return a fit of the linear model to a log."""
    problem = hd.prepare(campaign.vehicle, log, hd.catalog["linear"])
    return hd.LeastSquares().identify(problem, hd.catalog["linear"])


@pytest.mark.parametrize(
    ("train", "test", "overlap"),
    [
        ((0, 40), (0, 60), "segments {}"),
        ((0, 40), (35, 60), "segments {}"),
        ((0, 40), (40, 60), ""),
        ((0, 60), (20, 30), "all test data"),
        ((0, 60), (0, 60), "all test data"),
    ],
)
def test_training_data_are_recognised_in_any_interval(campaign, train, test, overlap):
    log = campaign.train.select(campaign.train.segments[0].name)
    fit = training_fit(campaign, log.between(*train))
    assert len(fit.provenance["velocity_digests"]) < 5000
    expected = overlap.format(log.segments[0].name)
    assert find_shared_segments([fit], log.between(*test)) == expected


def test_rest_and_coarse_sensors_are_no_shared_data(campaign):
    """Equal samples alone are chance: both logs begin at rest, with a resolution of 0.01."""

    def coarse(log):
        velocity = np.round(log.velocity, 2) + 0.0
        velocity[:50] = 0.0
        return replace(log, velocity=velocity)

    fit = training_fit(campaign, coarse(campaign.train))
    assert find_shared_segments([fit], coarse(campaign.test)) == ""
    assert find_shared_segments([fit], coarse(campaign.train)) == "all test data"


def test_a_verdict_names_the_row_of_the_selection_and_for_what_it_is_usable(table):
    verdict = table.verdict()
    assert (verdict.model, verdict.method) == (table.best().model, "weak")
    assert verdict.recommended
    assert verdict.headline.startswith(f"Usable: {verdict.model} by weak for u ")
    assert "determined" not in verdict.headline


LACKING = Adequacy.judge({"K": ScoreTest(210.0, 10, 2000, ("K_p|u|",))}, {"K": 0.0}, {})
SOUND = Adequacy.judge({"K": ScoreTest(9.0, 10, 2000)}, {"K": 0.0}, {})


def test_the_verdict_states_form_and_missions_once(table):
    rows = tuple(replace(row, fit=replace(row.fit, adequacy=LACKING)) for row in table.rows)
    provenance = table.provenance | {"missions": "Depth is safe.\nHeading is not."}
    verdict = replace(table, rows=rows, provenance=provenance).verdict()
    lines = verdict.lines
    start = lines.index("Form: effective; missing terms, in % of the unexplained motion: K 10.")
    assert f'extends: {verdict.model}, terms: {{K: "p|u|"}}}}' in lines[start + 1]
    assert lines[start + 2] == "Depth is safe. Heading is not."
    assert "Most coefficients are not determined singly: use them together." not in lines
    assert len(set(lines)) == len(lines)
    usual = table.verdict()
    assert not any(line.startswith("Form") for line in usual.lines)
    poor = Adequacy.judge({"X": ScoreTest(310.0, 10, 2000, ("X_u",))}, {}, {"X": 0.1})
    rows = tuple(replace(row, fit=replace(row.fit, adequacy=poor)) for row in table.rows)
    lights = {axis.velocity: axis for axis in replace(table, rows=rows).verdict().axes}
    assert lights["u"].reason == "its form is inadequate"
    assert lights["u"].light is not Light.GREEN


def test_a_cross_validation_states_the_worst_form_of_the_folds_that_count(table):
    folds = [replace(table.rows[0], fit=replace(table.rows[0].fit, adequacy=each))
             for each in (SOUND, LACKING)]  # fmt: skip
    validated = CrossValidation((ValidatedRow(tuple(folds)),), (("a",), ("b",)))
    assert str(LACKING) in validated.verdict().reasons
    counted = replace(validated, rows=(ValidatedRow(tuple(folds), (True, False)),))
    assert str(SOUND) in counted.verdict().reasons


def test_a_selected_fit_that_stopped_is_told(table):
    change = {"status": hd.Status.STOPPED, "unconverged": ("Y", "N")}
    rows = tuple(replace(row, fit=replace(row.fit, **change)) for row in table.rows)
    told = "The optimiser stopped before it converged on Y N."
    assert told in replace(table, rows=rows).verdict().reasons
    assert told not in table.verdict().reasons
