"""Many logs in, a fit for each group out."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from batch.conftest import MODEL
from hydrodamp import errors
from hydrodamp.batch.sufficient_statistics import LogStatistics, solve_model, summarise_address
from hydrodamp.conditioning.dropouts import remove_samples
from hydrodamp.errors import GapWarning, MethodError, ProblemError
from hydrodamp.identification.regression import merge
from table_rows import rows

METHODS = {"ls": hd.LeastSquares(), "weak": hd.WeakForm()}


@pytest.mark.slow
@pytest.mark.parametrize("key", METHODS)
def test_a_group_is_identified_as_its_logs_one_after_the_other(key, fleet, season, threads):
    found = hd.batch(season, fleet.vehicle, MODEL, key, client=threads)
    assert [one.group for one in found.fits] == [(f"2026-05-0{day}",) for day in (1, 2, 3)]
    logs = sorted(season.glob("*01_dive*"))
    whole = hd.prepare(fleet.vehicle, hd.read_logs(logs), MODEL)
    if key == "ls":
        expected = METHODS[key].identify(whole, MODEL).damping.coefficients
    else:  # each log has test functions of its own
        problems = (hd.prepare(fleet.vehicle, hd.read_log(one), MODEL) for one in logs)
        triangle = merge(METHODS[key].equations.rows(one).triangle() for one in problems)
        expected = METHODS[key].solve(triangle, whole, MODEL).damping.coefficients
    first = found.fits[0]
    np.testing.assert_allclose(first.fit.damping.coefficients, expected, rtol=1e-9)
    assert (first.n_logs, first.fit.n_samples, found.failed) == (2, whole.n_samples, {})
    assert 0.0 < first.rms < 1.0
    assert len(first.grades) == MODEL.n_coefficients


@pytest.mark.slow
def test_results_are_the_same_bits_on_threads_and_processes(fleet, season, threads):
    one = hd.batch(season, fleet.vehicle, MODEL, client=threads, by=["month"])
    other = hd.batch(season, fleet.vehicle, MODEL, workers=2, by=["month"])
    both = [found.fits[0].fit.damping for found in (one, other)]
    assert both[0].coefficients.tobytes() == both[1].coefficients.tobytes()
    assert both[0].covariance.tobytes() == both[1].covariance.tobytes()
    assert one.fits[0].rms == other.fits[0].rms


@pytest.mark.slow
def test_standard_errors_are_those_of_refits_without_a_block(fleet, season):
    folded = summarise_address(str(next(season.iterdir())), fleet.vehicle, [MODEL], METHODS["ls"])

    def solve(blocks):
        return solve_model(replace(folded, blocks=blocks), fleet.vehicle, MODEL, METHODS["ls"])

    blocks, known = folded.blocks, solve(folded.blocks).uncertainty
    n = len(blocks)
    refits = [solve(blocks[:k] + blocks[k + 1 :]).damping.coefficients for k in range(n)]
    expected = np.sqrt((n - 1) / n * np.sum((refits - np.mean(refits, axis=0)) ** 2, axis=0))
    np.testing.assert_allclose(known.standard_errors, expected, rtol=1e-6)
    assert (known.degrees_of_freedom, known.n_blocks) == (n - 1, n)


def test_many_blocks_become_fewer_and_nothing_is_lost(fleet, season):
    one = summarise_address(str(next(season.iterdir())), fleet.vehicle, [MODEL], METHODS["ls"])
    many: LogStatistics = one
    for _ in range(20):
        many = many.merge(one)
    assert len(many.blocks) <= 128
    assert len(many.balanced) <= 32
    assert (many.n_logs, many.n_samples) == (21, 21 * one.n_samples)
    normal = one.triangle.r.T @ one.triangle.r
    np.testing.assert_allclose(many.triangle.r.T @ many.triangle.r, 21 * normal, rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("key", ["rls", "ridge"])
def test_other_methods_read_the_logs_of_a_group_together(key, fleet, season, threads):
    found = hd.batch(season, fleet.vehicle, MODEL, key, client=threads, by=["month"])
    logs = hd.read_logs(sorted(season.iterdir()))
    expected = hd.identify(MODEL, fleet.vehicle, logs, hd.find_method(key))
    (one,) = found.fits
    assert one.fit.damping.coefficients.tolist() == expected.damping.coefficients.tolist()
    assert one.n_logs == 6


@pytest.mark.slow
def test_a_fifth_more_drag_is_found_and_dated(fleet, tmp_path, threads):
    logs = fleet.season(tmp_path / "logs", days=10, fouled=6)
    found = hd.batch(logs, fleet.vehicle, MODEL, client=threads)
    (changes,) = found.changes.values()
    assert {found.fits[one.first].group for one in changes} == {("2026-05-07",)}
    drag = next(one for one in changes if one.label == "X_u|u|")
    assert drag.relative_change == pytest.approx(0.2, abs=0.03)


@pytest.mark.slow
def test_a_log_is_folded_once(fleet, season, tmp_path, threads):
    def again(*models, by="day"):
        return hd.batch(
            season, fleet.vehicle, models, client=threads, cache=tmp_path / "statistics", by=[by]
        )

    first, second = again(MODEL), again(MODEL)
    assert (first.n_cached, second.n_cached) == (0, 6)
    for one, other in zip(first.fits, second.fits, strict=True):
        assert one.fit.damping.coefficients.tolist() == other.fit.damping.coefficients.tolist()
    fewer = hd.DampingModel.from_table({"X": "u|u|", "N": "ur uv r|r|"}, key="fewer")
    found = again(fewer, by="month")
    assert found.n_cached == 6
    expected = hd.batch(season, fleet.vehicle, fewer, client=threads, by=["month"])
    np.testing.assert_allclose(
        found.fits[0].fit.damping.coefficients, expected.fits[0].fit.damping.coefficients, rtol=1e-9
    )
    assert again(hd.catalog["linear"]).n_cached == 0  # terms that no fold has


@pytest.mark.slow
def test_groups_are_what_is_asked_for(fleet, season, threads):
    def groups(*by):
        found = hd.batch(season, fleet.vehicle, MODEL, client=threads, by=by)
        return [one.group for one in found.fits], found.changes

    assert groups("vehicle", "month")[0] == [("vt690", "2026-05")]
    assert groups("folder") == ([("logs",)], {})
    assert groups(r"dive(\d)")[0] == [("0",), ("1",)]


@pytest.mark.slow
def test_logs_of_several_vehicles_are_told_apart_by_their_paths(
    fleet, season, tmp_path, threads, refused
):
    light = replace(fleet.vehicle, name="ray")
    heavy = replace(light, name="ray-heavy", mass_matrix=2.0 * light.mass_matrix)
    for name in ("ray", "ray-heavy", "skate"):
        (tmp_path / name).mkdir()
        for log in season.glob("*dive0*"):
            (tmp_path / name / log.name).write_bytes(log.read_bytes())
    asked = {"client": threads, "by": ["vehicle", "month"]}
    found = hd.batch(tmp_path, [light, heavy], MODEL, **asked)
    assert [*found.time_series] == ["prestero ray", "prestero ray-heavy"]
    for both, craft in zip(found.fits, (light, heavy), strict=True):
        (alone,) = hd.batch(tmp_path / craft.name, craft, MODEL, **asked).fits
        assert both.n_logs == alone.n_logs == 3
        assert both.fit.damping.coefficients.tolist() == alone.fit.damping.coefficients.tolist()
    assert len(found.failed) == 3
    assert all("none of ray, ray-heavy" in why for why in found.failed.values())
    refused(MethodError, hd.batch, tmp_path, [light, heavy], MODEL, client=threads)
    refused(MethodError, hd.batch, tmp_path, [light, light], MODEL, **asked)


@pytest.mark.slow
@pytest.mark.parametrize("value", [1e160, 1e120])
def test_a_wild_command_costs_its_sample_alone(value, fleet, tmp_path, threads):
    """1e160 overflows in equation 1 of the log, 1e120 would in the covariance of its group."""
    logs = fleet.season(tmp_path / "logs", days=2)
    wild = fleet.dive(7)
    path, sample = logs / "2026-05-02_wild.csv", np.arange(wild.n) == 100
    hd.write_log(remove_samples(wild, {"rpm": sample}, "wild", 0.0), path)
    expected = hd.batch(logs, fleet.vehicle, MODEL, client=threads)
    commands = wild.commands.copy()
    commands[100, wild.command_names.index("rpm")] = value
    hd.write_log(replace(wild, commands=commands), path)
    found = hd.batch(logs, fleet.vehicle, MODEL, client=threads)
    assert ([one.n_logs for one in found.fits], found.failed) == ([2, 3], {})
    for one, other in zip(found.fits, expected.fits, strict=True):
        assert one.fit.damping.coefficients.tolist() == other.fit.damping.coefficients.tolist()
    (message,) = found.outliers
    assert "2026-05-02_wild.csv: `rpm`: 1 implausible sample" in message
    assert f"{value:.6g} at {wild.time[100] - wild.time[0]:.2f} s" in message


def with_wild_command(log):
    """Return a log with one wild command."""
    commands = log.commands.copy()
    commands[100, log.command_names.index("rpm")] = 1e6
    return replace(log, commands=commands)


@pytest.mark.slow
def test_outliers_from_the_cache_name_the_file_of_now(fleet, tmp_path, threads):
    first, renamed = tmp_path / "logs" / "2026-05-01.csv", tmp_path / "logs" / "2026-05-02.csv"
    first.parent.mkdir()
    hd.write_log(with_wild_command(fleet.dive(1)), first)
    options = {"client": threads, "cache": tmp_path / "statistics"}
    (before,) = hd.batch(first.parent, fleet.vehicle, MODEL, **options).outliers
    first.rename(renamed)
    found = hd.batch(first.parent, fleet.vehicle, MODEL, **options)
    assert found.n_cached == 1
    assert before.startswith(f"{first}: `rpm`: 1 implausible sample")
    assert found.outliers == (before.replace(str(first), str(renamed)),)


@pytest.mark.slow
def test_methods_without_statistics_report_the_outliers_that_they_leave_out(
    fleet, tmp_path, threads
):
    """A yaw term is of no use for a vehicle without yaw, so its command may be wild."""
    logs = [with_wild_command(fleet.dive(1)), fleet.dive(2)]
    for number, log in enumerate(logs):
        pilot = np.where(np.arange(log.n) == 50, 1e9, 1.0)
        commands, names = np.column_stack([log.commands, pilot]), (*log.command_names, "pilot")
        log = replace(log, commands=commands, command_names=names)
        hd.write_log(log, tmp_path / f"2026-05-01_{number}.csv")
    vehicle = replace(fleet.vehicle, axes=("X", "Y", "Z", "K", "M"))
    model = MODEL.with_terms({"N": "pilot"})
    found = hd.batch(tmp_path, vehicle, model, hd.RecursiveLeastSquares(), client=threads)
    assert not found.failed
    (message,) = found.outliers
    assert "2026-05-01_0.csv" in message
    assert "`rpm`: 1 implausible sample" in message


@pytest.mark.slow
def test_equal_logs_of_a_group_count_once(fleet, tmp_path, threads):
    hd.write_log(fleet.dive(1), tmp_path / "2026-05-01.csv")
    (tmp_path / "copy_2026-05-01.csv").write_bytes((tmp_path / "2026-05-01.csv").read_bytes())
    found = hd.batch(tmp_path, fleet.vehicle, MODEL, client=threads)
    assert [one.n_logs for one in found.fits] == [1]
    assert found.duplicates == {
        str(tmp_path / "copy_2026-05-01.csv"): str(tmp_path / "2026-05-01.csv")
    }


@pytest.mark.slow
def test_warnings_are_as_before_after_a_season_on_threads(fleet, season, threads):
    before = [*warnings.filters]
    hd.batch(season, fleet.vehicle, MODEL, client=threads)
    assert warnings.filters == before
    log = fleet.dive(1)
    path = season.parent / "gap.csv"
    hd.write_log(replace(log, time=log.time + 100.0 * (log.time > log.time[log.n // 2])), path)
    found = hd.batch(path, fleet.vehicle, MODEL, client=threads, by=["folder"])
    assert not found.failed  # the gap is no error, though warnings are
    with pytest.warns(GapWarning):
        hd.read_log(path)


@pytest.mark.slow
def test_what_cannot_be_used_is_named_with_its_reason(fleet, season, tmp_path, threads, refused):
    (tmp_path / "2026-05-09.csv").write_text("time,u\n0,fast\n", "utf-8")
    hd.write_log(fleet.dive(1), tmp_path / "undated.csv")
    found = hd.batch([season, tmp_path], fleet.vehicle, MODEL, client=threads)
    assert {place.rpartition("/")[2] for place in found.failed} == {"2026-05-09.csv", "undated.csv"}
    reasons = " ".join(found.failed.values())
    assert "fast" in reasons
    assert "neither its clock nor its path has a date" in reasons
    assert len(found.fits) == 3
    refused(ProblemError, hd.batch, tmp_path, fleet.vehicle, MODEL, client=threads)


@rows(("error", "more"))
def test_a_wrong_call_is_refused_before_work(error, more, fleet, season, refused):
    given = {"logs": season, "vehicle": fleet.vehicle, "models": MODEL, **more}
    refused(getattr(errors, error), hd.batch, **given)
