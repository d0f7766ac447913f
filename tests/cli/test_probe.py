from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from hydrodamp.data.canonical import write_log
from hydrodamp.data.log import Log
from hydrodamp.ingest.read import read_log

Call = Callable[..., Result]


def test_tells_segments_columns_and_verdict(folder: Path, call: Call) -> None:
    done = call("probe ab.csv --vehicle planar.yaml")
    assert done.exit_code == 0, done.output
    for word in ("ab.csv: 800 samples", "one", "two", "ahead", "std", "Verdict: Fit for the job"):
        assert word in done.stdout


def test_without_a_vehicle_names_what_is_missing(folder: Path, call: Call) -> None:
    document = json.loads(call("probe a.csv b.csv --json").stdout)
    assert not document["fit"]
    assert any("velocities w p q" in each for each in document["missing"])
    assert any("attitude" in each for each in document["missing"])
    assert len(document["segments"]) == 2


def test_commands_of_no_actuator_are_no_hindrance(folder: Path, call: Call) -> None:
    text = (folder / "planar.yaml").read_text("utf-8").split("actuators")[0]
    (folder / "bare.yaml").write_text(text, "utf-8")
    document = json.loads(call("probe a.csv --vehicle bare.yaml --json").stdout)
    assert document["fit"]
    (told,) = [each for each in document["reservations"] if "ahead turn" in each]
    assert told.startswith("vehicle 'planar' has no actuators, and the log has only the commands")
    for way in ("`terms: {X: ahead}`", "give it `actuators` in its file", "X Y Z K M N"):
        assert way in told


def test_commands_of_other_names_than_the_actuators_take(folder: Path, call: Call) -> None:
    text = (folder / "planar.yaml").read_text("utf-8").replace("[ahead, turn]", "[rpm, fin]")
    (folder / "other.yaml").write_text(text, "utf-8")
    document = json.loads(call("probe a.csv --vehicle other.yaml --json").stdout)
    (told,) = document["missing"]
    assert told.startswith("the actuators of 'planar' take rpm fin, and the log has only")
    assert "`commands: {rpm: ahead}` in a mapping" in told
    assert not any("turn" in each for each in document["reservations"])


def test_a_vehicle_that_nothing_rights_is_minded_once(folder: Path, call: Call) -> None:
    call("vehicle new mine.yaml --length 1.6 --diameter 0.19 --mass 40")
    done = call("probe a.csv --vehicle mine.yaml")
    said = " ".join(done.output.split())
    assert said.count("'mine' has no righting moment in roll and pitch") == 1
    assert "righting" not in call("probe a.csv --vehicle planar.yaml").output


def test_says_what_will_not_be_determined(folder: Path, call: Call) -> None:
    time = 0.5 * np.arange(40)
    still = {"u": 1.0 + 0.1 * np.sin(time), "v": 0.001 * np.cos(time), "r": np.sin(time)}
    columns = {"ahead": np.ones(40), "turn": np.sin(time)}
    write_log(Log.from_arrays(time, still, commands=columns), folder / "dull.csv")
    said = json.loads(call("probe dull.csv --vehicle planar.yaml --json").stdout)["reservations"]
    for word in ("v hardly varies", "u never changes sign", "never change: ahead", "0.25 s apart"):
        assert any(word in each for each in said), word
    assert any("only 19.5 s" in each for each in said)


def test_a_log_that_drives_nothing(folder: Path, call: Call) -> None:
    write_log(Log(np.arange(5.0), np.ones((5, 6)) * np.arange(5.0)[:, None]), folder / "no.csv")
    for line in ("probe no.csv --json", "probe no.csv --vehicle planar.yaml --json"):
        document = json.loads(call(line).stdout)
        assert any("X Y Z K M N" in each for each in document["missing"])


def columns_of(path: Path) -> dict[str, np.ndarray]:
    """The columns of a canonical log."""
    table = np.genfromtxt(path, delimiter=",", names=True)
    return {name: table[name] for name in table.dtype.names or ()}


def unmapped(folder: Path, name: str = "dive.csv", source: str = "a.csv") -> Path:
    """The planar motion under other names: degrees, milliseconds, a pose."""
    known = columns_of(folder / source)
    step = known["time"][1]
    yaw = np.concatenate(([0.0], np.cumsum(known["r"][:-1]))) * step
    turned = (known["u"] + 1j * known["v"]) * np.exp(1j * yaw)
    way = np.concatenate(([0.0], np.cumsum(turned[:-1]))) * step
    columns = {
        "t_ms": 1000 * known["time"],
        "x_m": way.real,
        "y_m": way.imag,
        "yaw_deg": np.degrees(yaw),
        "u": known["u"],
        "v": known["v"],
        "yaw_rate": np.degrees(known["r"]),
        "motor_ahead": known["ahead"],
        "motor_turn": known["turn"],
        "battery": 12.0 + 0 * yaw,
    }
    path = folder / name
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    return path


