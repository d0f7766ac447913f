from dataclasses import replace

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.ingest.inspection.delay import Delay
from hydrodamp.ingest.inspection.probe import Inspection, inspect, probe
from hydrodamp.ingest.inspection.quality_report import report_quality
from hydrodamp.report.probe_tables import MAX_LISTED, probe_tables
from hydrodamp.report.table import to_text

TIME = np.arange(0.0, 60.0, 0.1)
CANONICAL = Recording((Topic("", None, {"time": TIME, "u": TIME}),), "dive.csv", "text in columns")


def text_of(*topics):
    recording = Recording(topics, "dive.csv", "text in columns")
    found = probe(recording)
    return "\n".join(map(to_text, probe_tables(found, inspect(found, [recording]))))


def test_topics_are_counted_and_their_clocks_told(snapshot):
    back = np.concatenate((TIME, TIME[:5]))
    many = [Topic(f"t{k:02}", TIME, {"a": TIME}) for k in range(MAX_LISTED + 2)]
    faults = {"units": {"a": "m"}, "faults": {"b": "`b` is broken"}}
    assert text_of(*many, Topic("back", back, {"a": back})) == snapshot(name="many topics")
    assert text_of(Topic("back", back, {"a": back}, **faults)) == snapshot(name="a fault")


def test_rates_in_other_axes_are_told(snapshot):
    angles = np.column_stack((np.sin(TIME), 0.3 * np.sin(0.7 * TIME), np.sin(0.5 * TIME)))
    rate = np.gradient(angles[:, 2], TIME)
    columns = {"t": TIME, "yaw": angles[:, 2], "q": -np.cos(TIME), "r": -rate}
    assert text_of(Topic("", None, columns)) == snapshot


def test_an_answer_before_its_command_is_told(snapshot):
    log = Log(TIME, np.ones((len(TIME), 6)))
    delays = Delay("rudder", "r", -0.3, 0.05, 0.4, -1, 40), Delay("rpm", "u", 0.2, None, 0.4, 1, 50)
    judged = replace(report_quality(log), delays=delays)
    tables = probe_tables(probe(CANONICAL), Inspection("", judged))
    assert "\n".join(map(to_text, tables)) == snapshot
