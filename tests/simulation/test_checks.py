"""What a vehicle and a log do not have in common is one sentence, with a way out."""

import re

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import ProblemError
from hydrodamp.simulation.checks import check_log, missing_actuation, unused_commands
from table_rows import rows

TIME = np.arange(20) / 10
LEVEL = np.tile([1.0, 0.0, 0.0, 0.0], (20, 1))


def log_of(*commands, wrench=False):
    return hd.Log.from_arrays(
        TIME,
        np.ones((20, 6)),
        attitude=LEVEL,
        commands=dict.fromkeys(commands, TIME),
        wrench=np.ones((20, 6)) if wrench else None,
        source="dive.csv",
    )


def model(**terms):
    return hd.DampingModel.from_table(terms, key="mine")


@rows("name, commands, words")
def test_a_log_that_says_nothing_of_the_drive(name, commands, words):
    vehicle, log, models = hd.fleet[name], log_of(*commands), (model(X="u"),)
    with pytest.raises(ProblemError) as caught:
        check_log(vehicle, log, models)
    message = str(caught.value)
    assert message == f"dive.csv: {missing_actuation(vehicle, log, models)}"
    assert "\n" not in message
    for word in (*words, *commands):
        assert word in message
    assert not list(unused_commands(vehicle, log, models))  # the one sentence is enough
    assert "models take tiller" in missing_actuation(vehicle, log, (model(N="tiller"),))


def test_the_model_file_that_is_told_drives_the_vehicle(tmp_path):
    rov, log = hd.fleet["bluerov2"], log_of("ch_yaw", "ch_roll")
    line = missing_actuation(rov, log).partition("the line `")[2].partition("`")[0]
    (tmp_path / "mine.yaml").write_text(line, "utf-8")
    (mine,) = hd.read_models(tmp_path / "mine.yaml")
    check_log(rov, log, (mine,))
    assert set(mine.terms[5]) > {*hd.catalog["linear"].terms[5]}


def test_what_drives_is_a_wrench_an_actuator_or_a_term():
    assert missing_actuation(hd.fleet["bluerov2"], log_of(wrench=True)) == ""
    assert missing_actuation(hd.fleet["vt690"], log_of("rpm")) == ""
    assert missing_actuation(hd.fleet["bluerov2"], log_of("ch_yaw"), (model(N="ch_yaw"),)) == ""


def test_commands_that_are_missing_come_together(refused):
    mine = (model(N="down_y stick tiller"),)
    refused(ProblemError, check_log, hd.fleet["vt690"], log_of("rpm", "tilter"), mine)


@rows("commands, said")
def test_columns_that_nothing_uses_come_together(commands, said):
    log = log_of("rudder", "elevator", "rpm", *commands)
    (fault,) = unused_commands(hd.fleet["vt690"], log, (model(X="u"),))
    assert re.search(said, fault)
    assert not list(unused_commands(hd.fleet["vt690"], log, [model(X="u", K=" ".join(commands))]))


def test_commands_are_called_alike_only_where_they_are_alike():
    told = missing_actuation(hd.fleet["vt690"], log_of("port", "rudder_rad"))
    assert "`commands: {rudder: rudder_rad, elevator: COLUMN, rpm: COLUMN}`" in told
