"""The benchmark: a tiny campaign from end to end, taking up work, and the law of regret."""

import json
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
import typer

import benchmark
import benchmark_campaign
import benchmark_campaigns as lists
import benchmark_check
import benchmark_plans
import benchmark_tables as tables
import evidence
import expert_script
from conditions import SILENT
from hydrodamp import Log, catalog
from tables import TABLES, replace_table


@pytest.fixture(name="study")
def study_fixture(monkeypatch):
    """The command, with one campaign of 10 s and one model of 12 coefficients."""
    sail = benchmark_campaign.Sail(benchmark_plans.published, 0, 10.0)
    tiny = benchmark_campaign.Campaign("tiny", (catalog["fossen"],), sail)
    monkeypatch.setattr(benchmark, "campaigns", lambda: iter([tiny]))
    benchmark.kept.cache_clear()
    return benchmark


class Broken:
    """A method that fails."""

    key = "broken"

    def identify(self, problem, model):
        raise ZeroDivisionError("no luck")


def test_one_command_fills_the_table_and_takes_up_where_it_stopped(study, tmp_path, monkeypatch):
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


def test_a_failure_is_a_row(study, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "own", sys.modules[__name__])
    study.main(tmp_path, methods="ls,own:Broken", workers=1)
    found = {one.method: one for one in study.read_rows(tmp_path / "rows.jsonl")}
    broken = found["own:Broken"]
    assert (broken.status, broken.why) == ("raised", "ZeroDivisionError: no luck")
    assert set(broken.rms.values()) == {None}
    text = (tmp_path / "benchmark.md").read_text(encoding="utf-8")
    assert "| `own:Broken` | 1 | - | - | - | 1 |" in text
    assert "| `own:Broken` | ZeroDivisionError: no luck | 1 |" in text


def rows(**errors):
    """A row a method, on one model and campaign."""
    return [
        tables.Row("c", "m", method, "seen", {"run": error}, "ok", error is None, 1.0)
        for method, error in errors.items()
    ]


def test_regret_is_the_error_over_the_least_one():
    """At least one, one for the best, infinite for the lost; errors below 0.01 are as good."""
    found = tables.regrets(rows(a=0.2, b=0.5, c=None))
    assert {key[2]: value for key, value in found.items()} == {"a": 1.0, "b": 2.5, "c": math.inf}
    fine = tables.regrets(rows(a=1e-9, b=0.005, c=0.02))
    assert [*fine.values()] == [1.0, 1.0, 2.0]
    assert tables.regrets(rows(a=None, b=None)) == {}


def test_the_bar_is_median_share_and_worst():
    """95 of 100 within 1.3 are enough, none above 2, none lost."""
    good = [1.0] * 95 + [1.9] * 5
    assert tables.Summary.of(good).passes
    assert not tables.Summary.of([1.0] * 94 + [1.9] * 6).passes
    assert not tables.Summary.of([*good, 2.1]).passes
    assert not tables.Summary.of([*good, math.inf]).passes
    assert not tables.Summary.of([1.06] * 100).passes
    assert tables.Summary.of([1.0, math.inf]).lost == 1


def test_the_list_is_what_the_page_promises(monkeypatch):
    """At least 40 are sailed, six or more unseen; no name and no seed twice; files where named."""
    monkeypatch.delenv("HYDRODAMP_DATA", raising=False)
    found = list(lists.campaigns())
    assert len(found) == len({one.name for one in found}) >= 40
    assert sum(one.group == "unseen" for one in found) >= 6
    made = [*lists.SEEN.values(), *lists.UNSEEN.values()]
    assert len({one.seed for one in made}) == len(made)
    assert all(45.0 <= one.duration <= 600.0 for one in made)
    assert {one.rate for one in made} >= {5.0, 10.0, 20.0, 50.0}
    assert all(one.models for one in found)


@pytest.mark.parametrize(
    ("name", "change", "most"),
    [
        *((f"{name}/200s", {}, 1e-3) for name in ("sname", "sname2022", "remus", "rov")),
        ("remus-theory/120s", {}, 1e-3),
        *((f"{name}/200s", {"rate": 50.0}, 0.01) for name in ("heavy-rov", "tanker")),
    ],
)
def test_the_truth_replays_what_really_happened(name, change, most):
    """True coefficients through the package's replay; else the wrench that the motion asks for."""
    make = {**lists.SEEN, **lists.UNSEEN}[name]
    logs = replace(make, duration=8.0, conditions=SILENT, **change)()
    assert benchmark_check.exact_floor(logs) < most
    assert logs.train.velocity.std() > 0.0


def test_the_tables_of_a_page_are_replaced(study, tmp_path):
    """Between the two marks, and nowhere else; the page of the documentation has them."""
    page = tmp_path / "page.md"
    page.write_text("Before\n<!-- tables -->\nold\n<!-- end of tables -->\nafter\n", "utf-8")
    study.main(tmp_path, methods="ls", workers=1, page=page)
    text = page.read_text(encoding="utf-8")
    assert text.startswith("Before\n<!-- tables -->\n**Regret, whole runs, campaigns seen**")
    assert text.endswith("<!-- end of tables -->\nafter\n")
    assert "old" not in text
    page.write_text("No marks", encoding="utf-8")
    with pytest.raises(typer.BadParameter, match="tables"):
        replace_table(page, TABLES, text)
    ours = (evidence.PAGES / "benchmark.md").read_text(encoding="utf-8")
    assert all(ours.count(mark) == 1 for mark in TABLES)


def test_the_script_finds_a_vessel_of_its_own_form():
    """Accelerations by commands, drag and products are what it fits, whatever the masses are."""
    rng, n, period = np.random.default_rng(0), 1200, 0.1
    held = np.repeat(rng.uniform(-1.0, 1.0, (n // 20, 2)), 20, axis=0)
    velocity = np.zeros((n, 6))
    for i, (ahead, turn) in enumerate(held[:-1]):
        u, v, r = velocity[i, [0, 1, 5]]
        rate = [ahead - u * abs(u) + 0.8 * v * r, -v - 0.6 * u * r, 0.5 * turn - r]
        velocity[i + 1, [0, 1, 5]] = velocity[i, [0, 1, 5]] + period * np.array(rate)
    log = Log(period * np.arange(n), velocity, commands=held, command_names=("ahead", "turn"))
    train, test = log.between(0.0, 90.0), log.between(90.0, 120.0)
    found = expert_script.replay_script(train, test, [0, 1, 5], has_fins=False)
    error, free = found - test.velocity, [0, 1, 5]
    assert (error.std(axis=0)[free] < 0.1 * test.velocity.std(axis=0)[free]).all()
    assert not found[:, 2:5].any()
