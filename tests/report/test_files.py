import json
from dataclasses import fields, replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import FileError
from hydrodamp.identification.adequacy import Adequacy, ScoreTest
from hydrodamp.identification.fit_files import read_finished_fits, read_fit, write_fit
from hydrodamp.identification.parameters import Estimate
from hydrodamp.kernels.kalman import Noise
from hydrodamp.report.documents import comparison_document
from hydrodamp.simulation.replay import HorizonScore
from hydrodamp.validation.compare import replayed_row
from table_rows import rows


def test_all_files_are_there_and_none_is_left_over(comparison, tmp_path):
    hd.write_comparison(comparison, tmp_path / "deep" / "out")
    names = sorted(path.name for path in (tmp_path / "deep" / "out").iterdir())
    assert names == [
        *(".hydrodamp.json", "comparison.json", "damping.json", "fits", "replays.npz"),
        *("table.csv", "table.md", "table.tex"),
    ]
    fits = sorted(path.stem for path in (tmp_path / "deep" / "out" / "fits").iterdir())
    assert fits == sorted(f"{row.model}.{row.method}" for row in comparison.rows)


def test_the_json_is_strict_and_as_designed(comparison, tmp_path, snapshot):
    hd.write_comparison(comparison, tmp_path)

    def refuse(word):
        pytest.fail(f"{word} is not strict JSON")

    text = (tmp_path / "comparison.json").read_text("utf-8")
    document = json.loads(text, parse_constant=refuse)
    assert set(document) == {"format", "version", "verdict", "rows", "units", "provenance"}
    assert document["verdict"]["model"] == "linear"
    assert document["rows"][0]["coefficients"]["X_u"] == -1.0
    kept = "rms", "rms_by_axis", "status", "diverged_at"
    assert [[row[key] for key in kept] for row in document["rows"][:2]] == snapshot
    assert set(document["rows"][3]["coefficients"].values()) == {None}


def test_a_comparison_reads_back_as_it_was(comparison, tmp_path):
    first, *others = comparison.rows
    windows = HorizonScore(10.0, replace(first.score, rms_by_segment={}), 6, 1)
    rows = (replace(first, windows=windows), *others)  # with the errors of their replays
    rows = tuple(replayed_row(row.fit, row.score, row.trajectory, row.windows) for row in rows)
    comparison = replace(comparison, rows=rows)
    hd.write_comparison(comparison, tmp_path)
    again = hd.read_comparison(tmp_path)
    assert comparison_document(again) == comparison_document(comparison)
    assert {**again.provenance, **comparison.provenance} == again.provenance
    assert set(again.provenance) - set(comparison.provenance) == {"hydrodamp"}
    assert again.rows[0].windows == windows
    for before, after in zip(comparison.rows, again.rows, strict=True):
        assert after.fit.status is before.fit.status
        assert after.fit.aliased == before.fit.aliased
        assert after.fit.provenance == before.fit.provenance
        assert (after.trajectory is None) is (before.trajectory is None)
        if before.trajectory is not None and after.trajectory is not None:
            np.testing.assert_array_equal(after.trajectory.velocity, before.trajectory.velocity)
            np.testing.assert_array_equal(after.trajectory.log.time, before.trajectory.log.time)
            assert after.trajectory.log.segments == before.trajectory.log.segments


@pytest.mark.parametrize(("words", "left"), [({}, 1), ({"unfinished": "1 of 7 rows"}, 7)])
def test_fits_of_an_earlier_run_stay_until_one_is_finished(comparison, tmp_path, words, left):
    hd.write_comparison(comparison, tmp_path)
    hd.write_comparison(hd.Comparison(comparison.rows[:1], provenance=words), tmp_path)
    assert len([*(tmp_path / "fits").iterdir()]) == left
    assert len(hd.read_comparison(tmp_path).rows) == 1


def test_a_fit_is_kept_under_its_digest_and_reads_back(comparison, tmp_path):
    fit = replace(comparison.rows[0].fit, provenance={"digest": 64 * "a"})
    write_fit(fit, tmp_path)
    assert not read_finished_fits(tmp_path, {("linear", "ls"): 64 * "b"})
    path = tmp_path / "fits" / "linear.ls.aaaaaaaa.json"
    assert hd.read_damping(path).vehicle == fit.damping.vehicle
    (again,) = read_finished_fits(tmp_path, {("linear", "ls"): 64 * "a"}).values()
    np.testing.assert_array_equal(again.damping.coefficients, fit.damping.coefficients)
    assert (again.status, again.rank, again.provenance) == (fit.status, fit.rank, fit.provenance)


