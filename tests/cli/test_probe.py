from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hydrodamp as hd


def test_without_a_vehicle_a_planar_log_is_judged_as_that_of_a_boat(folder, ask):
    document = ask("probe a.csv b.csv")
    assert (document["log"], document["format"]) == ("canonical", "text in columns")
    assert document["fit"]
    assert not document["missing"]
    assert any("also needs w p q, and the attitude" in each for each in document["remarks"])
    assert len(document["segments"]) == 2


def test_a_vehicle_that_nothing_rights_is_minded_once(folder, call):
    call("vehicle new mine.yaml --length 1.6 --diameter 0.19 --mass 40")
    said = " ".join(call("probe a.csv --vehicle mine.yaml").output.split())
    assert said.count("'mine' has no righting moment in roll and pitch") == 1


def test_says_what_will_not_be_determined(folder, ask, snapshot):
    time = 0.5 * np.arange(40)
    still = {"u": 1.0 + 0.1 * np.sin(time), "v": 0.001 * np.cos(time), "r": np.sin(time)}
    columns = {"ahead": np.ones(40), "turn": np.sin(time)}
    hd.write_log(hd.Log.from_arrays(time, still, commands=columns), folder / "dull.csv")
    said = ask("probe dull.csv --vehicle planar.yaml")["remarks"]
    assert "\n".join(said) == snapshot


def write_table(path, columns):
    rows = np.column_stack([*columns.values()])
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")


def unmapped(folder, name="dive.csv", source="a.csv"):
    """The planar motion under other names: degrees, milliseconds, a pose."""
    known = hd.read_log(folder / source)
    u, v, r = known.velocity[:, [0, 1, 5]].T
    yaw = np.concatenate(([0.0], np.cumsum(r[:-1]))) * 0.1
    turned = (u + 1j * v) * np.exp(1j * yaw)
    way = np.concatenate(([0.0], np.cumsum(turned[:-1]))) * 0.1
    columns = {
        "t_ms": 1000 * known.time,
        "x_m": way.real,
        "y_m": way.imag,
        "yaw_deg": np.degrees(yaw),
        "u": u,
        "v": v,
        "yaw_rate": np.degrees(r),
        "motor_ahead": known.command("ahead"),
        "motor_turn": known.command("turn"),
        "battery": 12.0 + 0 * yaw,
    }
    write_table(folder / name, columns)
    return known


def test_an_unknown_table_is_guessed_and_drafted(folder, call):
    known = unmapped(folder)
    done = call("probe dive.csv --vehicle planar.yaml --draft mine.yaml")
    for word in ("deg/s", "Velocities are along body axes", "# Omitted:", "Delay between"):
        assert word in done.stdout, word
    log = hd.read_log("dive.csv", "mine.yaml")
    assert log.command_names == ("motor_ahead", "motor_turn")
    np.testing.assert_allclose(log.velocity[:, [0, 5]], known.velocity[:, [0, 5]], atol=1e-8)


@pytest.mark.slow
def test_all_of_it_for_machines(folder, ask):
    unmapped(folder)
    unmapped(folder, "again.csv", "b.csv")
    document = ask("probe dive.csv again.csv")
    assert document["log"] == "by the draft"
    assert document["n_samples"] == 800
    assert document["topics"][0]["rate"] == pytest.approx(10.0)
    roles = {guess["column"]: guess["role"] for guess in document["guesses"]}
    assert roles["yaw_rate"] == "velocity.r"
    assert roles["motor_turn"] == "commands"
    assert document["axes"]["rate_unit"] == "deg/s"
    assert document["axes"]["velocity"] == "body"
    assert {one["command"] for one in document["delays"]} == {"motor_ahead", "motor_turn"}
    assert all(abs(one["seconds"]) < 0.1 for one in document["delays"])


def whole(folder):
    return np.genfromtxt(folder / "dive.csv", delimiter=",", names=True)


@pytest.mark.slow
def test_files_of_one_run_are_told_as_such_once(folder, call):
    unmapped(folder)
    table = whole(folder)
    names = [name for name in table.dtype.names if "motor" in name]
    pose = {name: table[name] for name in table.dtype.names if name not in names}
    write_table(folder / "pose.csv", pose)
    write_table(folder / "pwm.csv", {name: table[name] for name in ("t_ms", *names)})
    write_table(folder / "late.csv", {"t_ms": table["t_ms"] + 1e6, names[0]: table[names[0]]})
    done = call("probe pose.csv pwm.csv")
    assert done.stderr.count("`pose.csv+pwm.csv` reads these files as one recording") == 1
    # Every fault has a line of its own.
    faults = [line for line in done.stdout.splitlines() if "the table has no column" in line]
    assert len(faults) > 3
    assert all(line.startswith("  ") for line in faults)
    for files in ("pose.csv+pwm.csv", "pose.csv late.csv", "dive.csv pwm.csv", "a.csv b.csv"):
        assert "as one recording" not in call(f"probe {files}").stderr


