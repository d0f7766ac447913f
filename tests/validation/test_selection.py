"""Which row is selected, and the reason that the selection gives."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.grades import Grade
from hydrodamp.simulation.block_errors import BlockErrors
from hydrodamp.validation.selection import pareto_front, select_row


def blocks_of(*errors):
    """Return one velocity with the given RMS error in each block of equal length."""
    squares = np.square(errors)[:, None]
    n = len(errors)
    return BlockErrors(("u",), np.ones(n), squares, np.full((n, 1), 100.0), np.zeros(n, bool))


@dataclass(frozen=True)
class Entry:
    """The attributes of a row that a selection reads."""

    model: str
    n_coefficients: int
    errors: tuple[float, ...]
    converged: bool = True
    method: str = "ls"
    divergences: tuple[str, ...] = ()
    grades: dict[str, Grade] = field(default_factory=dict)

    @property
    def rms(self):
        return None if self.divergences or self.blocks is None else self.blocks.rms

    @property
    def blocks(self):
        return blocks_of(*self.errors) if self.errors else None


@dataclass(frozen=True)
class Listed:
    rows: tuple[Entry, ...]


LARGE, LINEAR, SMALL, TINY, EMPTY = ROWS = (
    Entry("large", 216, (0.50,)),
    Entry("linear", 36, (0.51,)),
    Entry("small", 30, (0.62,)),
    Entry("tiny", 12, (1.75,)),
    Entry("empty", 100, (), converged=False),
)


def test_the_lowest_error_names_its_runner_up():
    selection = select_row(ROWS)
    assert (selection.row, selection.runner_up) == (LARGE, LINEAR)
    assert str(selection) == (
        "large by ls (0.5): lowest RMS error of 4 replays; runner-up linear by ls (0.51), +2 %"
        ". Excluded: 1 replay that diverged, failed or did not converge."
    )


def test_ties_go_to_fewer_coefficients_then_to_more_determined_ones_then_to_the_earlier_row():
    determined = Entry("known", 12, (0.5,), grades={"X_u": Grade.DETERMINED})
    equal = [Entry("b", 30, (0.5,)), Entry("few", 12, (0.5,)), Entry("a", 12, (0.5,))]
    assert select_row(equal).row.model == "few"
    assert select_row([*equal, determined]).row is determined


def test_fewer_coefficients_are_selected_within_one_standard_error_over_blocks():
    """Also on the blocks of one held-out run: the sign of the difference varies."""
    large = Entry("large", 248, (0.2, 0.5, 0.8))
    small = Entry("small", 44, (0.22, 0.44, 0.87))
    selection = select_row([large, small, Entry("tiny", 12, (0.5, 0.9, 1.3))])
    assert (selection.row, selection.runner_up) == (small, large)
    assert selection.equivalent == (large,)
    assert "fewest coefficients (44) within one standard error" in selection.sentence


def test_a_small_difference_that_every_block_repeats_is_not_equivalent():
    """The block of largest amplitude alone would hide it: 5, 5 and 4 %."""
    large = Entry("large", 55, (0.10, 0.12, 5.0))
    small = Entry("small", 22, (0.105, 0.126, 5.2))
    assert select_row([small, large]).row is large


def test_a_diverged_row_never_precedes_one_whose_replays_ended():
    location = "fold 1, segment a after 3 s"
    excluded = "Excluded: 1 replay that diverged, failed or did not converge."
    lost = Entry("lost", 12, (0.2, 0.5, 0.8), divergences=(location,))
    worse = (
        Entry("safe", 44, (0.22, 0.44, 0.87)),
        Entry("far", 44, (2.2, 4.4, 8.7)),
        Entry("loose", 44, (2.2, 4.4, 8.7), converged=False),
    )
    for other in worse:
        selection = select_row([lost, other])
        assert (selection.row, selection.ranked) == (other, (other,))
        assert f"lost by ls diverged in {location}. {excluded}" in selection.caveat
    alone = select_row([lost, replace(lost, model="other", errors=(0.3, 0.6, 0.9))])
    assert alone.row is lost
    assert alone.sentence.startswith("lost by ls (diverged): lowest")
    assert alone.caveat == f"It diverged in {location}; no replay ended."


def test_an_exact_fit_has_no_margin():
    selection = select_row([Entry("a", 1, (0.0,)), Entry("b", 1, (0.3,))])
    assert "runner-up b by ls (0.3)." in str(selection)


def test_fits_that_have_not_converged_are_excluded_unless_none_has():
    loose = Entry("loose", 36, (0.1,), converged=False, method="ai")
    assert select_row([loose, *ROWS]).row is LARGE
    only = select_row([loose])
    assert (only.row, only.runner_up) == (loose, None)
    assert str(only) == "loose by ai (0.1), the only row. The selected fit has not converged."


def test_without_a_replay_nothing_is_selected():
    with pytest.raises(hd.MethodError, match="nothing was fitted"):
        select_row([EMPTY])


def test_the_front_has_lower_errors_for_more_coefficients():
    beaten = Entry("beaten", 40, (0.51,))
    same = Entry("same", 36, (0.51,))
    assert pareto_front(Listed((*ROWS, beaten, same))) == (TINY, SMALL, LINEAR, LARGE)
    assert pareto_front(Listed((EMPTY,))) == ()
