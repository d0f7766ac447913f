"""Bars on standard error, where that is a terminal and somebody watches."""

import io
import sys
from contextlib import contextmanager

from hydrodamp.progress import count_items, progress, show_progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@contextmanager
def on_terminal(monkeypatch):
    """Standard error is a terminal of 120 columns inside."""
    screen = Terminal()
    with monkeypatch.context() as patch:
        patch.setenv("TERM", "xterm")
        patch.setenv("COLUMNS", "120")
        patch.setattr(sys, "stderr", screen)
        yield screen


def test_nothing_is_shown_where_there_is_no_terminal(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # colours in a file are no reason for bars in it
    with show_progress(), progress("identifying", 3) as step:
        step()
    assert capsys.readouterr() == ("", "")


def test_lines_say_what_starts_where_there_is_no_terminal(capsys):
    with show_progress(lines=True), progress("identifying", 3) as step:
        step()
        with progress("identifying"):
            pass
    with progress("quiet"):
        pass
    assert capsys.readouterr() == ("", "identifying\n")


def test_lines_state_the_progress_of_long_work(capsys, monkeypatch):
    monkeypatch.setattr("hydrodamp.progress._LINE_INTERVAL", 0.0)
    with show_progress(lines=True):
        assert [*count_items("ab", "reading", 2)] == ["a", "b"]
    assert capsys.readouterr().err.splitlines() == ["reading", "reading: 50%", "reading: 100%"]


def test_steps_are_counted_with_their_share_and_the_time_left(monkeypatch):
    with on_terminal(monkeypatch) as screen:
        assert [*count_items("abc", "reading", 3)] == ["a", "b", "c"]
    assert screen.getvalue() == ""  # to a program that watches nothing
    with on_terminal(monkeypatch) as screen, show_progress(), progress("[identifying]", 9) as step:
        step()
        step(6)
    for words in ("[identifying]", "78%", "-:--:--"):
        assert words in screen.getvalue()


def test_work_inside_work_has_a_bar_of_its_own(monkeypatch):
    with on_terminal(monkeypatch) as screen, show_progress(), progress("outer"):
        assert [*count_items("abcd", "inner", 4)] == [*"abcd"]
    for words in ("outer", "inner", "100%"):
        assert words in screen.getvalue()
