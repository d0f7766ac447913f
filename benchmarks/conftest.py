"""One thread for BLAS, one core where it helps, and a ledger of ratios printed at the end."""

from __future__ import annotations

import os
import sys
from pathlib import Path

for _pool in ("OPENBLAS", "OMP", "MKL", "VECLIB_MAXIMUM"):
    os.environ[f"{_pool}_NUM_THREADS"] = "1"  # read once, when NumPy is first imported
sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

import pytest  # noqa: E402
from ledger import Ledger  # noqa: E402

LEDGER = pytest.StashKey[Ledger]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--page", type=Path, help="a page whose table, its last part, is replaced")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[LEDGER] = Ledger()


@pytest.fixture
def ledger(request: pytest.FixtureRequest) -> Ledger:
    """Where a benchmark writes its ratios."""
    return request.config.stash[LEDGER]


@pytest.fixture
def one_core():
    """Keep this thread, and the processes it starts, on one core."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    yield
    os.sched_setaffinity(0, before)


def pytest_terminal_summary(terminalreporter, config: pytest.Config) -> None:
    rows = config.stash[LEDGER].lines()
    if rows:
        terminalreporter.section("ratios, each measured in this run")
        for row in rows:
            terminalreporter.write_line(row)
    page = config.getoption("--page")
    if page:
        head, mark, _ = page.read_text("utf-8").partition("<!-- ratios -->\n")
        page.write_text(f"{head}{mark}\n{config.stash[LEDGER].markdown()}", "utf-8")
