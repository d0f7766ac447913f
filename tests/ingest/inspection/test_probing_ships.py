"""Drafts of the logs of ships and boats, and of topics of one number, against one motion."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.data.channels import unit_factor
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.ingest.formats.cells import parse_column
from hydrodamp.ingest.inspection.names import guess_role
from hydrodamp.ingest.inspection.probe import MIN_DRAFT_CONFIDENCE, probe
from strangers import write_columns
from table_rows import rows

TIME = np.arange(0.0, 60.0, 0.1)
R = 0.2 * np.sin(0.25 * TIME) + 0.05 * np.sin(0.9 * TIME)
PSI = 0.3 + np.cumsum(R) * 0.1
U, V = 2.0 + 0.3 * np.sin(0.2 * TIME), -0.5 * R
NORTH = np.cumsum(U * np.cos(PSI) - V * np.sin(PSI)) * 0.1
EAST = np.cumsum(U * np.sin(PSI) + V * np.cos(PSI)) * 0.1
SOG, COG = np.hypot(U, V), np.degrees(PSI + np.arctan2(V, U)) % 360.0
HDG = np.degrees(PSI) % 360.0
LATITUDE, LONGITUDE = -33.5 + NORTH / 110_915.0, -70.2 + EAST / 92_930.0  # by the tables of WGS 84
RUDDER = np.degrees(-0.3 * R)
KNOT = 1852.0 / 3600.0


def record(columns, texts=None):
    """Return the recording of one table."""
    topic = Topic("", None, {"t": TIME, **columns}, texts or {})
    return Recording((topic,), "a.csv", "text in columns")


def read_by_draft(recording):
    """Return the log that the draft of a recording reads."""
    return probe(recording).mapping().log(recording)


def record_topics(columns, field, form):
    """Return the recording of topics of one number."""
    topics = (Topic(name, TIME, {field: values}) for name, values in columns.items())
    return Recording(tuple(topics), "a", form)


def assert_motion(log, tolerance=0.03):
    for name, true in (("u", U), ("v", V), ("r", R)):
        error = log.velocity[:, "uvwpqr".index(name)] - true
        assert np.sqrt(np.mean(error[5:-5] ** 2)) < tolerance, name


def fold_minutes(degrees):
    whole, rest = np.divmod(np.abs(degrees), 1.0)
    return 100.0 * whole + 60.0 * rest


@pytest.mark.slow
@pytest.mark.parametrize(
    "columns",
    [
        {"lat": LATITUDE, "lon": LONGITUDE, "SOG": SOG / KNOT, "COG": COG, "HDG": HDG},
        {"gps_lat": 1e7 * LATITUDE, "gps_lng": 1e7 * LONGITUDE, "heading_deg": HDG},
        {
            "Latitude": np.radians(LATITUDE),
            "Longitude": np.radians(LONGITUDE),
            "SpeedOverGround": 3.6 * SOG,
            "CourseOverGround": np.radians(COG),
            "Heading": np.radians(HDG),
            "RateOfTurn": 60.0 * np.degrees(R),
        },
    ],
    ids=["degrees", "receiver", "radians"],
)
def test_a_position_on_the_ellipsoid(columns):
    log = read_by_draft(record({**columns, "rudder": RUDDER}))
    assert_motion(log)
    travelled = np.column_stack((NORTH - NORTH[0], EAST - EAST[0]))
    np.testing.assert_allclose(log.position[:, :2], travelled, atol=0.1)
    assert log.command_names == ("rudder",)


def test_degrees_and_minutes_with_a_column_of_the_hemisphere():
    columns = {"lat": fold_minutes(LATITUDE), "lon": fold_minutes(LONGITUDE), "hdt": HDG}
    columns |= {"sog_kn": SOG / KNOT, "cog": COG}
    letters = {"ns": ("S",) * len(TIME), "ew": ("W",) * len(TIME)}
    log = read_by_draft(record(columns, letters))
    assert_motion(log)
    assert any("latitude -33.4999" in note for note in log.notes)
    both = {**letters, "ew": ("W", "E") * (len(TIME) // 2)}
    assert "in two hemispheres" in probe(record(columns, both)).draft.text


@pytest.mark.slow
@rows("signed, texts")
def test_letters_that_change_no_sign(signed, texts):
    """Signed coordinates have their sign, and other columns hold letters of other meanings."""
    latitude, longitude = (LATITUDE, LONGITUDE) if signed else (-LATITUDE, -LONGITUDE)
    letters = {name: (letter,) * len(TIME) for name, letter in texts.items()}
    columns = {"lat": latitude, "lon": longitude, "hdg": HDG, "u": U}
    log = read_by_draft(record(columns, letters))
    moved = np.array((NORTH[-1] - NORTH[0], EAST[-1] - EAST[0])) * (1 if signed else -1)
    np.testing.assert_allclose(log.position[-1, :2], moved, atol=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [{"u": U, "v": V}, {"SOG": SOG / KNOT, "COG": COG}])
@pytest.mark.parametrize("origin", [(0.0, 0.0), (1.2, 2.5)])
@pytest.mark.parametrize("unit", ["deg", "rad", "degE6", "degE7"])
def test_coordinates_have_the_unit_that_fits_the_speed(unit, origin, speed):
    start = np.array(origin) + (7.0 if unit.startswith("degE") else 0.0)
    scale = {"deg": 1.0, "rad": np.pi / 180.0, "degE6": 1e6, "degE7": 1e7}[unit]
    # radii of WGS 84 by the tables, at the equator and near it
    latitude = start[0] + (NORTH - NORTH[0]) / 110_600.0
    longitude = start[1] + (EAST - EAST[0]) / (111_320.0 * np.cos(np.radians(start[0])))
    columns = {"lat": scale * latitude, "lon": scale * longitude, "hdg": HDG, **speed}
    log = read_by_draft(record(columns))
    assert np.ptp(log.position[:, 0]) == pytest.approx(np.ptp(NORTH), rel=0.01)
    assert np.ptp(log.position[:, 1]) == pytest.approx(np.ptp(EAST), rel=0.01)


UNDECIDED = {
    "coordinates of two possible units": (
        {"lat": 1.2 + NORTH / 1e5, "lon": 2.5 + EAST / 1e5, "hdg": HDG},
        "unit: deg}    # 55 %: deg by magnitude, unless it is rad",
    ),
    "a unit by convention alone": (
        {"SOG": SOG / KNOT, "COG": COG, "HDG": HDG, "rudder": RUDDER},
        "unit: kn}    # 55 %: kn by convention",
    ),
    # Nothing says that the vehicle neither drifts nor moves astern.
    **{
        f"{name} alone": (
            {"yaw": PSI, name: SOG, "rudder": RUDDER},
            f"speed: {name}    # 55 %: ",
        )
        for name in ("speed", "v", "groundspeed")
    },
}


@pytest.mark.parametrize("case", UNDECIDED)
def test_what_is_undecided_makes_no_log(case):
    columns, text = UNDECIDED[case]
    recording = record(columns)
    draft = probe(recording).draft
    assert text in draft.text
    assert draft.confidence < MIN_DRAFT_CONFIDENCE
    if "alone" in case and "unit" not in case:
        assert read_by_draft(recording).velocity[:, 0] == pytest.approx(SOG)


def test_positions_without_a_fix_say_nothing_about_the_unit_of_a_speed():
    fixes = {"lat": LATITUDE.copy(), "lon": LONGITUDE.copy()}
    for values in fixes.values():
        values[:40] = values[200:203] = 0.0
    receivers = [Topic(name, TIME + 0.03, {"value": fixes[name]}) for name in fixes]
    boat = Topic("boat", TIME, {"SOG": SOG / KNOT, "COG": COG, "HDG": HDG})
    recording = Recording((boat, *receivers), "a", "MOOS log")
    assert probe(recording).roles.best("velocity.speed").unit == "knots"


@pytest.mark.parametrize("unit", ["deg", "rad"])
@pytest.mark.parametrize("reference", ["north", "lat", "heading_deg", "sparse", None])
def test_a_small_course_has_the_unit_that_fits_the_motion(unit, reference):
    course = np.radians(3.5 + 2.0 * np.sin(0.2 * TIME))
    if unit == "rad":
        course *= 180.0 / np.pi
    north, east = np.cumsum(2.0 * np.cos(course)), np.cumsum(2.0 * np.sin(course))
    references = {
        "north": {"north": north * 0.1, "east": east * 0.1},
        "lat": {"lat": 47.0 + north / 1.1e6, "lon": 8.0 + east / 7.6e5},
        "heading_deg": {"heading_deg": np.degrees(course) + 4.0},
        "sparse": {"heading_deg": np.where(TIME < 0.05, 4.0, np.nan)},
    }
    is_known = reference not in ("sparse", None)
    columns = {"sog_mps": 2.0 + 0.0 * TIME, **references.get(reference, {})}
    columns["cog"] = np.degrees(course) if unit == "deg" else course
    guess = probe(record(columns)).roles.best("velocity.course")
    assert guess.unit == (unit if is_known else "deg")
    assert (guess.confidence >= MIN_DRAFT_CONFIDENCE) == is_known


@pytest.mark.parametrize("yaw", [PSI, np.pi / 2.0 - PSI], ids=["north", "east"])
def test_a_course_in_radians_agrees_with_a_yaw(yaw):
    found = probe(record({"sog_mps": SOG, "cog": np.radians(COG), "yaw": yaw}))
    assert found.roles.best("velocity.course").unit == "rad"


def test_a_hemisphere_in_the_cells(tmp_path):
    columns = {"time": TIME, "sog": SOG, "cog": COG, "hdg": HDG}
    columns["lat"] = [f"{value:.6f}S" for value in fold_minutes(LATITUDE)]
    columns["lon"] = [f"0{value:.6f} W" for value in fold_minutes(LONGITUDE)]
    log = read_by_draft(hd.read_recording(write_columns(tmp_path / "a.csv", columns)))
    assert_motion(log)
    assert np.ptp(log.position[:, 0]) == pytest.approx(np.ptp(NORTH), abs=0.1)


@rows("name, cell, degrees")
def test_cells_of_latitude_and_longitude(name, cell, degrees):
    assert parse_column([cell, ""], name=name).numbers[0] == pytest.approx(degrees)


@rows("name, cells")
def test_a_number_with_a_letter_is_no_coordinate(name, cells):
    assert parse_column(cells, name=name).numbers is None


@rows("name, unit")
def test_a_rate_of_turn_has_the_unit_that_fits_the_heading(name, unit):
    columns = {"u": U, "v": V, "heading": HDG, name: R / unit_factor(unit)}
    recording = record(columns)
    assert probe(recording).roles.best("velocity.r").unit == unit
    assert_motion(read_by_draft(recording), tolerance=1e-6)


def test_a_course_over_ground_goes_with_the_speed_over_ground():
    columns = {"STW": 0.5 * SOG, "lat": LATITUDE, "lon": LONGITUDE, "COG": COG, "HDG": HDG}
    assert_motion(read_by_draft(record({**columns, "SOG": SOG})))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "factor"), [("v", 1.0), ("speed", 1.0), ("V", 1 / KNOT)])
def test_a_speed_of_the_length_of_the_path_is_no_sway(name, factor):
    assert_motion(read_by_draft(record({"x": NORTH, "y": EAST, "yaw": PSI, name: factor * SOG})))


def test_a_sway_of_one_sign_stays_a_sway():
    found = probe(record({"x": NORTH, "y": EAST, "yaw": PSI, "v": V - V.min()}))
    assert found.roles.best("velocity.v").column == "v"


def test_a_moos_log_has_x_east_and_a_heading():
    columns = {"NAV_YAW": -PSI, "NAV_X": EAST, "NAV_Y": NORTH, "NAV_HEADING": HDG}
    columns |= {"NAV_SPEED": SOG, "DESIRED_HEADING": HDG, "DESIRED_RUDDER": RUDDER}
    log = read_by_draft(record_topics(columns, "value", "MOOS log"))
    assert_motion(log)
    assert log.command_names == ("DESIRED_RUDDER",)


@pytest.mark.parametrize("names", ["u_speed v_speed r_speed", "surge_vel sway_vel yaw_rate"])
def test_topics_of_one_number_have_the_role_of_their_names(names):
    speeds = dict(zip(names.split(), (U, V, R), strict=True))
    topics = {f"/boat/{name}": values for name, values in speeds.items()}
    topics |= {"/boat/heading_deg": HDG, "/wind/speed": 5 + R}
    log = read_by_draft(record_topics(topics, "data", "ROS 1 bag"))
    assert_motion(log)
    assert log.command_names == ()


def test_theta_beside_x_and_y_alone_is_a_yaw():
    turned = (PSI + np.pi) % (2.0 * np.pi) - np.pi
    pose = Topic("/pose", TIME, {"x": NORTH, "y": EAST, "theta": turned})
    rudder = Topic("/rudder", TIME, {"data": RUDDER})
    assert_motion(read_by_draft(Recording((pose, rudder), "a.bag", "ROS 1 bag")))
    assert guess_role("", "theta", None, ("x", "y", "theta", "phi"))[0] == "attitude.pitch"


@pytest.mark.parametrize("factor", [1.0, 180.0 / np.pi])
def test_a_twist_of_a_topic_named_angle_is_an_attitude(factor):
    angles = np.column_stack((0.1 * np.sin(TIME), 0.05 * np.cos(TIME), np.sin(0.3 * TIME)))
    unit = "radian" if factor == 1.0 else "degrees"
    fields = {f"angular.{axis}": factor * angles[:, k] for k, axis in enumerate("xyz")}
    twist = Topic(f"/rov/angle_{unit}", TIME, {**fields, "linear.x": U})
    altitude = Topic("/rov/rel_alt", TIME, {"data": -3.0 + 0.1 * np.sin(0.1 * TIME)})
    recording = Recording((twist, altitude), "a.bag", "ROS 1 bag")
    found = probe(recording)
    assert found.roles.best("position.up").column == "/rov/rel_alt.data"
    assert found.roles.best("velocity.p") is None
    assert found.roles.best("velocity.u") is None
    # r of the body from the Euler angles, forward-port-up turned to forward-starboard-down
    log = read_by_draft(recording)
    slopes = np.gradient(angles, TIME, axis=0)
    roll, pitch = angles[:, 0], angles[:, 1]
    r = np.cos(pitch) * np.cos(roll) * slopes[:, 2] - np.sin(roll) * slopes[:, 1]
    np.testing.assert_allclose(log.velocity[5:-5, 5], -r[5:-5], atol=0.01)


@pytest.mark.parametrize("name", ["sat", "delivered", "measured"])
def test_a_wrench_that_acts_precedes_the_commanded(name):
    columns = {"u": U, "v": V, "r": R, "psi": PSI}
    for axis, values in zip("XYN", (U, V, R), strict=True):
        columns |= {f"tau_cmd_{axis}": 1000 * values, f"tau_{name}_{axis}": np.tanh(values)}
    wrench = read_by_draft(record(columns)).wrench
    np.testing.assert_allclose(wrench[:, [0, 1, 5]], np.tanh(np.column_stack((U, V, R))))


def test_a_saturated_command_precedes_the_commanded():
    columns = {"u": U, "v": V, "r": R, "psi": PSI, "thrust_cmd": RUDDER}
    columns["thrust_delivered"] = np.clip(RUDDER, -3.0, 3.0)
    log = read_by_draft(record(columns))
    assert log.command_names == ("thrust_delivered",)


@pytest.mark.parametrize(("norm", "gravity"), [(1.0, True), (1000.0, True), (0.02, False)])
def test_a_specific_force_has_the_norm_of_gravity(norm, gravity):
    force = norm * np.column_stack((0.01 * np.sin(TIME), 0.02 * np.cos(TIME), -1 + 0 * TIME))
    columns = {f"Acc{axis}": force[:, k] for k, axis in enumerate("XYZ")}
    angles = {"roll": 0.1 * np.sin(TIME), "pitch": 0.1 * np.sin(TIME), "yaw": PSI}
    log = read_by_draft(record({**columns, **angles, "u": U, "v": V, "w": 0.1 * V}))
    assert (log.specific_force is not None) == gravity
    if log.specific_force is not None:
        assert log.specific_force[:, 2] == pytest.approx(-9.80665)
