"""Every stretch held out in turn: folds, their rows, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import make_fit
from hydrodamp.validation.cross_validation import cross_validate, split_holdout
from value_changes import set_values

LINEAR, FOSSEN = hd.catalog["linear"], hd.catalog["fossen"]


@pytest.fixture
def log(exact_log):
    return exact_log(hd.Damping(LINEAR, (-30 * np.eye(6) + 0.1).ravel()), n=900)


class Fixed:
    """A method that knows its coefficients beforehand, wild after the first fold."""

    key = "fixed"

    def __init__(self, wild_without=""):
        self.wild_without = wild_without
        self.trained_on = []

    def identify(self, problem, model):
        names = [part.name for part in problem.log.segments]
        self.trained_on.append(names)
        wild = self.wild_without and self.wild_without not in names
        own = {"X_u", "Y_v", "Z_w", "K_p", "M_q", "N_r"}
        is_own = np.array([label[:3] in own for label in model.labels])
        return make_fit(problem, model, self, (300.0 if wild else -30.0) * is_own)


@pytest.mark.slow
def test_each_fold_is_a_comparison_on_what_was_left_out(vehicle, log):
    """The same as doing it by hand, segment by segment."""
    table = cross_validate(vehicle, log, [LINEAR, FOSSEN], hd.LeastSquares())
    assert table.held_out == (("a",), ("b",), ("c",))
    found = [(row.model, row.method, row.n_coefficients) for row in table.rows]
    assert found == [("linear", "ls", 36), ("fossen", "ls", 12)]
    for fold, name in enumerate("abc"):
        rest = [other for other in "abc" if other != name]
        fit = hd.identify(LINEAR, vehicle, log.select(*rest), hd.LeastSquares())
        alone = hd.compare([fit], vehicle, log.select(name))
        assert table.rows[0].rms_by_fold[fold] == pytest.approx(alone.rows[0].rms, rel=1e-9)
        assert table.rows[0].folds[fold].trajectory is None
    row = table.rows[1]
    # The folds have equal lengths.
    assert row.rms == pytest.approx(np.sqrt(np.mean(np.square(row.rms_by_fold))))
    assert row.standard_error > 0.0
    assert row.n_failed_folds == 0
    assert row.converged


@pytest.mark.slow
def test_a_row_with_a_diverged_fold_has_no_error_and_ranks_last(vehicle, log):
    methods = [Fixed(wild_without="b"), hd.LeastSquares()]
    table = cross_validate(vehicle, log, LINEAR, methods)
    wild = table.rows[0]
    assert [value is None for value in wild.rms_by_fold] == [False, True, False]
    assert wild.rms is None
    assert wild.n_failed_folds == 1
    lost = wild.folds[1].blocks
    assert lost.rms == pytest.approx(lost.rms_of_mean)
    assert table.select().row.method == "ls"
    assert wild.standard_error is None
    assert wild.divergences[0].startswith("fold 2, segment b after")
    ((where, after),) = wild.folds[1].score.diverged
    assert where == "b"
    assert wild.failed_folds == (f"fold 2 (diverged in segment b after {after:.3g} s)",)
    text = str(table).splitlines()
    assert text[1].endswith(f"–  failed {wild.failed_folds[0]}")


def test_a_fold_that_alone_excites_a_velocity_does_not_count(vehicle, log):
    """Roll rates of the other folds are a tenth: linear damping by least squares extrapolates."""
    calm = set_values(log, "velocity", (np.s_[300:, 3], lambda p: 0.1 * p))
    with pytest.warns(hd.HydrodampWarning, match=r"Only fold 1 of 3 \(segment a\) excites p"):
        table = cross_validate(vehicle, calm, LINEAR, hd.LeastSquares())
    (row,) = table.rows
    assert row.counted == (False, True, True)
    assert row.blocks.n == row.folds[1].blocks.n + row.folds[2].blocks.n
    p = next(axis for axis in table.verdict().axes if axis.velocity == "p")
    assert p.reason == "excited in fold 1 only"
    assert any("so it does not count" in reason for reason in table.verdict().reasons)


def names(log):
    return [part.name for part in log.segments]


@pytest.mark.slow
def test_a_log_of_one_segment_is_cut_into_blocks_with_a_gap(vehicle, log):
    """30 s at 10 Hz in five blocks of 6 s, two seconds left out around every cut."""
    one = log.select("a")
    parts = split_holdout(one, gap=2.0)
    assert len(parts) == 5
    for train, test in parts:
        assert np.abs(train.time[:, None] - test.time).min() >= 2.0 - 1e-9
        assert train.n + test.n == 300 - 4 * 20
    assert names(parts[1][0]) == ["a+0s", "a+13s", "a+19s", "a+25s"]
    table = cross_validate(vehicle, one, LINEAR, hd.LeastSquares(), gap=2.0)
    assert len(table.rows[0].rms_by_fold) == 5
    assert table.rows[0].rms < 0.1


def test_whole_segments_are_held_out_once(log):
    parts = [(names(train), names(test)) for train, test in split_holdout(log, n=2)]
    assert parts == [(["b"], ["a", "c"]), (["a", "c"], ["b"])]
    parts = split_holdout(log)
    held = np.concatenate([test.velocity for _, test in parts])
    np.testing.assert_array_equal(held, log.velocity)
    assert all(train.n + test.n == log.n for train, test in parts)


def test_too_few_samples_for_the_folds(vehicle, log):
    short = log.between(0.0, 0.65)
    table = cross_validate(vehicle, short, LINEAR, hd.LeastSquares(), folds=3, gap=0.0)
    assert {fold.status for fold in table.rows[0].folds} == {hd.Status.TOO_FEW_SAMPLES}
    with pytest.raises(MethodError, match="too few for 5 folds"):
        cross_validate(vehicle, short, FOSSEN, hd.LeastSquares())
    with pytest.raises(MethodError, match="no two neighbouring samples to replay"):
        split_holdout(short, n=7, gap=0.0)
    uneven = hd.Log(time=[0.0, 1.0, 2.0, 3.0, 3.2, 10.0], velocity=np.zeros((6, 6)))
    with pytest.raises(MethodError, match="no two neighbouring samples to identify from"):
        split_holdout(uneven, n=2, gap=1.5)
    with pytest.raises(MethodError, match="at least 2 folds"):
        cross_validate(vehicle, log, LINEAR, hd.LeastSquares(), folds=1)


@pytest.mark.slow
def test_progress_is_told_of_every_fit_on_fewer_axes_too(vehicle, log):
    planar, told = replace(vehicle, axes=("X", "Y", "N")), []
    methods = [hd.LeastSquares(), Fixed()]
    settings = {"rate_unit": "rad", "done": told.append}
    table = cross_validate(planar, log, [LINEAR, FOSSEN], methods, **settings)
    assert len(told) == 3 * 2 * 2
    assert table.rate_unit == "rad"
    assert table.rows[0].n_coefficients == 9
