"""More logs of third-party writers, one for every kind of name or message that misleads a draft.

Each case lists in ``commands`` the columns that may be drafted as commands, and in ``lacks`` the
velocities that its log must not have.
"""

import numpy as np
import pytest
from scipy.io import savemat

from strangers import DEG, EPOCH, FLIP, case, messages, name_columns, write
from writers import RosBag

SWAP = [1, 0, 2]  # north-east-down to east-north-up, with the sign of the third


def _enu(ned):
    return ned[:, SWAP] * (1, 1, -1)


def _imu(it):
    columns = name_columns(
        "angular_velocity.x angular_velocity.y angular_velocity.z", it.rates * FLIP
    )
    columns |= name_columns("orientation.x orientation.y orientation.z orientation.w", it.q_enu)
    names = " ".join(f"linear_acceleration.{axis}" for axis in "xyz")
    return columns | name_columns(names, it.force * FLIP)


def _twist(block):
    return name_columns("twist.linear.x twist.linear.y twist.linear.z", block)


_TWIST = "geometry_msgs/msg/TwistStamped"


@case(
    holds="u v w p q r attitude port",
    tolerance=0.06,  # whole cm/s
    commands="SERVO_OUTPUT_RAW.servo1_raw",
)
def tlog_of_a_vehicle_with_a_gps(folder, it):
    """GLOBAL_POSITION_INT holds velocities along north, east, down in cm/s."""
    dialect = pytest.importorskip("pymavlink.dialects.v20.common")
    link, sent = dialect.MAVLink(None, srcSystem=1, srcComponent=1), bytearray()
    for k, second in enumerate(it.time.tolist()):
        boot = round(1000 * second) + 5000
        speeds = np.round(100 * it.world[k]).astype(int).tolist()
        heading = round(it.angles[k, 2] / DEG * 100) % 36000
        servos = [1500 + round(1000 * it.rudder[k]), *[0] * 7]
        pairs = (it.angles[k].tolist(), it.rates[k].tolist())
        for packet in (
            link.attitude_encode(boot, *pairs[0], *pairs[1]),
            link.global_position_int_encode(boot, 0, 0, 0, 0, *speeds, heading),
            link.servo_output_raw_encode(1000 * boot, 0, *servos),
        ):
            sent += round(1e6 * (EPOCH + second)).to_bytes(8) + packet.pack(link)
    (folder / "a.tlog").write_bytes(sent)
    return folder / "a.tlog"


@case(
    holds="u v w p q r attitude rudder",
    commands=" ".join(f"/fin_command.vector.{axis}" for axis in "xyz"),
)
def ros2_gps_velocity_beside_a_body_velocity(folder, it):
    bag = RosBag()
    store, time = bag.modern, it.time
    bag_messages = messages(bag, store, "/gps/velocity", _TWIST, time, _twist(_enu(it.world)))
    bag_messages += messages(bag, store, "/nav/body_velocity", _TWIST, time, _twist(it.body * FLIP))
    bag_messages += messages(bag, store, "/imu", "sensor_msgs/msg/Imu", time, _imu(it))
    fins = {"vector.x": it.rudder}
    bag_messages += messages(
        bag, store, "/fin_command", "geometry_msgs/msg/Vector3Stamped", time, fins
    )
    return bag.ros2(folder / "run", sorted(bag_messages, key=lambda one: one[2]))


@case(holds="u v w p q r attitude", commands="")
def ros2_gps_velocity_alone(folder, it):
    bag = RosBag()
    store, time = bag.modern, it.time
    bag_messages = messages(
        bag, store, "/gps_receiver/velocity", _TWIST, time, _twist(_enu(it.world))
    )
    bag_messages += messages(bag, store, "/imu", "sensor_msgs/msg/Imu", time, _imu(it))
    return bag.ros2(folder / "run", sorted(bag_messages, key=lambda one: one[2]), "SQLITE3")


@case(holds="u v w p q r attitude position", commands="")
def ros1_velocities_of_mavros(folder, it):
    """The same velocity along the axes of the map and of the body, and a pose."""
    bag = RosBag()
    store, stem, time = bag.noetic, "/mavros/local_position", it.time
    bag_messages = messages(
        bag, store, f"{stem}/velocity_local", _TWIST, time, _twist(_enu(it.world))
    )
    bag_messages += messages(
        bag, store, f"{stem}/velocity_body", _TWIST, time, _twist(it.body * FLIP)
    )
    bag_messages += messages(bag, store, "/mavros/imu/data", "sensor_msgs/msg/Imu", time, _imu(it))
    pose = name_columns("pose.position.x pose.position.y pose.position.z", it.enu)
    pose |= name_columns(
        "pose.orientation.x pose.orientation.y pose.orientation.z", it.q_enu[:, :3]
    )
    pose |= {"pose.orientation.w": it.q_enu[:, 3]}
    kind = "geometry_msgs/msg/PoseStamped"
    bag_messages += messages(bag, store, f"{stem}/pose", kind, time, pose)
    return bag.ros1(folder / "run.bag", sorted(bag_messages, key=lambda one: one[2]))


