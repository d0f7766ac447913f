from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from typer.testing import Result

from hydrodamp.ingest.read import read_log

Call = Callable[..., Result]


def test_a_log_through_a_mapping_becomes_canonical(folder: Path, call: Call) -> None:
    log = read_log(folder / "a.csv")
    (folder / "m.yaml").write_text(
        "time: time\nvelocity: {u: u, v: v, r: {column: r, unit: deg/s}}\n"
        "commands: [ahead, turn]\nsteps: [note_suspicions]\n"
    )
    done = call("convert a.csv --mapping m.yaml --out b.csv")
    assert done.exit_code == 0, done.output
    again = read_log(folder / "b.csv")
    np.testing.assert_allclose(again.velocity[:, 5], np.radians(log.velocity[:, 5]))
    assert "400 samples" in done.stdout
    assert "written to b.csv" in done.stderr


def test_the_log_itself_is_not_overwritten(folder: Path, call: Call) -> None:
    done = call("convert a.csv --out a.csv")
    assert done.exit_code == 2
    assert "a.csv" in done.stderr
