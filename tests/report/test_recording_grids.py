from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.conditioning.attitude_jumps import steady_attitude
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.ingest.probing.delay import Delay
from hydrodamp.ingest.probing.probe import probe
from hydrodamp.report.probed import by_guess, judged
from hydrodamp.report.recording_grids import TOPICS, delay_grid, draft_grid, topics_grid
from hydrodamp.report.survey import survey
from hydrodamp.report.verdict import verdict

TIME = np.arange(0.0, 60.0, 0.1)


def notes(*topics: Topic, form: str = "text in columns") -> str:
    found = probe(Recording(topics, "dive.csv", form))
    grids = topics_grid(found), draft_grid(found)
    return "\n".join(note for grid in grids for note in grid.notes)


def test_topics_are_counted_and_their_clocks_told() -> None:
    back = np.concatenate((TIME, TIME[:5]))
    many = [Topic(f"t{k:02}", TIME, {"a": TIME}) for k in range(TOPICS + 2)]
    told = notes(*many, Topic("back", back, {"a": back}, faults={"b": "`b` is broken"}))
    assert "and 3 more topics" in told
    told = notes(Topic("back", back, {"a": back}, units={"a": "m"}, faults={"b": "`b` is broken"}))
    assert "back: 1 times the clock stands still or goes back." in told
    assert "back: `b` is broken" in told
    assert "Units the file states: m." in told


def test_rates_in_other_axes_are_told() -> None:
    angles = np.column_stack((np.sin(TIME), 0.3 * np.sin(0.7 * TIME), np.sin(0.5 * TIME)))
    rate = np.gradient(angles[:, 2], TIME)
    told = notes(Topic("", None, {"t": TIME, "yaw": angles[:, 2], "q": -np.cos(TIME), "r": -rate}))
    assert "Rates are in axes of the other kind than the attitude" in told
    assert "Motion alone cannot tell" in told


def test_a_column_too_unsure_for_the_draft_is_named() -> None:
    told = notes(Topic("", None, {"t": TIME, "u": 100 + 50 * np.sin(TIME), "v": 99 * np.cos(TIME)}))
    assert "No shipped preset fits." in told
    assert "too unsure (" in told


def test_an_answer_before_its_command_is_told() -> None:
    early = Delay("rudder", "r", -0.3, 0.05, 0.4, -1, 40)
    grid = delay_grid((early, Delay("rpm", "u", 0.2, None, 0.4, 1, 50)))
    assert grid.rows[0] == ("rudder", "-r", "-0.30", "0.05", "40 %", "40 %")
    assert grid.rows[1][3] == "-"
    assert any("before rudder:" in note for note in grid.notes)


def test_a_preset_is_tried_where_the_draft_fails() -> None:
    """A heading alone gives the draft no velocities; the preset knows its columns."""
    rng = np.random.default_rng(1)
    columns = {name: rng.standard_normal(600) for name in ("u", "v", "w", "p", "q", "r")}
    columns |= {f"{name}_rad": 0.1 * np.sin(TIME) for name in ("roll", "pitch", "yaw")}
    columns |= {
        f"ch_{name}": np.sign(np.sin(TIME))
        for name in ("forward", "lateral", "heave", "roll", "pitch", "yaw")
    }
    table = Topic("", None, {"time_s": TIME, **columns})
    recording = Recording((table,), "run.csv", "text in columns")
    found = probe(recording)
    assert [one.name for one in found.presets] == ["bluerov2-kth"]
    assert by_guess(found, [recording]).way == "by the draft"


def test_a_current_is_minded() -> None:
    """Through the water 1 m/s straight ahead on turning headings, 0.3 m/s of tide to the east."""
    rng = np.random.default_rng(2)
    time = np.arange(0.0, 1200.0, 0.5)
    yaw = 0.02 * time
    over = np.column_stack((np.cos(yaw), np.sin(yaw) + 0.3))
    surge = np.cos(yaw) * over[:, 0] + np.sin(yaw) * over[:, 1]
    sway = -np.sin(yaw) * over[:, 0] + np.cos(yaw) * over[:, 1]
    noise = 0.01 * rng.standard_normal((2, len(time)))
    log = Log.from_arrays(
        time,
        {"u": surge + noise[0], "v": sway + noise[1], "r": 0.02 + 0 * time},
        attitude=quaternion_from_euler(np.column_stack((0 * yaw, 0 * yaw, yaw))),
    )
    (told,) = [each for each in verdict(survey(log), log).reservations if "current" in each]
    assert "0.3 m/s" in told
    assert "`without_current`" in told


@pytest.mark.parametrize(
    ("places", "words"),
    [
        ((), ""),
        ((400,), "at one sample, at 40.00 s"),
        ((9000, 400), "at 2 samples, the first at 40.00 s"),
    ],
)
def test_leaps_of_the_attitude_are_minded_as_the_step_finds_them(places, words) -> None:
    """A heading that crosses the wrap, where averaged samples read zero."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 1000.0, 0.1)
    yaw = np.pi + 0.4 * np.sin(0.05 * time) + 0.002 * rng.standard_normal(len(time))
    yaw[list(places)] = 0.0
    attitude = quaternion_from_euler(np.outer(yaw, (0, 0, 1)))
    log = Log.from_arrays(time, {"r": np.gradient(yaw, time)}, attitude=attitude)
    told = [each for each in verdict(survey(log), log).reservations if "leaps" in each]
    assert len(told) == bool(places)
    assert all(words in each and "`steady_attitude`" in each for each in told)
    found = steady_attitude(log).counts("attitude leaps")
    assert sum(found.values()) == len(places)


@pytest.mark.parametrize("has", [True, False])
def test_what_can_be_derived_is_counted(has: bool) -> None:
    yaw = np.sin(TIME)
    attitude = quaternion_from_euler(np.column_stack((0 * yaw, 0.2 * np.cos(0.6 * TIME), yaw)))
    log = Log.from_arrays(TIME, {"u": yaw}, attitude=attitude if has else None)
    said = judged(log, "").verdict
    assert any("yaw" in each for each in said.promises) is has
    assert any("`rates_from_attitude`" in each for each in said.missing) is has