def test_an_unknown_table_is_guessed_and_drafted(folder: Path, call: Call) -> None:
    unmapped(folder)
    done = call("probe dive.csv --vehicle planar.yaml --draft mine.yaml")
    assert done.exit_code == 0, done.output
    for word in ("text in columns", "deg/s", "Velocities are along body axes", "No role found for"):
        assert word in done.stdout, word
    for word in ("Delay between commands", "motor_turn", "Verdict:"):
        assert word in done.stdout, word
    log = read_log(folder / "dive.csv", folder / "mine.yaml")
    known = columns_of(folder / "a.csv")
    assert log.command_names == ("motor_ahead", "motor_turn")
    np.testing.assert_allclose(log.velocity[:, 5], known["r"], atol=1e-8)
    np.testing.assert_allclose(log.velocity[:, 0], known["u"], atol=1e-8)


def test_all_of_it_for_machines(folder: Path, call: Call) -> None:
    unmapped(folder)
    unmapped(folder, "again.csv", "b.csv")
    document = json.loads(call("probe dive.csv again.csv --json").stdout)
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
    assert document["suspicions"] == []
    assert any("surge" in each for each in document["promises"])


def test_a_canonical_log_tells_no_more_than_it_must(folder: Path, call: Call) -> None:
    done = call("probe a.csv")
    assert "as a mapping" not in done.stdout
    document = json.loads(call("probe a.csv --json").stdout)
    assert document["log"] == "canonical"
    assert document["format"] == "text in columns"


def test_a_log_of_which_nothing_is_known(folder: Path, call: Call) -> None:
    (folder / "odd.csv").write_text("a,b\n" + "\n".join(f"{k % 3},{k % 5}" for k in range(50)))
    done = call("probe odd.csv")
    assert done.exit_code == 0, done.output
    for word in (
        "No role found for: a, b",
        "there is no clock",
        "too unsure (0 %)",
        "Verdict: Not fit for the job",
    ):
        assert word in done.stdout, word
    document = json.loads(call("probe odd.csv --json").stdout)
    assert document["log"] is None
    assert not document["fit"]
    assert "too unsure" in document["missing"][0]


def test_a_draft_that_makes_no_log_says_why(folder: Path, call: Call) -> None:
    rows = [f"{0.1 * k},{np.sin(0.1 * k)}" for k in range(50)]
    (folder / "turn.csv").write_text("t,r\n" + "\n".join([*rows, "9,50000"]))
    document = json.loads(call("probe turn.csv --json").stdout)
    assert document["log"] is None
    assert "by the draft" in document["missing"][0]


def test_a_mapping_is_followed(folder: Path, call: Call) -> None:
    unmapped(folder)
    call("probe dive.csv --draft mine.yaml")
    document = json.loads(call("probe dive.csv --mapping mine.yaml --json").stdout)
    assert document["log"] == "by the mapping mine.yaml"
    assert document["draft"].startswith("# Drafted by")
    assert document["guesses"]
    assert call("probe dive.csv --mapping mavros").exit_code == 2


def test_with_a_mapping_neither_draft_nor_guesses_are_printed(folder: Path, call: Call) -> None:
    unmapped(folder)
    call("probe dive.csv --draft mine.yaml")
    done = call("probe dive.csv --mapping mine.yaml --vehicle planar.yaml --draft again.yaml")
    assert done.exit_code == 0, done.output
    for word in ("dive.csv: text in columns", "Made by the mapping mine.yaml", "Verdict:"):
        assert word in done.stdout, word
    for word in ("as a mapping", "sure each line is", "No role found", "Axes: body"):
        assert word not in done.stdout, word
    assert (folder / "again.yaml").read_text("utf-8") == (folder / "mine.yaml").read_text("utf-8")
    assert "Made by the draft" in call("probe dive.csv").stdout


def test_what_the_steps_of_a_mapping_did_is_told(folder: Path, call: Call) -> None:
    unmapped(folder)
    call("probe dive.csv --draft mine.yaml")
    with (folder / "mine.yaml").open("a", encoding="utf-8") as file:
        file.write("steps: [{delayed: {motor_turn: 0.1}}]\n")
    done = call("probe dive.csv --mapping mine.yaml")
    (note,) = json.loads(call("probe dive.csv --mapping mine.yaml --json").stdout)["log_notes"]
    assert note in " ".join(done.stdout.split())


