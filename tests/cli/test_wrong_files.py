"""Whoever gives one file for another, or misspells it, or forgets it, is told what to type."""

import pytest


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("probe a.csv --vehicle map.yaml", "map.yaml is a mapping of a log (it has velocity)"),
        ("probe a.csv --mapping planar.yaml", "planar.yaml is a vehicle (it has mass_matrix)"),
        ("probe planar.yaml", "planar.yaml is a vehicle"),
        ("models planar.yaml", "not a file of models: give it as `--vehicle`"),
        ("simulate a.csv --vehicle planar.yaml --damping planar.yaml", "not a damping file"),
    ],
)
def test_one_file_for_another(folder, call, line, said):
    (folder / "map.yaml").write_text("time: t\nvelocity: {u: speed}\n", "utf-8")
    done = call(line, 2)
    assert said in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("line", "near"),
    [
        ("probe abb.csv", "ab.csv"),
        ("probe a.csv --vehicle plannar.yaml", "planar.yaml"),
        ("probe a.csv --mapping planar", "planar.yaml"),
        ("models planr.yaml", "planar.yaml"),
        ("simulate a.csv --vehicle planar.yaml --damping damping.jsn", "damping.json"),
    ],
)
def test_a_file_that_is_not_there(folder, call, line, near):
    (folder / "damping.json").write_text("{}", "utf-8")
    done = call(line, 2)
    assert f"Did you mean '{near}'?" in done.stderr
    assert done.stdout == ""


@pytest.mark.parametrize(
    "line",
    [
        "compare a.csv --train 0:9 --test 9:20",
        "validate a.csv",
        "identify a.csv --model linear --out d.json",
        "simulate a.csv --damping d.json",
    ],
)
def test_a_vehicle_that_is_forgotten(folder, call, line):
    done = call(line, 2)
    assert done.stderr.startswith("error: `--vehicle` is missing: name one of the fleet (bluerov2")
    assert "`hydrodamp vehicle new`" in done.stderr
    assert not (folder / "d.json").exists()
