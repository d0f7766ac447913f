"""The benchmark: a tiny campaign from end to end, taking up work, and the law of regret."""

from __future__ import annotations

import importlib
import json
import math
from pathlib import Path
from types import ModuleType

import pytest

from hydrodamp import catalog

STUDIES = Path(__file__).parents[2] / "studies"


@pytest.fixture(name="study")
def study_fixture(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The command, with one campaign of 20 s and one model of 12 coefficients."""
    monkeypatch.syspath_prepend(STUDIES)
    study = importlib.import_module("benchmark")
    sea = importlib.import_module("benchmark_campaigns")
    tiny = sea.Campaign("tiny", (catalog["fossen"],), sea.Sail("sname", 0, 20.0))
    monkeypatch.setattr(study, "campaigns", lambda: iter([tiny]))
    study.kept.cache_clear()
    return study


@pytest.fixture(name="tables")
def tables_fixture(study: ModuleType) -> ModuleType:
    assert study
    return importlib.import_module("benchmark_tables")


class Broken:
    """A method that fails."""

    key = "broken"

    def identify(self, problem: object, model: object) -> None:
        raise ZeroDivisionError("no luck")


def test_one_command_fills_the_table_and_takes_up_where_it_stopped(
    study: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rows that are there stay as they are; one cut short, and new ones, are made."""
    study.main(tmp_path, methods="ls,weak", workers=1)
    path = tmp_path / "rows.jsonl"
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [json.loads(line)["method"] for line in lines] == ["ls", "weak"]
    assert all(set(json.loads(line)["rms"]) == {"1 s", "10 s", "run"} for line in lines)
    path.write_text(f"{lines[0]}\n{lines[1][:30]}", encoding="utf-8")
    made = []
    row = study.row
    monkeypatch.setattr(study, "row", lambda job: made.append(job) or row(job))
    study.main(tmp_path, methods="ls,weak", workers=1)
    assert made == [("tiny", "fossen", "weak")]
    assert len(study.read_rows(path)) == 2
    study.main(tmp_path, methods="ls,weak", workers=1, again=True)
    assert len(made) == 3
    text = (tmp_path / "benchmark.md").read_text(encoding="utf-8")
    assert "| `ls` | 1 |" in text
    assert "| tiny |" in text


def test_a_failure_is_a_row(
    study: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(importlib.sys.modules, "own", importlib.import_module(__name__))
    study.main(tmp_path, methods="ls,own:Broken", workers=1)
    found = {one.method: one for one in study.read_rows(tmp_path / "rows.jsonl")}
    broken = found["own:Broken"]
    assert (broken.status, broken.why) == ("raised", "ZeroDivisionError: no luck")
    assert set(broken.rms.values()) == {None}
    text = (tmp_path / "benchmark.md").read_text(encoding="utf-8")
    assert "| `own:Broken` | 1 | - | - | - | 1 |" in text


def test_an_unknown_method_ends_the_work_before_it_begins(
    study: ModuleType, tmp_path: Path
) -> None:
    with pytest.raises(study.hd.MethodError, match="unknown method 'weka'"):
        study.main(tmp_path / "none", methods="weka", workers=1)
    assert not (tmp_path / "none").exists()


def rows(tables: ModuleType, **errors: float | None) -> list[object]:
    """A row a method, on one model and campaign."""
    return [
        tables.Row("c", "m", method, "seen", {"run": error}, "ok", error is None, 1.0)
        for method, error in errors.items()
    ]


def test_regret_is_the_error_over_the_least_one(tables: ModuleType) -> None:
    """At least one, one for the best, infinite for the lost; errors below 0.01 are as good."""
    found = tables.regrets(rows(tables, a=0.2, b=0.5, c=None))
    assert {key[2]: value for key, value in found.items()} == {"a": 1.0, "b": 2.5, "c": math.inf}
    fine = tables.regrets(rows(tables, a=1e-9, b=0.005, c=0.02))
    assert [*fine.values()] == [1.0, 1.0, 2.0]
    assert tables.regrets(rows(tables, a=None, b=None)) == {}


def test_the_bar_is_median_share_and_worst(tables: ModuleType) -> None:
    """95 of 100 within 1.3 are enough, none above 2, none lost."""
    good = [1.0] * 95 + [1.9] * 5
    assert tables.Summary.of(good).passes
    assert not tables.Summary.of([1.0] * 94 + [1.9] * 6).passes
    assert not tables.Summary.of([*good, 2.1]).passes
    assert not tables.Summary.of([*good, math.inf]).passes
    assert not tables.Summary.of([1.06] * 100).passes
    assert tables.Summary.of([1.0, math.inf]).lost == 1
