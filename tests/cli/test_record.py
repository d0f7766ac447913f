from __future__ import annotations

import hashlib
import warnings
from pathlib import Path

import pytest

from hydrodamp.cli.guard import warned, warnings_as_notes
from hydrodamp.cli.record import record
from hydrodamp.errors import GapWarning


def test_a_run_says_what_it_read_and_was_warned_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["x", "compare", "a b.csv"])
    (tmp_path / "a b.csv").write_bytes(b"1")
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "c\nd.csv").write_bytes(b"2")
    with warnings_as_notes():
        for _ in range(2):
            warnings.warn("split at a gap", GapWarning, stacklevel=1)
        words = record(("a b.csv", None, "vt690", "runs", "a b.csv"))
    assert words["command"] == "hydrodamp compare 'a b.csv'"
    assert words["warnings"] == "split at a gap"
    one, two = (hashlib.sha256(each).hexdigest() for each in (b"1", b"2"))
    assert words["files"].splitlines() == [
        f"{one}  a b.csv",
        f"{two}  runs/c\N{REPLACEMENT CHARACTER}d.csv",
    ]
    assert words["versions"].startswith("Python 3")
    assert warned() == ()
    assert "warnings" not in record(())
