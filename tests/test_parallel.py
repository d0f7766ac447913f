from __future__ import annotations

import _thread
import threading
import time

import pytest
from threadpoolctl import ThreadpoolController, threadpool_limits

from hydrodamp.progress import run_parallel


def test_results_come_in_order_and_each_is_handed_out_once():
    told: list[int] = []
    squares = [k * k for k in range(20)]
    assert [*run_parallel(lambda x: x * x, [(k,) for k in range(20)], told.append)] == squares
    assert sorted(told) == squares


def test_after_an_interruption_all_finished_work_is_handed_out_and_none_begun():
    told: list[int] = []
    begun: list[int] = []
    over = threading.Event()

    def work(number):
        begun.append(number)
        if number == 3:
            time.sleep(0.2)  # until the others are done
            raise KeyboardInterrupt
        if number > 3:
            over.wait()
        return number

    with pytest.raises(KeyboardInterrupt):
        run_parallel(work, [(k,) for k in range(1000)], told.append)
    over.set()
    assert told == [0, 1, 2]
    assert len(begun) < 1000


def test_ctrl_c_does_not_wait_for_work_that_is_not_done():
    at_work, over = threading.Event(), threading.Event()

    def long():
        at_work.set()
        over.wait()

    def interrupt():
        at_work.wait()
        _thread.interrupt_main()

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        run_parallel(long, [()] * 5)
    assert not over.is_set()
    over.set()


def test_blas_keeps_to_the_thread_that_calls_it():
    """Threads of BLAS beside ours took the demo two and a half times as long."""

    def threads():
        blas = ThreadpoolController().select(user_api="blas")  # OpenMP counts by calling thread
        return {library["num_threads"] for library in blas.info()}

    with threadpool_limits(limits=2):
        assert run_parallel(threads, [(), ()]) == ({1}, {1})
        assert threads() == {2}