def test_what_is_wrong_is_told_of_a_log_without_speeds_too(folder, call):
    unmapped(folder)
    table, lost = whole(folder), ("u", "v", "x_m", "y_m")
    columns = {name: table[name] for name in table.dtype.names if name not in lost}
    columns["yaw_deg"][100] += 90
    write_table(folder / "odd.csv", columns)
    done = call("probe odd.csv")
    assert "remove_attitude_outliers" in done.stdout.split("steps: ")[1]  # the draft mends it
    assert "`yaw` jumps" not in done.stdout


@pytest.mark.slow
def test_a_jitter_of_the_clock_is_minded(folder, ask):
    log = hd.read_log("a.csv")
    rng = np.random.default_rng(0)
    rough = rng.normal(size=log.velocity.shape)  # of which no motion tells
    late = replace(log, time=log.time + rng.uniform(0, 0.05, log.n), velocity=rough)
    hd.write_log(late, "late.csv")
    assert any("jitters by" in each for each in ask("probe late.csv")["remarks"])
    assert not any("jitters by" in each for each in ask("probe a.csv")["remarks"])


@pytest.mark.slow
def test_with_a_mapping_neither_draft_nor_guesses_are_printed(folder, call, ask):
    unmapped(folder)
    call("probe dive.csv --draft mine.yaml")
    with (folder / "mine.yaml").open("a", encoding="utf-8") as file:
        file.write("steps: [{apply_delay: {motor_turn: 0.1}}]\n")
    document = ask("probe dive.csv --mapping mine.yaml")
    assert document["log"] == "by the mapping mine.yaml"
    assert document["draft"].startswith("# Drafted by")
    assert document["guesses"]
    (note,) = document["log_notes"]  # what the step did
    said = " ".join(call("probe dive.csv --mapping mine.yaml --vehicle planar.yaml").stdout.split())
    for word in ("dive.csv: text in columns", "Made by the mapping mine.yaml", "Verdict:", note):
        assert word in said, word
    for word in ("Draft mapping", "confidence of each line", "Omitted", "Axes: body"):
        assert word not in said, word
    assert "Made by the draft" in call("probe dive.csv").stdout


@pytest.mark.slow
def test_times_copied_from_probe_are_taken(folder, call):
    """Epoch stamps: what is printed by the clock is the same span as seconds from the start."""
    log = hd.read_log("ab.csv")
    time = log.elapsed + 1459776213.25
    hd.write_log(replace(log, time=time, segments=()), folder / "epoch.csv")
    said = " ".join(call("probe epoch.csv --vehicle planar.yaml").stdout.split())
    assert "1459776213.250" in said
    line = "compare epoch.csv --vehicle planar.yaml --models linear --methods ls --json"
    first, second = (
        json.loads(call(f"{line} --train {train} --test 40:79").stdout)["rows"][0]["coefficients"]
        for train in ("0:40", "1459776213.25:1459776253.25")
    )
    assert first == second
    done = call(f"{line} --train 1459776213:1459776253 --test 90:95", 2)
    assert done.stderr.count("by the clock of the log: -0.25:39.75 in seconds") == 1
    assert "first sample at 1459776213.250 s by its clock" in " ".join(done.stderr.split())


@pytest.mark.slow
def test_axes_and_preset_of_a_measured_log_are_told(call, measured_logs):
    told = call(f"probe {measured_logs('bluerov2_kth')}/run_11_40_38.csv").stdout
    for words in ("Axes: body FLU", "Preset `bluerov2-kth` matches"):
        assert words in " ".join(told.split())


@pytest.mark.slow
def test_the_draft_of_an_rov_leads_to_a_damping_file_without_editing(
    tmp_path, monkeypatch, call, measured_logs
):
    """README's three commands on measured logs."""
    data = measured_logs("bluerov2_kth")
    monkeypatch.chdir(tmp_path)
    first, second = (f"{data}/{name}.csv" for name in ("run_11_57_50", "run_11_10_52"))
    call(f"probe {first} {second} --draft mapping.yaml")
    assert [path.name for path in tmp_path.iterdir()] == ["mapping.yaml"]
    line = "--vehicle bluerov2 --mapping mapping.yaml --models general"
    call(f"compare {line} --train {first} --test {second} --out result")
    call("export python result/damping.json --out exported")


@pytest.mark.slow
def test_swapped_channels_are_named_before_the_fit(tmp_path, monkeypatch, call, measured_logs):
    data = measured_logs("bluerov2_kth")
    monkeypatch.chdir(tmp_path)
    gains = "X: ch_forward, Y: ch_lateral, Z: ch_heave, K: ch_pitch, M: ch_roll, N: ch_yaw"
    Path("swapped.yaml").write_text(f"{{name: swapped, extends: fossen, terms: {{{gains}}}}}")
    logs = " ".join(map(str, sorted(data.glob("*.csv"))))
    line = f"identify {logs} --mapping bluerov2-kth --vehicle bluerov2 --method weak"
    said = call(f"{line} --model swapped.yaml").stderr
    assert "the model has a gain of ch_pitch on K, but it moves q" in said
    assert "the model has a gain of ch_roll on M, but it moves p" in said
