"""Recordings of real vehicles, where the folder is at hand."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from hydrodamp.ingest.formats import files


def folder(name: str) -> Path:
    near = Path(__file__).resolve().parents[3].parent / "shared" / "data"
    path = Path(os.environ.get("HYDRODAMP_DATA", near)) / name
    if not path.is_dir():
        pytest.skip(f"{name} is not here; name its folder in HYDRODAMP_DATA")
    return path


def test_the_690_in_the_field() -> None:
    """The commonest kind of file is read: five topics at about 10 Hz, not the derived table."""
    recording = files.read(folder("vt690_field"))
    assert recording.format == "VT/AVL topic"
    assert len(recording.topics) == 5
    dvl = recording.topic("share_pathfinder_dvl_node.velocity")
    assert dvl.time is not None
    assert np.median(np.diff(dvl.time)) == pytest.approx(1 / 10.4, rel=0.15)
    assert dvl.units["v_x"] == "m/s"
    assert set(dvl.fields) == {"time", "v_x", "v_y", "v_z", "data_good"}
    pitch = recording.topic("share_pid_attitude_control_node.pitch_pid")
    assert np.isnan(pitch.fields["pitch_setpoint"]).any()


def test_the_tanker_has_no_names() -> None:
    for path in sorted(folder("kvlcc2_hsva").glob("*.dat")):
        recording = files.read(path)
        topic = recording.topics[0]
        assert list(topic.fields) == [f"column {k}" for k in range(1, 13)]
        assert topic.lines[0] == 5
        np.testing.assert_allclose(np.diff(topic.fields["column 1"]), 0.05, atol=1e-6)
        assert "Windows-1252" in recording.notes[0]
