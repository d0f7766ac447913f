import re
from collections import Counter
from collections.abc import Callable

import pytest

from hydrodamp.data.log import Log

Counts = Callable[[Log, str], dict[str, int]]
_NOTE = re.compile(r"(.+): (\d+) of \d+ samples of `(\w+)` \(.* %\) .+")


@pytest.fixture(scope="session")
def counts():
    """Return how many samples of each channel a step touched, by the notes of a log."""

    def of(log, step):
        found = Counter()
        for note in log.notes:
            told = _NOTE.fullmatch(note)
            if told is not None and told[1] == step:
                found[told[3]] += int(told[2])
        return dict(found)

    return of
