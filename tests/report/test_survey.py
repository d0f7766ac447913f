from __future__ import annotations

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.report.survey import survey
from hydrodamp.report.survey_grids import LISTED, survey_grids
from hydrodamp.report.verdict import verdict


def many_segments(n: int) -> Log:
    time = np.tile([0.0, 0.1, 0.3], n)
    names = np.repeat([f"run{k}" for k in range(n)], 3)
    commands = {"rpm": np.tile([1.0, 1.0, 2.0], n)}
    return Log.from_arrays(time, np.ones((3 * n, 6)), commands=commands, segment=names.tolist())


def test_steps_and_changes_stay_within_segments() -> None:
    found = survey(many_segments(2))
    assert [part.longest_step for part in found.stretches] == [0.3 - 0.1] * 2
    assert found.commands[0].n_changes == 2
    assert found.source == "in memory"


def test_many_segments_are_counted() -> None:
    log = many_segments(LISTED + 3)
    found = survey(log)
    segments, _ = survey_grids(found, verdict(found, log))
    assert len(segments.rows) == LISTED
    assert segments.notes == ("and 3 more segments",)


def test_a_sound_log_is_fit_for_the_job() -> None:
    time = np.arange(0.0, 100.0, 0.1)
    waves = np.sin(np.outer(time, np.linspace(0.3, 0.9, 6)))
    log = Log.from_arrays(
        time,
        waves,
        attitude=np.tile([1.0, 0.0, 0.0, 0.0], (1000, 1)),
        wrench=waves,
        acceleration=waves,
    )
    judged = verdict(survey(log), log)
    assert judged.sentence == "Fit for the job."
    assert survey(log).has == ("attitude", "wrench", "acceleration")
