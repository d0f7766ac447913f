from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hydrodamp.report.unfinished import read_earlier

from hydrodamp.errors import FileError
from hydrodamp.models.files import read_damping
from hydrodamp.report.comparison_grids import row_grid
from hydrodamp.report.document import comparison_document
from hydrodamp.report.files import read_comparison, row_names, write_comparison
from hydrodamp.validation.comparison import Comparison


def test_all_files_are_there_and_none_is_left_over(comparison: Comparison, tmp_path: Path) -> None:
    write_comparison(comparison, tmp_path / "deep" / "out")
    names = sorted(path.name for path in (tmp_path / "deep" / "out").iterdir())
    assert names == [
        *("comparison.json", "fits", "replays.npz"),
        *("table.csv", "table.md", "table.tex", "table.txt"),
    ]
    fits = sorted(path.stem for path in (tmp_path / "deep" / "out" / "fits").iterdir())
    assert fits == sorted(row_names(comparison))


def test_the_json_is_strict_and_as_designed(comparison: Comparison, tmp_path: Path) -> None:
    write_comparison(comparison, tmp_path)

    def refuse(word: str) -> None:
        pytest.fail(f"{word} is not strict JSON")

    text = (tmp_path / "comparison.json").read_text("utf-8")
    document = json.loads(text, parse_constant=refuse)
    assert set(document) == {"rows", "units", "provenance"}
    first, second = document["rows"][:2]
    assert first["coefficients"]["X_u"] == -1.0
    assert first["rms"] == 0.46
    assert first["status"] == "ok"
    assert first["diverged_at"] is None
    assert second["rms"] is None
    assert set(second["rms_by_axis"].values()) == {None}
    assert second["diverged_at"] == [
        {"segment": "dive", "time": 12.34},
        {"segment": "turn", "time": 0.1},
    ]
    assert set(document["rows"][3]["coefficients"].values()) == {None}


def test_a_comparison_reads_back_as_it_was(comparison: Comparison, tmp_path: Path) -> None:
    write_comparison(comparison, tmp_path)
    again = read_comparison(tmp_path)
    assert comparison_document(again) == comparison_document(comparison)
    assert row_grid(again) == row_grid(comparison)
    assert again.provenance == comparison.provenance
    for before, after in zip(comparison.rows, again.rows, strict=True):
        assert after.fit.status is before.fit.status
        assert after.fit.aliased == before.fit.aliased
        assert after.fit.provenance == before.fit.provenance
        assert (after.trajectory is None) is (before.trajectory is None)
        if before.trajectory is not None and after.trajectory is not None:
            np.testing.assert_array_equal(after.trajectory.velocity, before.trajectory.velocity)
            np.testing.assert_array_equal(after.trajectory.log.time, before.trajectory.log.time)
            assert after.trajectory.log.segments == before.trajectory.log.segments


def test_fits_of_an_earlier_comparison_are_removed_and_no_others(
    comparison: Comparison, tmp_path: Path
) -> None:
    write_comparison(comparison, tmp_path)
    mine = tmp_path / "fits" / "mine.json"
    mine.write_text("{}", "utf-8")
    write_comparison(Comparison(comparison.rows[:1]), tmp_path)
    left = sorted(path.name for path in (tmp_path / "fits").iterdir())
    assert left == ["linear.ls.json", "mine.json"]


@pytest.mark.parametrize("content", [None, "{", "[]", '{"rows": [{"model": "../x"}]}'])
def test_in_a_folder_of_others_nothing_is_removed(
    comparison: Comparison, tmp_path: Path, content: str | None
) -> None:
    (tmp_path / "fits").mkdir()
    (tmp_path / "fits" / "coe.ls.json").write_text("{}", "utf-8")
    if content is not None:
        (tmp_path / "comparison.json").write_text(content, "utf-8")
    write_comparison(Comparison(comparison.rows[:1]), tmp_path)
    assert (tmp_path / "fits" / "coe.ls.json").read_text("utf-8") == "{}"


