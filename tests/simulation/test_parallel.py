from __future__ import annotations

import _thread
import threading
import time

import pytest

from hydrodamp.simulation import parallel
from hydrodamp.simulation.parallel import each


def test_results_come_in_order_and_each_is_handed_out_once() -> None:
    told: list[int] = []
    assert each(lambda x: x * x, [(k,) for k in range(20)], told.append) == tuple(
        k * k for k in range(20)
    )
    assert sorted(told) == [k * k for k in range(20)]


def test_after_an_error_work_under_way_is_handed_out_and_no_more_is_begun() -> None:
    told: list[int] = []
    begun: list[int] = []

    def work(number: int) -> int:
        begun.append(number)
        if number == 3:
            raise ZeroDivisionError
        if number > 3:
            time.sleep(0.05)
        return number

    with pytest.raises(ZeroDivisionError):
        each(work, [(k,) for k in range(1000)], told.append)
    assert sorted(told) == sorted(set(begun) - {3})
    assert len(begun) < 1000


def test_a_second_ctrl_c_loses_nothing_that_is_finished(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[int] = []
    stop = parallel._Crew.stop

    def stop_and_be_interrupted(crew: parallel._Crew) -> None:
        stop(crew)
        raise KeyboardInterrupt

    def work(number: int) -> int:
        if number == 2:
            raise KeyboardInterrupt
        return number

    monkeypatch.setattr(parallel._Crew, "stop", stop_and_be_interrupted)
    monkeypatch.setattr(parallel, "_await", lambda futures, *_: [one.result() for one in futures])
    with pytest.raises(KeyboardInterrupt):
        each(work, [(k,) for k in range(3)], told.append)
    assert told == [0, 1]


@pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")
def test_no_thread_of_the_pool_is_hit_by_what_was_meant_for_the_work(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Calls that end all the time, while they are told to stop."""
    for _ in range(5):
        begun = threading.Event()

        def interrupt(begun: threading.Event = begun) -> None:
            begun.wait()
            _thread.interrupt_main()

        threading.Thread(target=interrupt).start()
        with pytest.raises(KeyboardInterrupt):
            each(begun.set, [()] * 100_000)
    assert not caplog.records


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