def test_a_draft_that_was_corrected_is_kept_unless_forced(folder: Path, call: Call) -> None:
    unmapped(folder)
    (folder / "mine.yaml").write_text("# corrected by hand\n", "utf-8")
    done = call("probe dive.csv --draft mine.yaml")
    assert done.exit_code == 2
    assert "is there already" in done.stderr
    assert (folder / "mine.yaml").read_text("utf-8") == "# corrected by hand\n"
    assert call("probe dive.csv --draft mine.yaml --force").exit_code == 0


def test_a_draft_needs_a_place(folder: Path, call: Call) -> None:
    unmapped(folder)
    done = call("probe dive.csv --draft nowhere/mine.yaml")
    assert done.exit_code == 2
    assert "nowhere" in done.stderr


def test_a_bag_of_odometry(folder: Path, call: Call, measured_bag: Path) -> None:
    document = json.loads(call(f"probe {measured_bag} --json").stdout)
    assert document["format"] == "ROS 2 bag (MCAP)"
    assert (document["axes"]["body"], document["axes"]["world"]) == ("FLU", "ENU")
    assert document["presets"][0]["name"] == "rep103-odometry"
    assert document["presets"][0]["topics"] == {"odometry": "/rov/odom"}
    (delay,) = document["delays"]
    assert (delay["command"], delay["velocity"]) == ("thruster_cmd", "u")
    assert delay["seconds"] == pytest.approx(0.3, abs=0.06)


@pytest.fixture
def measured_bag(tmp_path: Path) -> Path:
    """Surge under a thruster that answers 0.3 s late, in an MCAP that rosbags writes."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    kinds, path = store.types, tmp_path / "bag"
    rng = np.random.default_rng(5)
    thrust = np.repeat(rng.choice([-1.0, 0.0, 1.0], 30), 40)
    speed, place = np.zeros(1200), np.zeros(1200)
    for k in range(1199):
        speed[k + 1] = speed[k] + 0.05 * (thrust[max(k - 6, 0)] - speed[k] * abs(speed[k]))
        place[k + 1] = place[k] + 0.05 * speed[k]
    vector, header = kinds["geometry_msgs/msg/Vector3"], kinds["std_msgs/msg/Header"]
    odometry, number = "nav_msgs/msg/Odometry", "std_msgs/msg/Float64"
    with rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as bag:
        odom = bag.add_connection("/rov/odom", odometry, typestore=store)
        command = bag.add_connection("/rov/thruster/cmd", number, typestore=store)
        for k in range(1200):
            stamp = 1_700_000_000_000_000_000 + 50_000_000 * k
            at = kinds["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
            pose = kinds["geometry_msgs/msg/Pose"](
                kinds["geometry_msgs/msg/Point"](place[k], 0.0, -1.0),
                kinds["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
            )
            twist = kinds["geometry_msgs/msg/Twist"](
                vector(speed[k], 0.0, 0.0), vector(0.0, 0.0, 0.0)
            )
            none = np.zeros(36)
            message = kinds[odometry](
                header(at, "map"),
                "base_link",
                kinds["geometry_msgs/msg/PoseWithCovariance"](pose, none),
                kinds["geometry_msgs/msg/TwistWithCovariance"](twist, none),
            )
            bag.write(command, stamp, store.serialize_cdr(kinds[number](thrust[k]), number))
            bag.write(odom, stamp, store.serialize_cdr(message, odometry))
    return path


def test_measured_logs(folder: Path, call: Call, measured_logs: Callable[[str], Path]) -> None:
    """What their README says of them must be found without it."""
    run = measured_logs("bluerov2_kth") / "run_11_40_38.csv"
    document = json.loads(call(f"probe {run} --json").stdout)
    assert (document["axes"]["body"], document["axes"]["velocity"]) == ("FLU", "body")
    assert document["axes"]["rate_unit"] == "rad/s"
    assert document["presets"][0]["name"] == "bluerov2-kth"

    document = json.loads(call(f"probe {measured_logs('vt690_field')} --json").stdout)
    found = {one["column"].split(".", 1)[1]: one["role"] for one in document["guesses"]}
    assert document["axes"]["body"] == "FRD"
    assert found["velocity.v_x"] == "velocity.u"
    assert found["depth.depth_filt"] == "position.depth"
    assert found["fins.top"] == "commands"
    assert document["presets"][0]["name"] == "avl690"
