"""Splits of measured logs: checksums, the table of splits, and the true wind."""

import hashlib

import numpy as np
import pytest

import benchmark_measured
import hydrodamp as hd
import measured_splits
from benchmark_measured import Row
from hydrodamp.errors import FileError
from measured_splits import check_file, read_splits, turn_wind


def test_a_file_with_another_checksum_is_refused(tmp_path):
    (tmp_path / "run.csv").write_bytes(b"time,u\n")
    expected = hashlib.sha256(b"time,u\n").hexdigest()
    assert check_file(tmp_path, "run.csv", expected) == tmp_path / "run.csv"
    (tmp_path / "run.csv").write_bytes(b"time,v\n")
    actual = hashlib.sha256(b"time,v\n").hexdigest()
    with pytest.raises(FileError, match=rf"run.csv: SHA-256 {actual}, expected {expected}"):
        check_file(tmp_path, "run.csv", expected)
    with pytest.raises(FileError, match=r"absent.csv: no such file"):
        check_file(tmp_path, "absent.csv", expected)


def test_no_split_tests_what_it_trains_on():
    """Every file has a checksum; training and test share no file, or no interval of one."""
    checksums, splits = read_splits()
    names = [split.name for split in splits]
    assert len(names) == len(set(names))
    kinds = [split.vehicle for split in splits]
    counts = {kind: kinds.count(kind) for kind in set(kinds)}
    (ship,) = (split for split in splits if split.name == "kvlcc2-10_05")
    assert ("polynomial", "recommended") in [*benchmark_measured.entries(ship)]
    assert counts == {"bluerov2": 5, "kvlcc2": 9, "esso_osaka": 1, "vt690": 1, "beluga": 1}
    assert {name for split in splits for name in split.train + split.test} == set(checksums)
    for split in splits:
        if set(split.train) & set(split.test):
            ends = [stop for _, stop in split.train_intervals]
            assert max(ends) <= min(start for start, _ in split.test_intervals)
        assert benchmark_measured.outside_methods.Names(split.velocities, (), split.terms)


def test_the_true_wind_turned_by_the_heading_and_the_velocity_give_the_relative_wind():
    """The apparent wind is the vector that the anemometer of a moving ship measures."""
    rng = np.random.default_rng(0)
    north, east, u, v = rng.uniform(-2.0, 2.0, (4, 50))  # where the wind comes from; of the ship
    heading = rng.uniform(-np.pi, np.pi, 50)
    ahead, starboard = turn_wind(np.hypot(north, east), np.arctan2(east, north), heading)
    forward = np.array([np.cos(heading), np.sin(heading)])
    right = np.array([-np.sin(heading), np.cos(heading)])
    apparent = np.array([north, east]) + u * forward + v * right
    assert np.allclose(ahead + u, (apparent * forward).sum(axis=0))
    assert np.allclose(starboard + v, (apparent * right).sum(axis=0))


def rows():
    fit = {"general": 80.0, "tank": 70.0, "": 90.0}
    found = [
        Row("bluerov2", key, "recommended" if key else "numpy-ls", "ok", 1.0, 4.0, {"u": value}, {})
        for key, value in fit.items()
    ]
    return [*found, Row("bluerov2", "", "pysindy", "diverged", 1.0, None, {}, {})]


def test_regret_is_the_relative_error_over_the_least_of_the_split():
    found = benchmark_measured.regrets(rows())
    assert found["`recommended`, `general`"]["bluerov2"] == pytest.approx(2.0)
    assert found["`recommended`, example's model"]["bluerov2"] == pytest.approx(3.0)
    assert found["`numpy-ls`"]["bluerov2"] == 1.0
    assert found["`pysindy`"]["bluerov2"] == np.inf


def test_the_tables_say_where_ours_loses():
    text = benchmark_measured.summarise(rows())
    assert "| bluerov2 | 0.200 | **2.00** | 0.300 | **3.00** | `numpy-ls` 0.100 |" in text
    assert "| `pysindy` | - | - | diverged |" in text
    summary = benchmark_measured.summarise_leads(rows())
    assert "`general` loses to the best outside method of the split on 1 of 1 splits" in summary
    assert "the largest ratio of errors is 3.00 on bluerov2" in summary


def test_the_added_mass_of_the_laboratory_replaces_that_of_the_example():
    example = hd.read_vehicle(measured_splits.EXAMPLES / "esso_osaka/vehicle.yaml")
    ours = measured_splits._vehicle("esso_osaka")
    rigid = [each.mass_matrix - each.added_mass for each in (example, ours)]
    np.testing.assert_allclose(*rigid, atol=1e-9)
    assert np.diag(ours.added_mass)[[0, 1, 5]].tolist() == [*measured_splits.LABORATORY_MASS]
