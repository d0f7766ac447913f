import csv
from pathlib import Path

import numpy as np
import pytest

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.inspection.names import guess_role, split_unit
from hydrodamp.ingest.inspection.probe import probe
from hydrodamp.ingest.mapping.log_mapping import read_mapping
from strangers import FLIP, name_columns
from table_rows import rows

with Path(__file__).with_name("names.csv").open(encoding="utf-8") as file:
    _, *NAMES = csv.reader(file)


@pytest.mark.parametrize(("topic", "field", "unit", "role"), NAMES)
def test_names(topic, field, unit, role):
    """P01 codes of SeaDataNet, such as HEADCM01, among them."""
    said, sure = guess_role(topic, field, unit or None, {field})
    assert (said if sure else "") == role


@rows("name, unit, role")
def test_newtons_are_a_unit_after_an_axis(name, unit, role):
    said, sure = guess_role("", name, split_unit(name)[1], {name})
    assert split_unit(name)[1] == unit
    assert (said if sure else None) == role


@rows("names, roles")
def test_elements_count_from_the_first_of_their_array(names, roles):
    for name, role in zip(names.split(), roles.split(), strict=True):
        said = guess_role("", name, None, names.split())[0]
        assert said.split()[0] == role


def test_elements_of_an_array_have_a_unit_in_common():
    """Roll and pitch rates that could be radians have the unit of the yaw rate beside them."""
    time = np.arange(0.0, 60.0, 0.1)
    rates = np.sin(np.outer(time, (0.3, 0.4, 0.2))) * (1.0, 2.0, 40.0)
    columns = {f"gyro[{k}]": one for k, one in enumerate(rates.T)}
    found = probe(Recording((Topic("imu", None, {"t": time, **columns}),), "a.npz", "arrays"))
    assert [found.roles.best(f"velocity.{name}").unit for name in "pqr"] == ["deg/s"] * 3


def test_a_column_of_the_name_is_never_said_to_be_absent():
    """A yaw moment in a unit that cannot be one is left out, and the draft says so."""
    time = np.arange(0.0, 60.0, 0.1)
    columns = {"t": time, "tau_X": 10 * np.sin(time), "tau_Y": 9 * np.sin(time), "tau_N": time % 7}
    table = Topic("", None, columns, units={"tau_N": "psi"})
    text = probe(Recording((table,), "a.csv", "text")).draft.text
    assert "N: {value: 0.0}    # `tau_N` is omitted" in text
    assert "Z: {value: 0.0}    # not recorded" in text


def test_a_unit_that_no_role_has_is_of_something_else():
    assert guess_role("", "P", None, {"P"}, "bar") == ("in bar", 0)
    assert guess_role("", "p", None, {"p"}, "body") == ("velocity.p", 85)


@rows("log, presets, axes")
def test_logs_of_presets_come_back_without_one(log, presets, axes, request, dive):
    recording = request.getfixturevalue(log)
    recording = recording("/rov/state") if log == "odometry" else recording
    found = probe(recording)
    assert [one.name for one in found.presets] == presets
    roles = found.roles
    assert [roles.vertical_axis.body, roles.world, roles.velocity.earth_fixed] == axes
    assert (found.roles.best("specific_force.fx") is None) == (log != "ardusub")
    dive.check(found.mapping().log(recording))


def test_axes_and_units_of_every_sensor_are_found(table, dive):
    """Attitude and velocity with z up, rates in deg/s with z down."""
    recording = table(
        t_ms=1000 * dive.time + 1e6,
        **name_columns("qw qx qy qz", dive.q_ned * (1, 1, -1, -1)),
        **name_columns("gyro_x gyro_y gyro_z", np.degrees(dive.rates)),
        **name_columns("vx vy vz", dive.body * FLIP),
        **name_columns("x y z", dive.place * FLIP),
        acc_z=9.81 + 0.1 * np.sin(dive.time),
        rpm=dive.rudder,
    )
    found = probe(recording)
    roles = found.roles
    assert (roles.vertical_axis.body, roles.world) == ("FLU", "NWU")
    assert not roles.velocity.earth_fixed
    assert roles.rates.unit == "deg/s"
    assert roles.rates.mirrored
    assert roles.clocks[""].unit == "ms"
    dive.check(found.mapping().log(recording))