def test_what_intervals_are_made_with_reads_back(comparison, tmp_path):
    row = comparison.rows[0]
    covariance = row.fit.damping.covariance
    unknown = np.full_like(covariance, np.nan)
    for freedom, noise in ((5.0, 0.5 * covariance), (np.inf, None), (3.0, unknown)):
        found = hd.Uncertainty(covariance, freedom, "by hand", noise, 2.0, 7, "shifts")
        known = replace(row, fit=replace(row.fit, uncertainty=found))
        hd.write_comparison(hd.Comparison((known,)), tmp_path)
        again = hd.read_comparison(tmp_path).rows[0].fit.uncertainty
        assert again is not None
        assert (again.noise is None) is (noise is None)
        assert again.critical_value() == found.critical_value()
        assert str(again) == str(found)
        np.testing.assert_array_equal(again.standard_errors, found.standard_errors)


def test_a_pair_that_comes_twice_keeps_both(comparison, tmp_path):
    twice = hd.Comparison((comparison.rows[0], comparison.rows[0]), provenance={})
    hd.write_comparison(twice, tmp_path)
    assert {path.stem for path in (tmp_path / "fits").iterdir()} == {"linear.ls", "linear.ls-2"}
    assert len(hd.read_comparison(tmp_path).rows) == 2


@rows(("name", "place", "value"))
def test_a_spoilt_folder_is_refused_with_the_place(
    comparison, tmp_path, name, place, value, refused
):
    """The value is the content of a file, or what is at a place of its document."""
    hd.write_comparison(comparison, tmp_path)
    path = tmp_path / name
    if place is not None:
        content = document = json.loads(path.read_text("utf-8"))
        *outer, last = place
        for key in outer:
            content = content[key]
        content[last], value = value, document
    path.unlink()
    if value is not None:
        path.write_text(value if isinstance(value, str) else json.dumps(value), "utf-8")
    refused(FileError, hd.read_comparison, tmp_path)


def test_a_fit_says_the_same_after_it_is_saved(comparison, tmp_path):
    """Every attribute of a fit is in its file."""
    row = comparison.rows[0]
    labels, held = row.fit.model.labels, Estimate(9.0, 0.5, 12.0, "kg", "Wide.").hold_at_prior()
    rows = np.append(np.linspace(-0.1, 0.1, len(labels)), 0.01)[None]
    tests = {"K": ScoreTest(210.0, 10, 2000, ("K_p|u|",))}
    fit = replace(
        row.fit,
        status=hd.Status.RANK_DEFICIENT,
        rank=1,
        aliased=(labels[:2],),
        n_samples=9,
        remarks=("A remark.",),
        uncertainty=hd.Uncertainty(row.fit.damping.covariance, 5.0, "by hand"),
        training_range={"u": (-1.0, 1.0)},
        grades=dict.fromkeys(labels, hd.Grade.WEAK),
        vehicle=hd.fleet["vt690"],
        estimates={"A_N": Estimate(14.2, 0.1, 12.0, "kg"), "A_X": held},
        parameter_covariance=rows,
        indirect=labels[:1],
        held_out_r_squared={"X": 0.5},
        form_errors={"X": (0.1, 3.0, 0.2)},
        adequacy=Adequacy.judge(tests, {"X": 0.01}, {"X": 0.5}),
        command_range={"rudder": (-0.3, 0.2)},
        unconverged=("N",),
        noise=Noise(np.ones(6), np.full(6, 0.01), np.full(6, 0.3), 2.0, 0.1),
    )
    hd.write_comparison(hd.Comparison((replace(row, fit=fit),)), tmp_path)
    again = hd.read_comparison(tmp_path).rows[0].fit
    assert str(again) == str(fit)
    assert again.joint_labels == (*labels, "A_N")
    np.testing.assert_array_equal(again.joint_covariance, fit.joint_covariance)
    np.testing.assert_array_equal(fit.joint_covariance[-1:], rows)
    assert again.noise.push.tolist() == fit.noise.push.tolist()
    for name in {each.name for each in fields(fit)} - {
        *("damping", "uncertainty", "parameter_covariance", "noise")
    }:
        assert getattr(fit, name), name
        assert getattr(again, name) == getattr(fit, name), name


def test_a_file_without_the_covariance_of_parameters_reads_back(comparison, tmp_path, refused):
    fit = comparison.rows[0].fit
    write_fit(fit, tmp_path)
    (path,) = (tmp_path / "fits").iterdir()
    document = json.loads(path.read_text("utf-8"))
    assert document["fit"].pop("parameter_covariance") is None
    path.write_text(json.dumps(document), "utf-8")
    assert np.array_equal(read_fit(path).joint_covariance, fit.damping.covariance)
    document["fit"]["parameter_covariance"] = [[1.0, 2.0]]
    path.write_text(json.dumps(document), "utf-8")
    refused(hd.HydrodampError, read_fit, path)