@case(holds="p q r attitude", lacks="u v", commands="thr_vertical thr_stern")
def csv_of_a_depth_alone(folder, it):
    columns = {"time": it.time, **it.euler("roll_deg pitch_deg yaw_deg", DEG)}
    columns |= name_columns("p q r", it.rates) | {"depth_m": it.place[:, 2]}
    return write(folder / "a.csv", {**columns, "thr_vertical": it.rudder, "thr_stern": it.rpm})


@case(holds="u v w p q r rudder", commands="rudder")
def npz_of_rates_in_degrees_without_an_attitude(folder, it):
    """Roll and pitch rates so small that they could be radians, a yaw rate that could not."""
    gyro = it.rates / DEG
    np.savez(folder / "a.npz", time=it.time, vel=it.body, gyro=gyro, rudder=it.rudder)
    return folder / "a.npz"


@case(commands="fins.rudder")
def hdf5_of_angle_and_rotational_velocity(folder, it):
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / "a.h5", "w") as file:
        file["imu/time"], file["dvl/time"] = it.time, it.time
        file["imu/angle"], file["imu/rotational_velocity"] = it.angles, it.rates
        file["dvl/linear_velocity"] = it.body
        file["fins/time"], file["fins/rudder"] = it.time, it.rudder
    return folder / "a.h5"


@case(commands="rudder")
def csv_of_gyro_angles(folder, it):
    """An attitude integrated from a gyro is called by it; the unit in the header says the rest."""
    columns = {"t": it.time, **it.euler("gyro_angle_x gyro_angle_y gyro_angle_z")}
    columns |= name_columns("vel_rotational_x vel_rotational_y vel_rotational_z", it.rates)
    columns |= name_columns("vel_translational_x vel_translational_y vel_translational_z", it.body)
    return write(folder / "a.csv", {**columns, "rudder": it.rudder})


@case(holds="u v r attitude position wrench", commands="", tolerance=0.05)
def csv_of_vectors_that_count_from_one(folder, it):
    columns = {"t": it.time, **name_columns("eta_1 eta_2 eta_3", it.flat_place)}
    columns |= name_columns("nu_1 nu_2 nu_3", it.flat)
    tau = name_columns("tau_cmd_1 tau_cmd_2 tau_cmd_3", it.wrench[:, [0, 1, 5]])
    return write(folder / "a.csv", columns | tau)


@case(holds="u v w p q r attitude position wrench", commands="")
def csv_of_matlab_elements(folder, it):
    """Cells of the header hold commas; a desired position stands before the measured one."""
    blocks = {
        "pd": it.place + np.outer(it.time, (1, 0, 0)),
        "eta": np.hstack((it.place, it.angles)),
        "nu": np.hstack((it.body, it.rates)),
        "tau": it.wrench,
    }
    columns = {"t": it.time}
    for name, block in blocks.items():
        columns |= {f"{name}({k},1)": item for k, item in enumerate(block.T, 1)}
    return write(folder / "a.csv", columns)


@case(holds="u v w p q r attitude position wrench", commands="")
def csv_of_matlab_elements_without_quotes(folder, it):
    """The same header as fprintf writes it: no cell is quoted."""
    path = csv_of_matlab_elements(folder, it)
    path.write_text(path.read_text("utf-8").replace('"', ""), "utf-8")
    return path


@case(
    holds="u v w p q r attitude rudder",
    loads=False,
    says="rate: HERTZ",
    add=(("rate: HERTZ", "rate: 10"),),
    commands="rudder",
)
def csv_of_desired_positions_without_a_clock(folder, it):
    """A desired position that only grows is no clock."""
    columns = it.table()
    del columns["time"]
    return write(folder / "a.csv", {"pd_x": 1.5 * it.time, "x_ref": 0.7 * it.time, **columns})


@case(holds="u v r attitude position wrench", commands="", tolerance=0.05)
def csv_of_a_wrench_by_axis(folder, it):
    columns = {
        "t": it.time,
        **name_columns("x y psi", it.flat_place),
        **name_columns("u v r", it.flat),
    }
    return write(
        folder / "a.csv", columns | name_columns("tau_X tau_Y tau_N", it.wrench[:, [0, 1, 5]])
    )


