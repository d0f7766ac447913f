from __future__ import annotations

import io

import pytest
from rich.console import Console

from hydrodamp.advance import advance
from hydrodamp.cli import progress as module
from hydrodamp.cli.progress import followed, progress, stages


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Standard error: a terminal of 120 columns."""
    screen = Terminal()
    monkeypatch.setenv("TERM", "xterm")
    console = Console(file=screen, force_terminal=True, width=120, color_system=None)
    monkeypatch.setattr(module, "messages", lambda: console)
    return screen


def test_nothing_is_shown_where_there_is_no_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # colours in a file are no reason for bars in it
    with progress("identifying", 3) as step:
        step()
    assert capsys.readouterr() == ("", "")


def test_steps_are_counted_from_those_of_an_earlier_run(terminal: Terminal) -> None:
    with progress("[identifying]", 9, 4) as step:
        step("what a callback is given")
        step(steps=2)
    assert "[identifying]" in terminal.getvalue()
    assert "7/9" in terminal.getvalue()
    assert "left" in terminal.getvalue()


@pytest.mark.parametrize("total", [None, 1])
def test_work_without_steps_shows_how_long_it_has_taken(
    total: int | None, terminal: Terminal
) -> None:
    with progress("reading", total):
        pass
    assert "0:00:00" in terminal.getvalue()
    assert "left" not in terminal.getvalue()


def test_bytes_are_shown_as_such(terminal: Terminal) -> None:
    with progress("downloading", 5_000_000, unit="B") as step:
        step(steps=2_500_000)
    assert "2.5/5.0 MB" in terminal.getvalue()


def test_work_that_says_how_far_it_has_come(terminal: Terminal) -> None:
    with stages("drawing") as reach:
        reach("[residuals]", 3, 11)
    assert "drawing [residuals]" in terminal.getvalue()
    assert "3/11" in terminal.getvalue()
    assert "left" in terminal.getvalue()


def test_work_that_tells_what_share_of_it_is_done(terminal: Terminal) -> None:
    with followed("writing", 800):
        by = advance(4)
        by()
        by()
    assert "writing" in terminal.getvalue()
    assert "400/800" in terminal.getvalue()


def test_nothing_is_said_of_rate_and_time_before_they_are_known(terminal: Terminal) -> None:
    with stages("reading", unit="B"):
        pass
    assert "reading" in terminal.getvalue()
    assert "left" not in terminal.getvalue()
    assert "/?" not in terminal.getvalue()


def test_each_of_several_works_has_a_length_of_its_own(terminal: Terminal) -> None:
    with stages("downloading", unit="B") as reach:
        for done in (1_000_000, 2_000_000):
            reach("a.dat", done, 4_000_000)
        reach("b.dat", 500, 0)
        reach("c.dat", 5_000, 9_000)
    assert "downloading c.dat" in terminal.getvalue()
    assert "5.0/9.0 kB" in terminal.getvalue()
    assert "a.dat" not in terminal.getvalue()
