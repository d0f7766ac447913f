"""Whoever gives one file for another, or misspells it, or forgets it, is told what to type."""

import pytest


@pytest.mark.parametrize(
    "line",
    [
        "compare a.csv --train 0:9 --test 9:20",
        "compare a.csv --folds 2",
        "identify a.csv --model linear --out d.json",
    ],
)
def test_a_vehicle_that_is_forgotten(folder, call, line):
    done = call(line, 2)
    assert done.stderr.startswith(
        "error: `--vehicle` is missing: give a vehicle of the fleet (bluerov2"
    )
    assert "`hydrodamp vehicle new`" in done.stderr
    assert not (folder / "d.json").exists()