def test_a_name_that_leaves_the_folder_is_not_followed(
    comparison: Comparison, tmp_path: Path
) -> None:
    (tmp_path / "x.ls.json").write_text("{}", "utf-8")
    rows = '{"rows": [{"model": "../x", "method": "ls"}]}'
    (tmp_path / "comparison.json").write_text(rows, "utf-8")
    write_comparison(Comparison(comparison.rows[:1]), tmp_path)
    assert (tmp_path / "x.ls.json").exists()


@pytest.mark.parametrize("name", ["../x", "/x", "a\\x", "a\0x"])
def test_a_comparison_that_names_files_elsewhere_is_refused(
    comparison: Comparison, tmp_path: Path, name: str
) -> None:
    write_comparison(comparison, tmp_path)
    path = tmp_path / "comparison.json"
    document = json.loads(path.read_text("utf-8"))
    document["rows"][0]["model"] = name
    path.write_text(json.dumps(document), "utf-8")
    with pytest.raises(FileError, match="plain file name"):
        read_comparison(tmp_path)
    with pytest.raises(FileError, match="plain file name"):
        read_earlier(tmp_path).fits()


def test_times_are_without_the_rounding_of_clocks(comparison: Comparison, tmp_path: Path) -> None:
    score = replace(comparison.rows[1].score, diverged=(("dive", 0.1 + 0.2),))
    document = comparison_document(Comparison((replace(comparison.rows[1], score=score),)))
    assert '"time": 0.3}' in json.dumps(document)


def test_each_fit_is_a_damping_file(comparison: Comparison, tmp_path: Path) -> None:
    write_comparison(comparison, tmp_path)
    damping = read_damping(tmp_path / "fits" / "linear.ls.json")
    assert damping.covariance is not None
    assert damping.covariance[1, 1] == 2.0
    assert damping.vehicle == comparison.rows[0].fit.damping.vehicle


def test_a_pair_that_comes_twice_keeps_both(comparison: Comparison, tmp_path: Path) -> None:
    twice = Comparison((comparison.rows[0], comparison.rows[0]), provenance={})
    assert row_names(twice) == ("linear.ls", "linear.ls-2")
    write_comparison(twice, tmp_path)
    assert len(read_comparison(tmp_path).rows) == 2


def test_without_replays_there_are_no_trajectories(comparison: Comparison, tmp_path: Path) -> None:
    write_comparison(Comparison(comparison.rows[3:4]), tmp_path)
    assert read_comparison(tmp_path).rows[0].trajectory is None


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("comparison.json", None, "cannot be read"),
        ("comparison.json", "{", "line 1: cannot be read as JSON"),
        ("comparison.json", "[]", "must hold one object"),
        ("comparison.json", "{}", "is no comparison"),
        ("replays.npz", None, "cannot be read"),
        ("replays.npz", "text", "cannot be read"),
        ("fits/linear.ls.json", None, "cannot be read"),
    ],
)
def test_a_spoilt_folder_is_refused(
    comparison: Comparison, tmp_path: Path, name: str, content: str | None, words: str
) -> None:
    write_comparison(comparison, tmp_path)
    (tmp_path / name).unlink()
    if content is not None:
        (tmp_path / name).write_text(content, "utf-8")
    with pytest.raises(FileError, match=words):
        read_comparison(tmp_path)


def test_a_damping_file_without_a_fit_is_refused(comparison: Comparison, tmp_path: Path) -> None:
    write_comparison(comparison, tmp_path)
    path = tmp_path / "fits" / "linear.ls.json"
    document = json.loads(path.read_text("utf-8"))
    del document["fit"]
    path.write_text(json.dumps(document), "utf-8")
    with pytest.raises(FileError, match="`fit` is missing"):
        read_comparison(tmp_path)


def test_a_folder_that_cannot_be_made(comparison: Comparison, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", "utf-8")
    with pytest.raises(FileError, match="cannot be made"):
        write_comparison(comparison, tmp_path / "file")
