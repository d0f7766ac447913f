"""The table of the seconds of log that determine each coefficient."""

from pathlib import Path

import pytest

from duration import MARKS, duration_table

PAGE = Path(__file__).parents[2] / "docs/explanation/results.md"


@pytest.mark.slow
def test_page_has_the_durations_that_the_study_computes():
    page = PAGE.read_text("utf-8").split(MARKS[0])[1].split(MARKS[1])[0].strip()
    without_ratios = slice(-1)  # the last row is of fits, whose last digit depends on the platform
    assert duration_table().split("\n")[without_ratios] == page.split("\n")[without_ratios]
