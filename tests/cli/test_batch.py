"""`hydrodamp batch`: the table, what lies in the folder, and what could not be used."""

import csv
import json
import shutil

import pytest

import hydrodamp as hd

LINE = (
    "batch {} --vehicle planar.yaml --model linear --method ls --group-by {} --out season "
    "--workers 1"
)


def write(folder, name, log="a.csv"):
    hd.write_log(hd.read_log(log), folder / name)


@pytest.mark.slow
def test_a_season_makes_a_table_fits_and_a_picture(folder, call):
    (folder / "logs").mkdir()
    for day in (1, 2):
        write(folder, f"logs/2026-05-0{day}_dive.csv")
        write(folder, f"logs/2026-05-0{day}_other.csv", "b.csv")
    done = call(LINE.format("logs", "day"))
    assert ["2026-05-02", "linear", "2"] in [row.split()[:3] for row in done.stdout.splitlines()]
    assert done.stdout.startswith("Verdict: linear: a change point needs 5 groups")
    assert "4 logs in 2 groups, 0 omitted. Identified by `ls`, which" in done.stdout
    assert "this series has 2." in " ".join(done.stdout.split())
    with (folder / "season" / "coefficients.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["day"] for row in rows} == {"2026-05-01", "2026-05-02"}
    assert float(rows[0]["low_noise_only"]) < float(rows[0]["value"])
    assert float(rows[0]["value"]) < float(rows[0]["high_noise_only"])
    found = sorted(path.name for path in (folder / "season").iterdir())
    tables = ["coefficients.csv", "coefficients.parquet"]
    assert found == [".hydrodamp.json", "batch.html", *tables, "fits", "linear.svg", "statistics"]
    page = (folder / "season" / "batch.html").read_text("utf-8")
    assert "4 logs in 2 groups, 0 omitted." in page
    made = folder / "season" / "fits" / "2026-05-01.linear.json"
    assert hd.read_damping(made)["X_u"] == float(rows[0]["value"])
    done = call(LINE.format("logs", "month") + " --force")
    assert "read from the cache: 2" in done.stderr  # each day has the same two
    assert "2026-05-02_dive.csv is a duplicate of logs/2026-05-01_dive.csv" in done.stderr


@pytest.mark.slow
def test_logs_that_fail_are_named_and_the_table_is_made(folder, call):
    write(folder, "dive-2026-05-01.csv")
    (folder / "dive-2026-05-02.csv").write_text("", "utf-8")
    done = call(LINE.format("dive-2026-05-0*.csv", "day") + " --json", 1)
    document = json.loads(done.stdout)
    assert [*document["failed"]] == ["dive-2026-05-02.csv"]
    assert {row["day"] for row in document["coefficients"]} == {"2026-05-01"}
    assert "1 log could not be used" in done.stderr


@pytest.mark.slow
def test_groups_of_too_little_are_named(folder, call):
    write(folder, "dive-2026-05-01.csv")
    line = LINE.format("dive-2026-05-01.csv", "day").replace("linear", "linear,gertler-hagen")
    told = " ".join(call(line).stdout.split())
    assert "gertler-hagen 2026-05-01 (400 samples) do not determine all coefficients" in told
    assert "linear 2026-05-01 (400 samples), gertler-hagen" in told
    assert "too short for standard errors" in told


@pytest.mark.slow
def test_groups_have_files_of_their_own_and_results_are_no_logs(folder, call):
    for name in ("a b", "a-b", "a;b", "A-b"):
        write(folder, f"dive_{name}_.csv")
    line = LINE.format(".", "dive_(.*)_")
    for _ in range(2):
        shutil.rmtree(folder / "season" / "fits", ignore_errors=True)
        for other in ("a.csv", "b.csv", "ab.csv"):
            (folder / other).unlink(missing_ok=True)
        call(f"{line} --force")
        names = [path.name.casefold() for path in (folder / "season" / "fits").iterdir()]
        assert len(set(names)) == 4
