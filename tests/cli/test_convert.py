from __future__ import annotations

import numpy as np

from hydrodamp.ingest.read import read_log


def test_a_log_through_a_mapping_becomes_canonical(folder, call):
    (folder / "m.yaml").write_text(
        "time: time\nvelocity: {u: u, v: v, r: {column: r, unit: deg/s}}\n"
        "commands: [ahead, turn]\nsteps: [note_suspicions]\n"
    )
    done = call("convert a.csv --mapping m.yaml --out c.csv")
    before, after = (read_log(folder / name).velocity[:, 5] for name in ("a.csv", "c.csv"))
    np.testing.assert_allclose(after, np.radians(before))
    assert "400 samples" in done.stdout
    assert "written to c.csv" in done.stderr
