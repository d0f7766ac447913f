from __future__ import annotations

import _thread
import threading

import pytest

from hydrodamp.simulation.parallel import each


def test_results_come_in_order_and_each_is_handed_out_once() -> None:
    told: list[int] = []
    assert each(lambda x: x * x, [(k,) for k in range(20)], told.append) == tuple(
        k * k for k in range(20)
    )
    assert sorted(told) == [k * k for k in range(20)]


def test_an_error_is_raised_after_the_rest_is_handed_out() -> None:
    told: list[float] = []
    with pytest.raises(ZeroDivisionError):
        each(lambda x: 1.0 / x, [(1.0,), (0.0,), (2.0,)], told.append)
    assert sorted(told) == [0.5, 1.0]


def test_after_an_interruption_all_finished_work_is_handed_out_and_none_begun() -> None:
    told: list[int] = []
    begun: list[int] = []

    def work(number: int) -> int:
        begun.append(number)
        if number == 3:
            raise KeyboardInterrupt
        while number > 3:
            pass  # until it is stopped
        return number

    with pytest.raises(KeyboardInterrupt):
        each(work, [(k,) for k in range(1000)], told.append)
    assert told == [0, 1, 2]
    assert len(begun) < 1000


def test_ctrl_c_stops_work_that_would_never_end() -> None:
    at_work = threading.Event()

    def endless() -> None:
        at_work.set()
        while True:
            pass

    def interrupt() -> None:
        at_work.wait()
        _thread.interrupt_main()

    before = threading.active_count()
    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        each(endless, [()] * 5)
    assert threading.active_count() == before
