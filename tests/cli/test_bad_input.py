"""Every mistake gets a sentence and exit status 2, and nothing is written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

Call = Callable[..., Result]
COMPARE = "compare --vehicle planar.yaml --models linear,fossen --methods ls --out out"
HEADER = "time,u,v,r,ahead,turn"


def rows(n: int = 40) -> list[str]:
    return [
        f"{k / 10},{0.5 + k % 7 / 50},{k % 5 / 40},{k % 3 / 20},0.5,0.{k % 9}" for k in range(n)
    ]


def refused(folder: Path, done: Result, *words: str) -> None:
    assert done.exit_code == 2, done.output
    said = " ".join(done.stderr.split())
    assert said.startswith(("error: ", "warning: "))
    assert "Traceback" not in done.output
    for word in words:
        assert word in said
    assert done.stdout == ""
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    ("header", "fifth", "words"),
    [
        ("Time,u,v,r,ahead,turn", "", ("time",)),
        ("time,u,sway,r,ahead,turn", "", ("v not found",)),
        (HEADER, "0.5,fast,0.1,0.0,0.5,0.1", ("fast", "u")),
        (HEADER, "0.4,0.5,0.1,0.0,0.5,0.1", ("repeats", "0.4")),
        (HEADER, "0.1,0.5,0.1,0.0,0.5,0.1", ("backwards",)),
        ("time,u,v,r,ahead,trun", "", ("2 faults", "'trun': used by nothing", "turn")),
        ("time,u,v,r,ahead,uv", "", ("uv",)),
    ],
)
def test_a_faulty_log(
    folder: Path, call: Call, header: str, fifth: str, words: tuple[str, ...]
) -> None:
    body = [fifth if fifth and place == 5 else row for place, row in enumerate(rows())]
    (folder / "bad.csv").write_text("\n".join([header, *body]) + "\n", encoding="utf-8")
    refused(folder, call(f"{COMPARE} bad.csv --train 0:2 --test 2:4"), "bad.csv", *words)


def test_missing_values_split_the_log_with_a_warning(folder: Path, call: Call) -> None:
    body = rows(400)
    body[100] = "10.0,nan,0.1,0.0,0.5,0.1"
    (folder / "gap.csv").write_text("\n".join([HEADER, *body]) + "\n", encoding="utf-8")
    done = call("probe gap.csv")
    assert done.exit_code == 0
    assert "warning: gap.csv: split into 2 segments" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("train", "test", "words"),
    [
        ("0:9OO", "20:40", "must be START:END"),
        ("900:0", "20:40", "START before END"),
        ("-5:10", "20:40", "neither negative"),
        ("0:", "20:40", "such as 0:900"),
        ("0-900", "20:40", "there is no segment '0-900'"),
        ("500:900", "20:40", "500"),
        ("oen", "two", "Did you mean 'one'?"),
        ("a.csv", "two", "`--train a.csv` is a file, and LOG is given too"),
    ],
)
def test_a_part_that_is_not_there(
    folder: Path, call: Call, train: str, test: str, words: str
) -> None:
    line = f"{COMPARE} ab.csv --train {train} --test {test}"
    refused(folder, call(line), words)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("--train one --test b.csv", "`--train one` is no file, and there is no LOG"),
        ("--train none.csv --test b.csv", "none.csv"),
        ("a.csv --train 0:10", "`--test` is missing"),
        ("a.csv --test 0:10", "`--train` is missing"),
        ("none.csv --train 0:10 --test 10:20", "none.csv"),
    ],
)
def test_parts_said_wrongly(folder: Path, call: Call, line: str, words: str) -> None:
    refused(folder, call(f"{COMPARE} {line}"), words)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("--vehicle planar.yaml --models liner", "Did you mean 'linear'?"),
        ("--vehicle planar.yaml --models ,", "at least one model"),
        ("--vehicle planar.yaml --methods la", "Did you mean 'ls'?"),
        ("--vehicle planar.yaml --methods ,", "at least one method"),
        ("--vehicle vt960", "vt690"),
        ("--vehicle none.yaml", "none.yaml"),
        ("--vehicle broken.yaml", "line 2"),
        ("--vehicle planar.yaml --models broken.yaml", "line 2"),
        ("--vehicle planar.yaml --models none.yaml", "none.yaml"),
        ("--vehicle planar.yaml --mapping broken.yaml", "line 2"),
        ("--vehicle twice.yaml", "twice.yaml, line 2"),
        ("--vehicle planar.yaml --models twice.yaml", "twice.yaml, line 2"),
        ("--vehicle planar.yaml --mapping twice.yaml", "twice.yaml, line 2"),
        ("--vehicle planar.yaml --models linear,other.yaml", "two different models"),
        ("--vehicle planar.yaml --out a.csv", "a.csv is a file. Give another one."),
        ("--vehicle planar.yaml --out a.csv/out", "a.csv"),
    ],
)
def test_a_name_that_is_unknown(folder: Path, call: Call, line: str, words: str) -> None:
    (folder / "broken.yaml").write_text("name: x\n  wrong: [1,\n", encoding="utf-8")
    (folder / "twice.yaml").write_text("name: x\nname: y\n", encoding="utf-8")
    (folder / "other.yaml").write_text("{name: linear, terms: {X: u}}\n", encoding="utf-8")
    refused(folder, call(f"compare a.csv --train 0:20 --test 20:40 {line}"), words)


def test_too_few_samples_for_every_model(folder: Path, call: Call) -> None:
    done = call(f"{COMPARE} a.csv --train 0:0.2 --test 2:4".replace(",fossen", ""))
    refused(folder, done, "samples are fewer than the largest axis of every model", "needs 3")


@pytest.mark.parametrize(
    "line",
    [
        "compare a.csv --vehicle planar.yaml --attitude level",
        "compare a.csv --vehicle planar.yaml --rate-unit rpm",
        "simulate --vehicle planar.yaml --damping d.json",
        "simulate a.csv --vehicle planar.yaml",
        "demo --seed few",
        "demo --truth",
        "nonsense",
        "--nonsense",
    ],
)
def test_a_call_that_cannot_be(folder: Path, call: Call, line: str) -> None:
    done = call(line)
    assert done.exit_code == 2
    assert "Traceback" not in done.output
    assert done.stdout == ""
