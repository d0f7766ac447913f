"""Which row is selected, and the reason that the selection gives."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from hydrodamp.errors import MethodError
from hydrodamp.identification.adequacy import Adequacy
from hydrodamp.identification.grades import Grade
from hydrodamp.simulation.block_errors import BlockErrors
from hydrodamp.validation.selection import pareto_front, select_row


def blocks_of(*errors):
    """Return one velocity with the given RMS error in each block of equal length."""
    squares, n = np.square(errors)[:, None], len(errors)
    motion, noise = np.full((n, 1), 100.0), np.zeros((n, 1))
    return BlockErrors(("u",), np.ones(n), squares, motion, noise, np.zeros(n, bool))


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
    adequacy: Adequacy | None = None

    @property
    def rms(self):
        return None if self.divergences or self.blocks is None else self.blocks.rms

    @property
    def blocks(self):
        return blocks_of(*self.errors) if self.errors else None


def front(*rows):
    return pareto_front(SimpleNamespace(rows=rows, select=lambda: select_row(rows)))


LARGE, LINEAR, SMALL, TINY, EMPTY = ROWS = (
    Entry("large", 216, (0.50,)),
    Entry("linear", 36, (0.64,)),
    Entry("small", 30, (0.72,)),
    Entry("tiny", 12, (1.75,)),
    Entry("empty", 100, (), converged=False),
)


def test_the_lowest_error_names_its_runner_up(snapshot):
    selection = select_row(ROWS)
    assert (selection.row, selection.runner_up) == (LARGE, LINEAR)
    assert str(selection) == snapshot


def test_ties_go_to_fewer_coefficients_then_to_more_determined_ones_then_to_the_earlier_row():
    determined = Entry("known", 12, (0.5,), grades={"X_u": Grade.DETERMINED})
    equal = [Entry("b", 30, (0.5,)), Entry("few", 12, (0.5,)), Entry("a", 12, (0.5,))]
    assert select_row(equal).row.model == "few"
    assert select_row([*equal, determined]).row is determined


def test_fewer_coefficients_are_selected_within_one_standard_error_over_blocks(snapshot):
    """Also on the blocks of one held-out run: the sign of the difference varies."""
    large = Entry("large", 248, (0.1, 0.5, 0.6))
    small = Entry("small", 44, (0.1, 0.2, 1.1))
    selection = select_row([large, small, Entry("tiny", 12, (0.5, 0.9, 1.3))])
    assert (selection.row, selection.runner_up) == (small, large)
    assert selection.equivalent == (large,)
    assert selection.sentence == snapshot


@pytest.mark.parametrize(("share", "selected"), [(1.24, "small"), (1.26, "large")])
def test_a_quarter_of_the_least_error_is_equal_for_use(share, selected):
    """A difference that every block repeats has no standard error."""
    large = Entry("large", 55, (0.01, 0.02, 0.5))
    small = Entry("small", 22, tuple(share * error for error in large.errors))
    assert select_row([small, large]).row.model == selected


def test_equal_for_use_holds_for_every_velocity_that_is_predicted():
    """A mean within a quarter hides a yaw rate that is half as wrong again."""
    large = Several("large", 40, (0.10, 0.10, 0.16))
    small = Several("small", 10, (0.10, 0.10, 0.24))
    assert small.blocks.relative_error("uwr") < 1.25 * large.blocks.relative_error("uwr")
    assert select_row([small, large]).row is large
    unpredicted = [replace(large, errors=(0.1, 0.1, 1.1)), replace(small, errors=(0.1, 0.1, 1.4))]
    assert select_row(unpredicted).row.model == "small"
    far = replace(small, errors=(0.1, 0.1, 50.0))
    assert select_row([replace(large, errors=(0.1, 0.1, 0.85)), far]).row.model == "large"


def test_of_equal_rows_those_of_adequate_form_count(snapshot):
    large = Entry("large", 88, (0.5,), adequacy=Adequacy.judge({}, {}, {}))
    small = Entry("small", 30, (0.6,), adequacy=Adequacy.judge({}, {"X": 1.0}, {}))
    assert select_row([small, large]).row is large
    best = Entry("best", 99, (0.45,))
    assert select_row([small, large, best]).sentence == snapshot
    assert select_row([small, replace(large, errors=(0.8,))]).row is small


def test_of_equal_rows_those_that_predict_the_most_velocities_count(snapshot):
    """The smallest misses r, in which the others are good enough; no noise, one block repeated."""
    small = Several("small", 10, (0.10, 0.10, 1.01), motion=(1.0, 1.0, 1.0))
    large = Several("large", 40, (0.10, 0.10, 0.95))
    middle = Several("middle", 30, (0.12, 0.12, 0.97))
    selection = select_row([small, large, middle])
    assert selection.row is middle
    assert {row.model for row in selection.equivalent} == {"small", "large"}
    assert selection.sentence == snapshot
    assert select_row([small, replace(small, model="large", n_coefficients=40)]).row is small


def test_a_diverged_row_never_precedes_one_whose_replays_ended(snapshot):
    lost = Entry("lost", 12, (0.2, 0.5, 0.8), divergences=("fold 1, segment a after 3 s",))
    worse = (
        Entry("safe", 44, (0.22, 0.44, 0.87)),
        Entry("far", 44, (2.2, 4.4, 8.7)),
        Entry("loose", 44, (2.2, 4.4, 8.7), converged=False),
    )
    for other in worse:
        selection = select_row([lost, other])
        assert (selection.row, selection.ranked) == (other, (other,))
        assert selection.caveat == snapshot
    alone = select_row([lost, replace(lost, model="other", errors=(0.3, 0.6, 0.9))])
    assert alone.row is lost
    assert str(alone) == snapshot


def test_an_exact_fit_has_no_margin():
    selection = select_row([Entry("a", 1, (0.0,)), Entry("b", 1, (0.3,))])
    assert "second is b by ls, 3 %." in str(selection)


def test_fits_that_have_not_converged_are_excluded_unless_none_has(snapshot):
    loose = Entry("loose", 36, (0.1,), converged=False, method="ai")
    assert select_row([loose, *ROWS]).row is LARGE
    only = select_row([loose])
    assert (only.row, only.runner_up) == (loose, None)
    assert str(only) == snapshot


@dataclass(frozen=True)
class Several(Entry):
    """Errors of several velocities over the unit of each, with motion and noise of equal units."""

    units: tuple[float, ...] = (1.0, 1.0, 1.0)
    motion: tuple[float, ...] = (1.0, 1.0, 1.0)
    noise: tuple[float, ...] = (0.0, 0.0, 0.0)

    @property
    def blocks(self):
        shape = (4, 3)
        error, motion, noise = (
            np.broadcast_to(np.square(np.multiply(values, self.units)), shape)
            for values in (self.errors, self.motion, self.noise)
        )
        return BlockErrors(("u", "w", "r"), np.ones(4), error, motion, noise, np.zeros(4, bool))


UNITS = {
    "rad": (1.0, 1.0, 1.0),
    "deg": (1.0, 1.0, np.degrees(1.0)),
    "feet": (1.0 / 0.3048, 1.0 / 0.3048, 1.0),
    "heave": (1.0, 1e-3, 1.0),
}


@pytest.mark.parametrize("units", UNITS.values(), ids=UNITS)
def test_the_selected_row_and_its_error_do_not_depend_on_units(units):
    """In deg/s the yaw rate alone would select `turns`, in rad/s surge and heave `drag`."""
    noise = (0.05, 0.05, 0.05)
    drag = Several("drag", 20, (0.1, 0.1, 0.4), units=units, noise=noise)
    turns = Several("turns", 20, (0.6, 0.6, 0.2), units=units, noise=noise)
    selection = select_row([turns, drag])
    assert selection.row is drag
    expected = np.sqrt(np.subtract(np.square([0.1, 0.1, 0.4]), 0.05**2)).mean()
    assert selection.errors.relative_error(selection.velocities) == pytest.approx(expected)


def test_an_error_at_the_level_of_the_noise_is_none():
    """The noise is the least excess that counts, for every row."""
    noise = (0.3, 0.3, 0.3)
    exact = Several("exact", 60, (0.3, 0.3, 0.3), noise=noise)
    close = Several("close", 20, (0.32, 0.3, 0.29), noise=noise)
    coarse = Several("coarse", 10, (0.5, 0.5, 0.5), noise=noise)
    assert select_row([exact, close, coarse]).row is close
    assert exact.blocks.relative_error("uwr") == pytest.approx(0.3)


def test_velocities_that_the_test_does_not_excite_do_not_count():
    """Heave has noise only, and the training moves far more in yaw than the test."""
    still = {"motion": (1.0, 0.1, 1.0), "noise": (0.01, 0.1, 0.01)}
    good = Several("good", 20, (0.1, 9.0, 9.0), **still)
    bad = Several("bad", 20, (0.5, 0.1, 0.1), **still)
    assert select_row([good, bad], untested={"r"}).row is good
    assert select_row([good, bad], untested={"r"}).velocities == ("u",)
    assert select_row([good, bad]).row is bad
    assert select_row([good], untested={"u", "r"}).velocities == ("u", "r")


def test_without_a_replay_nothing_is_selected():
    with pytest.raises(MethodError, match="nothing was fitted"):
        select_row([EMPTY])


def test_the_front_has_lower_errors_for_more_coefficients():
    beaten = Entry("beaten", 40, (0.64,))
    same = Entry("same", 36, (0.64,))
    assert front(*ROWS, beaten, same) == (TINY, SMALL, LINEAR, LARGE)
    assert front(EMPTY) == ()


def test_the_front_is_of_the_relative_error():
    """Equation 24 in deg/s would have the smaller row alone on the front."""
    turns = Several("turns", 20, (0.6, 0.6, 0.2), units=UNITS["deg"])
    drag = Several("drag", 30, (0.1, 0.1, 0.4), units=UNITS["deg"])
    assert turns.rms < drag.rms
    assert front(drag, turns) == (turns, drag)