def test_velocities_in_other_axes_than_the_attitude(table, dive):
    recording = table(
        time_s=dive.time,
        **dive.euler(),
        **name_columns("vx vy vz", dive.body * FLIP),
        **name_columns("p q r", dive.rates),
        **name_columns("x y z", dive.place),
        depth=dive.place[:, 2] + 3,
    )
    found = probe(recording)
    assert found.roles.velocity.mirrored
    assert not found.roles.rates.mirrored
    assert "velocity: {axes: FLU}" in found.draft.text
    dive.check(found.mapping().log(recording))


def test_numbers_alone_are_no_roles(table):
    time = np.arange(0.0, 60.0, 0.1)
    found = probe(table(a=time, b=np.cos(time), c=np.sin(time)))
    assert [(one.column, one.role) for one in found.roles.guesses] == [("a", "time")]
    assert found.without_role == ("b", "c")
    assert found.draft.confidence == 0
    with pytest.raises(LogError):
        found.mapping()


def test_columns_without_names_fit_a_preset_by_the_way_they_make(table):
    time = np.arange(0.0, 60.0, 0.1)
    speed = np.column_stack((1 + 0.3 * np.sin(time / 3), 0.4 * np.cos(time / 5)))
    for scale, presets in ((0.1, ["kvlcc2-hsva"]), (0.2, [])):
        way, rest = scale * np.cumsum(speed, axis=0), [0 * time] * 4
        columns = enumerate((time, *way.T, 0 * time, *speed.T, *rest, time), start=1)
        found = probe(table(**{f"column {place}": one for place, one in columns}))
        assert [one.name for one in found.presets] == presets
        assert ("extends: kvlcc2-hsva\n" in found.draft.text) == bool(presets)
        assert found.draft.confidence == (70 if presets else 0)


@pytest.mark.parametrize(("name", "differences"), [("spare", ()), ("roll", ("attitude.roll",))])
def test_a_draft_extends_a_preset_that_reads_all_it_reads(dive, name, differences):
    fins = np.column_stack((dive.angles[:, 1:], dive.rates[:, 1:]))
    columns = (
        name_columns("v_x v_y v_z", dive.body) | {"data_good": 1.0 + 0 * dive.time},
        {"depth_filt": dive.place[:, 2]},
        name_columns("port top starboard bottom", fins),
        {"pitch_input": dive.angles[:, 1]},
        {"yaw_input": dive.angles[:, 2], name: dive.angles[:, 0]},
    )
    named = zip(read_mapping("avl690").topics.values(), columns, strict=True)
    topics = (Topic(names[0], None, fields | {"time": dive.time}) for names, fields in named)
    found = probe(Recording((*topics,), "dive", "text in columns"))
    assert found.presets[0].differences == differences
    assert ("extends: avl690" in found.draft.text) is not bool(differences)


def test_a_rudder_that_stands_still_stays_in_the_draft(table, dive):
    text = probe(table(t=dive.time, r=dive.rates[:, 2], rudder=0 * dive.time)).draft.text
    assert "rudder: rudder    # 85 %: constant in this run" in text


def test_bad_rows_are_left_out_and_flagged(dive):
    good = np.ones(len(dive.time))
    good[100:140] = 0.0
    speed = np.where(good[:, np.newaxis] == 1.0, dive.body, -32.768)
    fields = name_columns("v_x v_y v_z", speed)
    columns = {"dvl.velocity": {**fields, "data_good": good}}
    for axis, name in ((2, "yaw"), (1, "pitch")):
        columns[f"control.{name}_pid"] = {f"{name}_input": dive.angles[:, axis]}
    topics = (Topic(name, dive.time, one) for name, one in columns.items())
    text = probe(Recording((*topics,), "dive", "text in columns")).draft.text
    assert "u: {column: dvl.velocity.v_x, where: data_good}" in text
    assert "roll: {value: 0.0}" in text
