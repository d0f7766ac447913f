"""Every mistake gets a sentence and exit status 2, and nothing is written."""

import pytest

COMPARE = "compare --vehicle planar.yaml --models linear,fossen --methods ls --out out"
HEADER = "time,u,v,r,ahead,turn"


def rows(n=40):
    return [
        f"{k / 10},{0.5 + k % 7 / 50},{k % 5 / 40},{k % 3 / 20},0.5,0.{k % 9}" for k in range(n)
    ]


def refused(folder, done, *words):
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
        ("time,u,v,r,ahead,trun", "", ("no command 'turn'", "Did you mean 'trun'?")),
    ],
)
def test_a_faulty_log(folder, call, header, fifth, words):
    body = [fifth if fifth and place == 5 else row for place, row in enumerate(rows())]
    (folder / "bad.csv").write_text("\n".join([header, *body]) + "\n", encoding="utf-8")
    refused(folder, call(f"{COMPARE} bad.csv --train 0:2 --test 2:4", 2), "bad.csv", *words)


@pytest.mark.parametrize(
    ("train", "test", "words"),
    [
        ("0:9OO", "20:40", "must be START:END"),
        ("900:0", "20:40", "START:END"),
        ("0-900", "20:40", "there is no segment '0-900'"),
        ("oen", "two", "Did you mean 'one'?"),
        ("a.csv", "two", "is a file"),
    ],
)
def test_a_part_that_is_not_there(folder, call, train, test, words):
    line = f"{COMPARE} ab.csv --train {train} --test {test}"
    refused(folder, call(line, 2), words)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("--train one --test b.csv", "one: "),
        ("a.csv --test 0:10", "`--train` is missing"),
        ("none.csv --train 0:10 --test 10:20", "none.csv"),
    ],
)
def test_parts_said_wrongly(folder, call, line, words):
    refused(folder, call(f"{COMPARE} {line}", 2), words)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("--vehicle planar.yaml --models liner", "Did you mean 'linear'?"),
        ("--vehicle planar.yaml --models ,", "at least one model"),
        ("--vehicle planar.yaml --methods la", "Did you mean 'ls'?"),
        ("--vehicle planar.yaml --methods ,", "at least one method"),
        ("--vehicle vt960", "vt690"),
        ("--vehicle broken.yaml", "line 2"),
        ("--vehicle planar.yaml --models none.yaml", "none.yaml"),
        ("--vehicle planar.yaml --models broken.yaml", "line 2"),
        ("--vehicle planar.yaml --mapping broken.yaml", "line 2"),
        ("--vehicle planar.yaml --mapping planar", "Did you mean 'planar.yaml'?"),
        ("--vehicle planar.yaml --models linear,other.yaml", "two different models"),
        ("--vehicle planar.yaml --out a.csv", "a.csv is a file. Give another one."),
    ],
)
def test_a_name_that_is_unknown(folder, call, line, words):
    (folder / "broken.yaml").write_text("name: x\n  wrong: [1,\n", encoding="utf-8")
    (folder / "other.yaml").write_text("{name: linear, terms: {X: u}}\n", encoding="utf-8")
    refused(folder, call(f"compare a.csv --train 0:20 --test 20:40 {line}", 2), words)


def test_too_few_samples_for_every_model(folder, call):
    done = call(f"{COMPARE} a.csv --train 0:0.2 --test 2:4".replace(",fossen", ""), 2)
    refused(folder, done, "samples are fewer than the terms of an axis", "needs 3")


def test_a_vehicle_of_no_size_is_refused(folder, call):
    line = "vehicle new x.yaml --length 1e308 --diameter 1e308 --mass 1e308"
    refused(folder, call(line, 2), "`--length` must be positive and at most 1e+30")


@pytest.mark.parametrize("method", ["weak", "oe", "recommended", "rls", "ai"])
def test_a_log_without_motion_is_refused(folder, call, method):
    lines = [f"{0.1 * k},0,0,0,0,0" for k in range(100)]
    (folder / "still.csv").write_text("\n".join([HEADER, *lines]) + "\n", encoding="utf-8")
    line = "identify still.csv --vehicle planar.yaml --model linear --out d.json"
    done = call(f"{line} --method {method}", 1)
    assert "all velocities of the log are zero" in " ".join(done.stderr.split())
    assert not (folder / "d.json").exists()


@pytest.mark.parametrize("step", ["1e8", "1e300"])
def test_a_clock_that_is_not_in_seconds_is_refused(folder, call, step):
    lines = [f"{k * float(step)!r},{k % 7},0,0,0,0" for k in range(50)]
    (folder / "ns.csv").write_text("\n".join([HEADER, *lines]) + "\n", encoding="utf-8")
    line = "identify ns.csv --vehicle planar.yaml --model linear --method ls --out d.json"
    refused(folder, call(line, 2), "`time` must be in seconds; its median step is")
