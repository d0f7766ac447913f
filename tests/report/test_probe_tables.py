from dataclasses import replace

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.ingest.inspection.delay import Delay
from hydrodamp.ingest.inspection.probe import Inspection, inspect, probe
from hydrodamp.ingest.inspection.quality_report import report_quality
from hydrodamp.report.probe_tables import MAX_LISTED, probe_tables

TIME = np.arange(0.0, 60.0, 0.1)
CANONICAL = Recording((Topic("", None, {"time": TIME, "u": TIME}),), "dive.csv", "text in columns")


def notes(*topics, form="text in columns"):
    recording = Recording(topics, "dive.csv", form)
    found = probe(recording)
    return "\n".join(
        note for grid in probe_tables(found, inspect(found, [recording])) for note in grid.notes
    )


def grids_of(log, *delays):
    judged = replace(report_quality(log), delays=delays)
    return probe_tables(probe(CANONICAL), Inspection("", judged))


def test_topics_are_counted_and_their_clocks_told():
    back = np.concatenate((TIME, TIME[:5]))
    many = [Topic(f"t{k:02}", TIME, {"a": TIME}) for k in range(MAX_LISTED + 2)]
    told = notes(*many, Topic("back", back, {"a": back}, faults={"b": "`b` is broken"}))
    assert "and 3 more topics" in told
    told = notes(Topic("back", back, {"a": back}, units={"a": "m"}, faults={"b": "`b` is broken"}))
    assert "back: 1 times the clock repeats" in told
    assert "back: `b` is broken" in told
    assert "Units the file states: m." in told


def test_rates_in_other_axes_are_told():
    angles = np.column_stack((np.sin(TIME), 0.3 * np.sin(0.7 * TIME), np.sin(0.5 * TIME)))
    rate = np.gradient(angles[:, 2], TIME)
    told = notes(Topic("", None, {"t": TIME, "yaw": angles[:, 2], "q": -np.cos(TIME), "r": -rate}))
    assert "Rates are in other axes than the attitude" in told
    assert "otion alone cannot distinguish" in told


def test_an_answer_before_its_command_is_told():
    log = Log(TIME, np.ones((len(TIME), 6)))
    early = Delay("rudder", "r", -0.3, 0.05, 0.4, -1, 40)
    verdict, _, grid, _ = grids_of(log, early, Delay("rpm", "u", 0.2, None, 0.4, 1, 50))
    assert verdict.notes[0].startswith("Verdict: ")
    assert grid.words[0] == ["rudder", "r", "-1", "-0.30", "0.05", "40%", "40"]
    assert grid.words[1][4] == "-"
    assert any("precedes rudder:" in note for note in grid.notes)