@case(commands="rudder")
def csv_of_desired_values(folder, it):
    """A controller logs what it wants beside, and before, what was measured."""
    off = 0.1 * np.sin(0.05 * it.time)
    columns = {"t": it.time, "psi_d": it.angles[:, 2] + off, "u_d": 1.2 + off}
    columns |= {"desired_pitch": off, "u_ref": 1.0 + off, "depth_setpoint": 5 + off}
    columns |= {"heading_ref": off, "r_des": off, "surge_target": 1.0 + off}
    table = it.table("t")
    return write(folder / "a.csv", columns | table)


@case(holds="u v w p q r attitude rpm rudder", commands="thruster_1_rpm fin_rudder")
def csv_of_status_words_and_counters(folder, it):
    """Of a thruster more is logged than its command."""
    random = np.random.default_rng(34)
    table = it.table()
    del table["rudder"]
    count = np.cumsum(random.random(900) < 0.1).astype(float)
    columns = {
        **table,
        "thruster_1_rpm": it.rpm,
        "fin_rudder": it.rudder,
        "thruster_1_status": np.sign(it.rudder) + 2,
        "thruster_1_error_count": count,
        "thruster_1_temp": 20 + 0.01 * it.time,
        "thruster_1_current": 2 + 0.1 * random.standard_normal(900),
        "fin_rudder_offset": 0.01 + 0 * it.time + 1e-3 * np.sign(it.rudder),
        "pwm_counter": np.arange(900.0) % 256,
        "actuator_mode": np.sign(it.rudder) + 1,
        "motor_fault_code": np.floor(5 * random.random(900)),
        "control_state": np.floor(3 * random.random(900)),
        "thruster_enabled": (it.rudder > 0).astype(float),
    }
    return write(folder / "a.csv", columns)


@case(commands="rudder")
def csv_of_pandas_with_a_velocity_of_zeros(folder, it):
    """An estimate that never ran stands before the one that did."""
    table = it.table()
    speeds = {name: table.pop(name) for name in "uvw"}
    zeros = {f"v{axis}": 0 * it.time for axis in "xyz"}
    body_speeds = {f"body_v{axis}": item for axis, item in zip("xyz", speeds.values(), strict=True)}
    return write(folder / "a.csv", {"time": table.pop("time"), **zeros, **body_speeds, **table})


@case(commands="rudder")
def parquet_of_two_velocities(folder, it):
    """Structures of pyarrow: the velocity of the world first, the one of the body behind."""
    arrow, parquet = (pytest.importorskip(f"pyarrow{tail}") for tail in ("", ".parquet"))

    def rows(block):
        return [dict(zip("xyz", row, strict=True)) for row in block.tolist()]

    table = arrow.table(
        {
            "time": it.time,
            "velocity_world": rows(it.world),
            "velocity_body": rows(it.body),
            "rpy": it.angles.tolist(),
            "angular_rate": rows(it.rates),
            "rudder": it.rudder,
        }
    )
    parquet.write_table(table, folder / "a.parquet")
    return folder / "a.parquet"


@case(commands="delta")
def matlab_of_a_velocity_along_north(folder, it):
    """The velocity along north, east, down alone, as scipy writes it."""
    arrays = {"t": it.time, "vel_ned": it.world, "rpy": it.angles, "omega": it.rates}
    savemat(folder / "a.mat", {**arrays, "delta": it.rudder, "vel_ned_ref": it.world + 0.1})
    return folder / "a.mat"


@case(
    holds="u v w p q r attitude rudder",
    commands=" ".join(f"/fin_command.vector.{axis}" for axis in "xyz"),
)
def ros2_setpoints_beside_measurements(folder, it):
    """Messages of the same types hold what a controller wants, at a higher rate."""
    bag = RosBag()
    store, time = bag.modern, it.time
    fast = np.arange(0, 90, 0.05)
    off = 0.3 * np.sin(np.outer(fast, (0.1, 0.2, 0.3)))
    bag_messages = messages(bag, store, "/controller/desired_velocity", _TWIST, fast, _twist(off))
    bag_messages += messages(bag, store, "/dvl/velocity", _TWIST, time, _twist(it.body * FLIP))
    bag_messages += messages(bag, store, "/imu", "sensor_msgs/msg/Imu", time, _imu(it))
    fins, kind = {"vector.x": it.rudder}, "geometry_msgs/msg/Vector3Stamped"
    bag_messages += messages(bag, store, "/fin_command", kind, time, fins)
    return bag.ros2(folder / "run", sorted(bag_messages, key=lambda one: one[2]))
