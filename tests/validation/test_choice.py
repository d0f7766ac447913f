"""Which row is chosen, and what the choice says of it."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

import hydrodamp as hd
from hydrodamp.validation.compare import pareto_front, select_row


@dataclass(frozen=True)
class Entry:
    """Just what a row must know of itself."""

    model: str
    n_coefficients: int
    rms: float | None
    converged: bool = True
    method: str = "ls"
    rms_by_fold: tuple[float | None, ...] = ()


@dataclass(frozen=True)
class Listed:
    rows: tuple[Entry, ...]


LARGE, LINEAR, SMALL, TINY, WILD = ROWS = (
    Entry("large", 216, 0.50),
    Entry("linear", 36, 0.51),
    Entry("small", 30, 0.62),
    Entry("tiny", 12, 1.75),
    Entry("wild", 100, None, converged=False),
)


def test_the_lowest_error_names_its_runner_up():
    choice = select_row(ROWS)
    assert (choice.row, choice.runner_up) == (LARGE, LINEAR)
    assert str(choice) == (
        "large by ls (0.5): lowest RMS error of 4 replays; runner-up linear by ls (0.51), +2 %"
        ". Excluded: 1 replay that diverged, failed or did not converge."
    )


def test_ties_go_to_fewer_coefficients_then_to_the_earlier_row():
    equal = [Entry("b", 30, 0.5), Entry("a", 30, 0.5), Entry("few", 12, 0.5)]
    choice = select_row(equal)
    assert (choice.row.model, choice.runner_up.model) == ("few", "b")
    assert ", +0 %." in str(choice)


def test_fewer_coefficients_are_taken_where_no_run_tells_the_two_apart():
    large = Entry("large", 248, 0.50, rms_by_fold=(0.2, 0.5, 0.8))
    small = Entry("small", 44, 0.51, rms_by_fold=(0.22, 0.44, 0.87))
    choice = select_row([large, small, Entry("tiny", 12, 0.9, rms_by_fold=(0.5, 0.9, 1.3))])
    assert (choice.row, choice.runner_up) == (small, large)
    assert choice.sentence == (
        "small by ls (0.51): 44 coefficients; on the 3 held-out parts it is within one standard "
        "error of the lowest RMS error, large by ls (0.5) with 248."
    )


def test_a_small_error_that_every_run_repeats_is_not_equal():
    # The roughest run alone would hide it: 5, 5 and 4 % in runs of unlike size.
    large = Entry("large", 55, 1.74, rms_by_fold=(0.10, 0.12, 5.0))
    small = Entry("small", 22, 1.82, rms_by_fold=(0.105, 0.126, 5.2))
    assert select_row([small, large]).row is large


def test_how_far_behind_an_exact_fit_the_next_is_says_its_error():
    assert "runner-up b by ls (0.3)." in str(select_row([Entry("a", 1, 0.0), Entry("b", 1, 0.3)]))


def test_fits_that_have_not_settled_are_left_out_unless_none_has():
    loose = Entry("loose", 36, 0.1, converged=False, method="ai")
    assert select_row([loose, *ROWS]).row is LARGE
    only = select_row([loose])
    assert (only.row, only.runner_up) == (loose, None)
    assert str(only) == "loose by ai (0.1), the only row. No fit has converged."


def test_without_an_error_there_is_no_choice():
    with pytest.raises(hd.MethodError, match="every replay diverged"):
        select_row([WILD])


def test_the_front_buys_error_with_coefficients():
    beaten = Entry("beaten", 40, 0.51)
    same = Entry("same", 36, 0.51)
    assert pareto_front(Listed((*ROWS, beaten, same))) == (TINY, SMALL, LINEAR, LARGE)
    assert pareto_front(Listed((WILD,))) == ()
