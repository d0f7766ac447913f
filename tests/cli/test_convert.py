import numpy as np
import pytest
import scipy.io

from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.read import read_log, read_recording


@pytest.mark.slow
def test_a_log_through_a_mapping_becomes_canonical(folder, call):
    (folder / "m.yaml").write_text(
        "time: time\nvelocity: {u: u, v: v, r: {column: r, unit: deg/s}}\n"
        "commands: [ahead, turn]\nsteps: [annotate_quality]\n"
    )
    done = call("convert a.csv --mapping m.yaml --out c.csv --force")
    before, after = (read_log(folder / name).velocity[:, 5] for name in ("a.csv", "c.csv"))
    np.testing.assert_allclose(after, np.radians(before))
    assert "400 samples" in done.stdout
    assert "written to c.csv" in done.stderr


def halves(folder, run, source="a.csv"):
    """Write a log as two files of one run: the motion at 10 Hz, the commands at half of it."""
    table = np.genfromtxt(folder / source, delimiter=",", names=True, dtype=None, encoding=None)
    for part, names, rows in (("pose", ("u", "v", "r"), 1), ("pwm", ("ahead", "turn"), 2)):
        columns = np.column_stack([table[name][::rows] for name in ("time", *names)])
        header = ",".join(("time", *names))
        path = folder / f"{run}_{part}.csv"
        np.savetxt(path, columns, delimiter=",", header=header, comments="", fmt="%.17g")


@pytest.mark.slow
def test_files_of_one_recording_go_in_together(folder, call):
    """Joined by a plus, the draft says so for all runs: any file then stands for its recording."""
    halves(folder, "run1")
    halves(folder, "run2", "b.csv")
    call("probe run1_pose.csv+run1_pwm.csv --draft m.yaml")
    assert 'pwm: "*_pwm.csv"' in (folder / "m.yaml").read_text("utf-8")
    for line in ("run2_pose.csv", "run2_pwm.csv", "run2_pose.csv+run2_pwm.csv"):
        call(f"convert {line} --mapping m.yaml --out c.csv --force")
        known, found = read_log(folder / "b.csv"), read_log(folder / "c.csv")
        np.testing.assert_allclose(found.velocity, known.velocity)
        np.testing.assert_allclose(found.commands, known.commands)
    (folder / "other").mkdir()
    (folder / "run2_pwm.csv").rename(folder / "other" / "run2_pwm.csv")
    call("convert run2_pose.csv+other/run2_pwm.csv --mapping m.yaml --out c.csv --force")
    (folder / "other" / "run2_pwm.csv").rename(folder / "run2_pwm.csv")
    line = "compare --vehicle planar.yaml --mapping m.yaml --models linear --methods ls"
    (folder / "m.yaml").write_text((folder / "m.yaml").read_text("utf-8") + "\n", "utf-8")
    call(f"{line} --train run1_pose.csv --test run2_pose.csv+run2_pwm.csv")
    (folder / "run2_pwm.csv").write_text("time,ahead\n0,1\n1\n", "utf-8")
    said = " ".join(call("convert run2_pose.csv --mapping m.yaml --out d.csv", 2).stderr.split())
    assert "skipped: run2_pwm.csv: line 3 has 1 cells" in said
    (folder / "run2_pwm.csv").unlink()
    assert "no such file" in call("convert run2_pose.csv --mapping m.yaml --out d.csv", 2).stderr


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["npz", "mat"])
def test_arrays_of_other_lengths_are_tables_of_their_own(folder, kind):
    """A simulation of more arrays than the measurement beside it refuses neither."""
    time, fine = np.arange(0.0, 60.0, 0.1), np.arange(0.0, 60.0, 0.01)
    arrays = {"tm": time, "um": np.sin(time), "params": np.ones(5)}
    arrays |= {"t": fine} | {f"sim{k}": fine * k for k in range(4)}
    path = folder / f"run.{kind}"
    np.savez(path, **arrays) if kind == "npz" else scipy.io.savemat(path, arrays)
    mapping = LogMapping.from_dict({"time": "tm", "velocity": {"u": "tm.um"}})
    assert read_log(path, mapping).velocity[:, 0].tolist() == np.sin(time).tolist()
    faults = read_recording(path).topic("").faults
    assert list(faults) == ["params"]
