"""Folds: whole segments, blocks with margins, and what cannot be divided."""

import numpy as np

import hydrodamp as hd
from hydrodamp.basis.basis import Basis
from hydrodamp.identification import regression
from hydrodamp.identification.regression import Rows


def rows_of(*lengths, step=0.1):
    """Random rows of segments of some lengths."""
    n, basis = sum(lengths), Basis((hd.Term.parse("u"), hd.Term.parse("v")))
    rng, segment = np.random.default_rng(n), np.repeat(np.arange(len(lengths)), lengths)
    time = np.concatenate([np.arange(length) * step for length in lengths])
    return Rows(basis, rng.normal(size=(n, 2)), rng.normal(size=(n, 6)), segment, time)


def test_a_fold_is_a_segment_where_there_are_several():
    rows = rows_of(30, 50, 20)
    made = regression.folds(rows)
    np.testing.assert_array_equal(made.fold, rows.segment)
    assert (made.n, made.description) == (3, "3 folds, one per segment")


def test_segment_numbers_may_have_holes():
    rows = rows_of(20, 20, 20)
    made = regression.folds(rows.select(rows.segment != 1))
    assert (made.n, set(made.fold.tolist())) == (2, {0, 1})


def test_a_single_segment_is_cut_into_five_blocks_with_margins():
    rows = rows_of(500)
    made = regression.folds(rows, gap=1.0)
    assert made.n == 5
    for cut in (100, 200, 300, 400):  # the half second on both sides of a cut is in no fold
        margin = np.flatnonzero(made.fold[cut - 10 : cut + 10] < 0)
        np.testing.assert_array_equal(margin, 5 + np.arange(10))
    assert np.sum(made.fold < 0) == 40


def test_margins_stay_within_their_segment():
    """Clocks of segments may overlap: a cut in one takes no row of another."""
    made = regression.folds(rows_of(100, 40), n=3, gap=1.0)
    assert np.all(made.fold[100:] == 2)
    assert np.sum(made.fold < 0) == 10


def test_the_longest_segments_are_cut_first():
    made = regression.folds(rows_of(100, 30, 200), n=5, gap=0.0)
    assert made.description == "5 folds, blocks of 3 segments"
    assert np.bincount(made.fold).tolist() == [50, 50, 30, 100, 100]
