"""How far long work has come."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from hydrodamp.advance import advance, counted, listening, shares, within


def test_nobody_needs_to_listen() -> None:
    with within(0.0, 0.5):
        advance(3)()
    assert [*counted("abc", 3)] == ["a", "b", "c"]


def test_parts_of_parts_make_shares_of_the_whole() -> None:
    heard: list[float] = []
    with listening(heard.append):
        with within(0.0, 0.5):
            with within(0.0, 0.5):
                advance(2)()
            advance(4)(3)
        with within(0.5, 1.0):
            [*counted(range(4), 4, each=2)]
    assert heard == [0.125, 0.25, 0.375, 0.5, 0.75, 1.0, 1.0]


def test_a_listener_is_gone_whatever_happens() -> None:
    heard: list[float] = []
    with pytest.raises(KeyError), listening(heard.append), within(0.5, 1.0):
        raise KeyError
    advance(1)()
    assert heard == []


def test_threads_tell_too_and_never_too_much() -> None:
    heard: list[float] = []
    with listening(heard.append):
        by = advance(100)
        with ThreadPoolExecutor(4) as pool:
            list(pool.map(by, [10] * 12))
    assert heard == [*(k / 10 for k in range(1, 11)), 1.0, 1.0]


def test_work_of_no_steps_tells_nothing() -> None:
    heard: list[float] = []
    with listening(heard.append):
        advance(0)()
    assert heard == []


def test_parts_without_a_size_are_alike() -> None:
    assert shares([0, 0]) == [(0.0, 0.5), (0.5, 1.0)]
    assert shares([]) == []
