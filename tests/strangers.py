"""Logs as other people's writers leave them, all made from one small dive, whose truth is known.

Every case writes into a folder and returns what is given on the command line.
"""

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from writers import Dataflash, RosBag, Ulog

FLIP = np.array([1.0, -1.0, -1.0])  # turns axes with z down into those with z up, and back
EPOCH = 1716912000.0  # s, 28 May 2024, 16:00
Columns = dict[str, np.ndarray]


class Truth:
    """A minute and a half of turning, pitching and rolling; FRD over NED, by scipy's rotations."""

    def __init__(self, n=900, step=0.1):
        self.time = time = step * np.arange(n)
        self.angles = np.column_stack(
            (0.1 * np.sin(0.5 * time), 0.2 * np.sin(0.31 * time), 0.8 * np.sin(0.2 * time))
        )
        self.turns = turns = Rotation.from_euler("ZYX", self.angles[:, ::-1])
        self.body = np.column_stack(
            (
                1 + 0.5 * np.sin(0.4 * time),
                0.2 * np.sin(0.6 * time),
                0.1 * np.cos(0.5 * time) + 0.08,
            )
        )
        self.world = turns.apply(self.body)
        self.place = np.cumsum(self.world * step, axis=0) + np.array([0, 0, 5])
        steps = (turns[:-1].inv() * turns[1:]).as_rotvec() / step
        self.rates = np.vstack((steps, steps[-1:]))
        self.force = turns.inv().apply([0.0, 0.0, -9.81]) + 0.05 * np.sin(np.outer(time, (1, 2, 3)))
        self.rudder = 0.3 * np.sign(np.sin(0.3 * time))
        self.rpm = 1500 + 300 * np.sign(np.sin(0.17 * time + 1))
        waves = np.sin(np.outer(time, (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)))
        self.wrench = waves * (80, 20, 20, 3, 5, 9)
        # The same in the plane: u v r, and x y psi of a ship that stays upright.
        heading = self.angles[:, 2]
        self.flat = np.column_stack((self.body[:, :2], np.gradient(heading, step)))
        way = np.cumsum(np.exp(1j * heading) * (self.flat[:, 0] + 1j * self.flat[:, 1])) * step
        self.flat_place = np.column_stack((way.real, way.imag, heading))
        self.q_ned = turns.as_quat(scalar_first=True)  # w x y z
        swap = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
        self.q_enu = Rotation.from_matrix(swap @ turns.as_matrix() @ np.diag(FLIP)).as_quat()
        self.enu = self.place[:, [1, 0, 2]] * (1, 1, -1)

    def check(self, log):
        """Check that a log is the dive, its position too where it has one."""
        np.testing.assert_allclose(log.velocity, np.hstack((self.body, self.rates)), atol=1e-9)
        body_attitude = Rotation.from_quat(log.attitude, scalar_first=True) * self.turns.inv()
        np.testing.assert_allclose(body_attitude.magnitude(), 0, atol=1e-7)
        if log.position is not None:
            np.testing.assert_allclose(log.position, self.place, atol=1e-9)

    def roles(self, role, body):
        """Return what a role may be in axes of the body, with z down (FRD) or up (FLU)."""
        group, _, name = role.partition(".")
        turn, flat = FLIP if body == "FLU" else np.ones(3), self.flat_place
        speed = name_columns("u v w", self.body * turn) | name_columns("p q r", self.rates * turn)
        planar = name_columns("x y yaw", flat * turn) | name_columns("u v r", self.flat * turn)
        both = {"position": self.place, "velocity": self.world}
        if name.startswith("q") and group == "attitude":
            q = {"FRD": self.q_ned, "FLU": self.q_enu[:, [3, 0, 1, 2]]}[body]
            return [sign * q[:, "wxyz".index(name[1])] for sign in (1, -1)]
        if group in both and (name in "xyz" or name in ("north", "east", "down", "up", "depth")):
            north, east, down = both[group].T
            directions = {"north": north, "east": east, "up": -down, "down": down, "depth": down}
            alias = {"north": "x", "east": "y"}.get(name, "")
            here = [directions[name], *([planar[alias]] if alias and group == "position" else [])]
            return [*here, *(-item for item in here if name == "east")]
        euler = self.euler()
        heading = {"heading": self.angles[:, 2]}
        euler = {n: item * turn[k] for k, (n, item) in enumerate(euler.items())} | heading
        tau = dict(zip("XYZKMN", (self.wrench * np.tile(turn, 2)).T, strict=True))
        force = name_columns("fx fy fz", self.force * turn)
        known = {"attitude": euler, "velocity": speed, "wrench": tau, "specific_force": force}
        return [its[name] for its in (known.get(group, {}), planar) if name in its]

    def table(self, clock="time"):
        """The motion by its plain names."""
        motion = name_columns("u v w p q r", np.hstack((self.body, self.rates)))
        return {clock: self.time, **self.euler(), **motion, "rudder": self.rudder}

    def euler(self, names="roll pitch yaw", unit=1.0):
        return name_columns(names, self.angles / unit)


def name_columns(names, block):
    return dict(zip(names.split(), block.T, strict=True))


DEG = np.pi / 180


def write(path, columns, sep=",", form="%.9g"):
    """Write a table as the csv module does."""
    path.parent.mkdir(exist_ok=True)
    rows = zip(
        *(
            [item if isinstance(item, str) else form % item for item in it]
            for it in columns.values()
        ),
        strict=True,
    )
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, delimiter=sep).writerows([columns.keys(), *rows])
    return path


def clock(seconds, digits=4):
    """Return times of day."""
    width = 3 + digits if digits else 2
    return [
        f"{s // 3600 % 24:02.0f}:{s // 60 % 60:02.0f}:{s % 60:0{width}.{digits}f}" for s in seconds
    ]


@dataclass(frozen=True)
class Case:
    """A log of others, what it holds, and whether its draft alone makes the log of it."""

    write: Callable[[Path, Truth], Path | str]
    holds: str = "u v w p q r attitude rudder"
    loads: bool = True
    add: tuple[tuple[str, str], ...] = ()  # replaced in the draft where it does not load alone
    says: str = ""  # in the draft, where it does not
    apart: str = ""  # roles that are of another motion than the truth's
    tolerance: float = 0.02
    commands: str | None = None  # the columns that may be drafted as commands
    lacks: str = ""  # velocities that its log must not have


CASES = {}


def case(holds="u v w p q r attitude rudder", **more):
    def keep(function):
        CASES[function.__name__] = Case(function, holds, **more)
        return function

    return keep


@case()
def csv_with_units_in_names(folder, it):
    angles = it.euler("roll_deg pitch_deg yaw_deg", DEG)
    rates = name_columns("p_degs q_degs r_degs", it.rates / DEG)
    columns = {"time_s": it.time, **angles, **name_columns("u v w", it.body), **rates}
    return write(folder / "a.csv", {**columns, "rudder_cmd": it.rudder})


@case()
def csv_of_a_spreadsheet_with_decimal_commas(folder, it):
    columns = {"Time [ms]": 1000 * it.time, **it.euler("Roll[°] Pitch[°] Yaw[°]", DEG)}
    columns |= name_columns("Surge[kn] Sway[kn] Heave[kn]", it.body / 0.514444444)
    columns |= name_columns("RollRate[°/s] PitchRate[°/s] YawRate[°/s]", it.rates / DEG)
    path = write(folder / "a.csv", {**columns, "Rudder[°]": it.rudder / DEG}, ";")
    path.write_text(path.read_text("utf-8").replace(".", ","), "utf-8")
    return path


@case(holds="u v w p q r attitude rudder position")
def savetxt_of_a_simulator(folder, it):
    names = "t x y z phi theta psi u v w p q r delta"
    block = np.column_stack((it.time, it.place, it.angles, it.body, it.rates, it.rudder))
    np.savetxt(folder / "a.txt", block, header=names)
    return folder / "a.txt"


def ros_odometry(it, sep=".", pose="pose.pose", twist="twist.twist"):
    columns = (
        (f"{pose}.position", "xyz", it.enu),
        (f"{pose}.orientation", "xyzw", it.q_enu),
        (f"{twist}.linear", "xyz", it.body * FLIP),
        (f"{twist}.angular", "xyz", it.rates * FLIP),
    )
    return {
        f"{stem}.{name}".replace(".", sep): column
        for stem, names, block in columns
        for name, column in zip(names, block.T, strict=True)
    }


def late(time):
    """Return when messages arrive: in bursts of five, a fifth of a second late and more."""
    return time + 0.2 + 0.1 * (4 - np.arange(len(time)) % 5) + 1e-4 * np.arange(len(time))


@case(holds="u v w p q r attitude position rudder")
def csv_of_rostopic_echo(folder, it):
    """Arrival in bursts beside the stamps of the header, nanoseconds both."""
    stamp, zeros = (EPOCH + it.time) * 1e9, 0 * it.time
    odometry = {f"field.{name}": values for name, values in ros_odometry(it).items()}
    head = {"field.header.seq": zeros + np.arange(900), "field.header.stamp": stamp}
    more = {"field.pose.covariance0": zeros + 0.1, "field.pose.covariance7": zeros + 0.1}
    arrived = (EPOCH + late(it.time)) * 1e9
    run = folder / "run"
    write(run / "odom.csv", {"%time": arrived, **head, **odometry, **more}, form="%.18g")
    fins = {"field.header.stamp": stamp, "field.rudder": it.rudder}
    write(run / "fins.csv", {"%time": arrived, **fins}, form="%.18g")
    return run


@case()
def csv_of_bagpy(folder, it):
    """Header stamps in two columns, two files of one run."""
    stamp = EPOCH + it.time
    head = {"header.stamp.secs": stamp // 1, "header.stamp.nsecs": (it.time % 1 * 1e9).round()}
    odometry = {name: item for name, item in ros_odometry(it).items() if "position" not in name}
    arrived = EPOCH + late(it.time)
    write(folder / "d1-odom.csv", {"Time": arrived, **head, **odometry}, form="%.17g")
    write(folder / "d1-fin_cmd.csv", {"Time": arrived, **head, "data": it.rudder}, form="%.17g")
    return f"{folder / 'd1-odom.csv'}+{folder / 'd1-fin_cmd.csv'}"


@case(holds="u v w p q r attitude position rudder")
def csv_of_plotjuggler(folder, it):
    """All topics on one clock, a row a message, empty where the others speak."""
    odometry = ros_odometry(it, "/")
    rows, blank = 2 * len(it.time), [""] * len(it.time)
    time = np.sort(np.concatenate((it.time, it.time + 0.03))) + EPOCH
    columns = {"__time": [f"{item:.6f}" for item in time]}
    for name, values in odometry.items():
        columns[f"/odom/{name}"] = [
            x for pair in zip(map(repr, values.tolist()), blank, strict=True) for x in pair
        ]
    columns["/fins/rudder"] = [
        x for pair in zip(blank, map(repr, it.rudder.tolist()), strict=True) for x in pair
    ]
    assert len(columns["/fins/rudder"]) == rows
    return write(folder / "a.csv", columns)


def odometry_messages(bag, store, it, topic="/odometry"):
    kind, columns = "nav_msgs/msg/Odometry", ros_odometry(it)
    return messages(bag, store, topic, kind, it.time, columns)


def messages(bag, store, topic, kind, time, columns):
    """Return topic, type, arrival and message for each row; the header is stamped earlier."""
    arrived = late(time)
    return [
        (topic, kind, EPOCH + arrived[k], message(bag, store, kind, EPOCH + time[k], row))
        for k, row in enumerate(
            [
                dict(zip(columns, values, strict=True))
                for values in zip(*columns.values(), strict=True)
            ]
        )
    ]


def message(bag, store, kind, stamp, row, path=""):
    """Return a message of any type with the numbers given by their paths, zero elsewhere."""
    given = {}
    for field_name, (node, detail) in store.fielddefs[kind][1]:
        here = f"{path}.{field_name}" if path else field_name
        if int(node) == 2:
            is_time = detail.endswith("/Time")
            given[field_name] = (
                bag.stamp(stamp, store)
                if is_time
                else message(bag, store, detail, stamp, row, here)
            )
        elif int(node) == 1:
            given[field_name] = (
                "" if detail[0] == "string" else type_of(detail[0])(row.get(here, 0))
            )
        else:
            (inner, about), length = detail
            if int(inner) == 2:
                given[field_name] = []
            else:
                values = [row[f"{here}[{k}]"] for k in range(64) if f"{here}[{k}]" in row]
                given[field_name] = np.array(values or [0] * length, dtype=about[0])
    return store.types[kind](**given)


def type_of(name):
    return float if name.startswith("float") else bool if name == "bool" else int


@case(holds="u v w p q r attitude position rudder")
def ros2_odometry_and_fins(folder, it):
    bag = RosBag()
    store, fins = bag.modern, {"vector.x": it.rudder}
    bag_messages = odometry_messages(bag, store, it)
    bag_messages += messages(
        bag, store, "/fin_command", "geometry_msgs/msg/Vector3Stamped", it.time, fins
    )
    return bag.ros2(folder / "run", sorted(bag_messages, key=lambda one: one[2]))


@case(holds="u v w p q r attitude position wrench")
def ros1_odometry_and_wrench(folder, it):
    bag = RosBag()
    store, kind = bag.noetic, "geometry_msgs/msg/WrenchStamped"
    names = " ".join(f"wrench.{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz")
    wrench = name_columns(names, it.wrench * np.tile(FLIP, 2))
    bag_messages = odometry_messages(bag, store, it) + messages(
        bag, store, "/rov/thrust_manager/tau", kind, it.time, wrench
    )
    return bag.ros1(folder / "run.bag", sorted(bag_messages, key=lambda one: one[2]))


@case(holds="u v w p q r attitude port")
def ros2_dvl_imu_and_pulse_widths(folder, it):
    bag = RosBag()
    store, time = bag.modern, it.time
    speed = name_columns("twist.linear.x twist.linear.y twist.linear.z", it.body * FLIP)
    imu = name_columns("angular_velocity.x angular_velocity.y angular_velocity.z", it.rates * FLIP)
    imu |= name_columns("orientation.x orientation.y orientation.z orientation.w", it.q_enu)
    imu |= name_columns(
        "linear_acceleration.x linear_acceleration.y linear_acceleration.z", it.force * FLIP
    )
    pwm = {
        "data[0]": 1500 + 400 * np.sign(it.rudder),
        "data[1]": 1500 + 0 * time,
        "data[2]": 0 * time,
    }
    bag_messages = messages(bag, store, "/dvl/twist", "geometry_msgs/msg/TwistStamped", time, speed)
    bag_messages += messages(bag, store, "/imu", "sensor_msgs/msg/Imu", time, imu)
    bag_messages += messages(bag, store, "/pwm", "std_msgs/msg/UInt16MultiArray", time, pwm)
    return bag.ros2(folder / "run", sorted(bag_messages, key=lambda one: one[2]), "SQLITE3")


@case(holds="u v w p q r attitude position stick", tolerance=0.1)
def ros1_mocap_pose_and_joystick(folder, it):
    """A pose alone: velocities come from it."""
    bag = RosBag()
    store = bag.noetic
    pose = {n: item for n, item in ros_odometry(it, pose="pose").items() if n.startswith("pose")}
    joy = {"axes[0]": it.rudder / 0.3, "axes[1]": np.sin(0.7 * it.time), "axes[2]": 0 * it.time}
    bag_messages = messages(
        bag, store, "/vrpn/rov/pose", "geometry_msgs/msg/PoseStamped", it.time, pose
    )
    bag_messages += messages(bag, store, "/joy", "sensor_msgs/msg/Joy", it.time, joy)
    return bag.ros1(folder / "run.bag", sorted(bag_messages, key=lambda one: one[2]))


@case(holds="u v w p q r attitude position thrust")
def ardupilot_binary(folder, it):
    log = Dataflash()
    log.define(140, "ATT", "QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF")
    log.define(141, "IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    log.define(142, "XKF1", "QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD")
    log.define(143, "RCOU", "QHHHH", "TimeUS,C1,C2,C3,C4")
    for k, time in enumerate((1e6 * (it.time + 5)).astype(int).tolist()):
        roll, pitch, yaw = (it.angles[k] / DEG).tolist()
        log.write_message("ATT", time, 0.0, roll, 0.0, pitch, 0.0, yaw % 360, 3)
        log.write_message("IMU", time, 0, *it.rates[k].tolist(), *it.force[k].tolist())
        log.write_message(
            "XKF1", time, 0, *it.world[k].tolist(), *(it.place[k] - it.place[0]).tolist()
        )
        log.write_message("RCOU", time, 1500 + round(1000 * it.rudder[k]), 1500, 0, 0)
    return log.save(folder / "00000012.BIN")


@case(holds="u v w attitude p q r thrust", tolerance=0.05)
def ardupilot_text(folder, it):
    lines = ["FMT, 140, 30, ATT, Qfff, TimeUS,Roll,Pitch,Yaw"]
    lines += ["FMT, 142, 30, XKF1, QBffffff, TimeUS,C,VN,VE,VD,PN,PE,PD"]
    lines += ["FMT, 143, 15, RCOU, QHH, TimeUS,C1,C2"]
    for k, time in enumerate((1e6 * it.time).astype(int).tolist()):
        roll, pitch, yaw = (it.angles[k] / DEG).tolist()
        lines.append(f"ATT, {time}, {roll:.5f}, {pitch:.5f}, {yaw:.5f}")
        numbers = ", ".join(f"{item:.5f}" for item in (*it.world[k], *it.place[k]))
        lines += [f"XKF1, {time}, 0, {numbers}"]
        lines.append(f"RCOU, {time}, {1500 + round(1000 * it.rudder[k])}, 1500")
    (folder / "a.log").write_text("\n".join(lines), "utf-8")
    return folder / "a.log"


@case(holds="u v w p q r attitude position wrench")
def matlab_of_a_thesis(folder, it):
    """Vectors of six: eta, nu and tau."""
    eta, nu = np.hstack((it.place, it.angles)), np.hstack((it.body, it.rates))
    savemat(folder / "a.mat", {"t": it.time, "eta": eta, "nu": nu, "tau": it.wrench, "m": 31.0})
    return folder / "a.mat"


@case()
def matlab_structure_in_degrees(folder, it):
    log = {"time": it.time, "vel": name_columns("u v w", it.body), "rpm": it.rpm}
    log |= {
        "att": it.euler(unit=DEG),
        "gyro": name_columns("p q r", it.rates / DEG),
        "rudder": it.rudder,
    }
    savemat(folder / "a.mat", {"log": log})
    return folder / "a.mat"


@case(holds="u v r attitude position rudder")
def matlab_of_a_ship_with_its_simulation(folder, it):
    """Measured arrays beside a simulation of more of them, each on a clock of its own."""
    fine = np.arange(0, 90, 0.02)
    sims = {
        f"{name}_sim": 0.5 * np.sin(k * fine)
        for k, name in enumerate(("x", "y", "psi", "u", "v", "r", "delta"), 1)
    }
    measured = {"time": it.time, "delta": it.rudder}
    measured |= name_columns("x y psi", it.flat_place) | name_columns("u v r", it.flat)
    savemat(folder / "a.mat", {**measured, "time_sim": fine, **sims})
    return folder / "a.mat"


@case(holds="u v r attitude position wrench", tolerance=0.05)
def matlab_of_a_planar_thesis(folder, it):
    """Vectors of three: a ship in the plane."""
    tau = it.wrench * (1, 1, 0, 0, 0, 1)
    block = {"eta": it.flat_place, "nu": it.flat, "tau": tau[:, [0, 1, 5]]}
    savemat(folder / "a.mat", {"t": it.time, **block})
    return folder / "a.mat"


@case(holds="u v w p q r attitude rpm")
def hdf5_of_sensors(folder, it):
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / "a.h5", "w") as file:
        for stem, columns in {
            "imu": {"gyro": it.rates, "accel": it.force},
            "dvl": {"velocity": it.body},
            "ahrs": it.euler(unit=DEG),
            "motor": {"rpm": it.rpm},
        }.items():
            file[f"{stem}/time"] = EPOCH + it.time
            for name, values in columns.items():
                file[f"{stem}/{name}"] = values
    return folder / "a.h5"


@case(holds="u v w p q r attitude position rudder")
def parquet_of_pyarrow(folder, it):
    """Nested structures and time stamps of nanoseconds."""
    arrow, parquet = (pytest.importorskip(f"pyarrow{tail}") for tail in ("", ".parquet"))
    rows = [
        {
            "stamp": round((EPOCH + t) * 1e9),
            "position": dict(zip("xyz", position, strict=True)),
            "rpy": angles,
            "velocity": {
                "linear": dict(zip("xyz", body, strict=True)),
                "angular": dict(zip("xyz", rates, strict=True)),
            },
            "rudder": rudder,
        }
        for t, position, angles, body, rates, rudder in zip(
            *(
                item.tolist()
                for item in (it.time, it.place, it.angles, it.body, it.rates, it.rudder)
            ),
            strict=True,
        )
    ]
    table = arrow.Table.from_pylist(rows)
    stamp = table["stamp"].cast(arrow.timestamp("ns"))
    parquet.write_table(table.set_column(0, "stamp", stamp), folder / "a.parquet")
    return folder / "a.parquet"


@case()
def table_of_labview(folder, it):
    """Tabs, times of day, units in brackets, words among the columns."""
    columns = {"Time": clock(86340 + it.time)}
    columns |= it.euler("Roll(deg) Pitch(deg) Heading(deg)", DEG)
    columns["Heading(deg)"] = columns["Heading(deg)"] % 360
    columns |= name_columns("Vx(m/s) Vy(m/s) Vz(m/s)", it.body)
    columns |= name_columns("GyroX(deg/s) GyroY(deg/s) GyroZ(deg/s)", it.rates / DEG)
    columns |= {"Rudder(deg)": it.rudder / DEG, "Mode": ["AUTO"] * 900}
    return write(folder / "a.txt", columns, "\t")


@case()
def date_and_time_of_a_logger(folder, it):
    columns = {"Date": ["05/28/2024"] * 900, "Time": clock(57600 + it.time, 3)}
    columns |= it.euler("Roll Pitch Yaw", DEG) | name_columns("u v w", it.body)
    columns |= name_columns("RollRate PitchRate YawRate", it.rates / DEG)
    return write(folder / "a.csv", {**columns, "Rudder": it.rudder})


@case()
def npz_of_unnamed_arrays(folder, it):
    """Six velocities in one array, angles in another."""
    both = np.hstack((it.body, it.rates))
    np.savez(folder / "a.npz", time=it.time, velocities=both, attitude=it.angles, rudder=it.rudder)
    return folder / "a.npz"


@case()
def npz_whose_clock_stops(folder, it):
    """The array of the time is shorter than all others."""
    np.savez(folder / "a.npz", **{**it.table("t"), "t": it.time[:500]})
    return folder / "a.npz"


@case(loads=False, add=(("rate: HERTZ", "rate: 10"),), says="rate: HERTZ")
def npz_without_a_clock(folder, it):
    both = np.hstack((it.body, it.rates))
    np.savez(folder / "a.npz", nu=both, rpy=it.angles, rudder=it.rudder)
    return folder / "a.npz"


@case(holds="u v w p q r attitude position port", tolerance=0.1)
def motion_capture_beside_pulse_widths(folder, it):
    """Millimetres and degrees, a frame counter; a file of thrusters beside it. z is up."""
    flip = np.array([1.0, -1.0, -1.0])
    columns = {"Frame": np.arange(900.0), "Time": it.time}
    columns |= name_columns("X_mm Y_mm Z_mm", it.place * flip * 1000)
    columns |= name_columns("Roll_deg Pitch_deg Yaw_deg", it.angles * flip / DEG)
    write(folder / "t07_mocap.tsv", columns, "\t")
    pwm = {
        "time": it.time[::2],
        "ch1_pwm": 1500 + 400 * np.sign(it.rudder[::2]),
        "ch2_pwm": 1500 + 0 * it.time[::2],
    }
    write(folder / "t07_thrusters.csv", pwm)
    return f"{folder / 't07_mocap.tsv'}+{folder / 't07_thrusters.csv'}"


@case(holds="u v w p q r attitude position port", tolerance=0.1)
def csv_of_a_pose_and_numbered_motors(folder, it):
    """A quaternion and a place, pulse widths that no word tells, and a battery."""
    columns = {"timestamp": (EPOCH + it.time) * 1e3, **name_columns("qw qx qy qz", it.q_ned)}
    columns |= name_columns("x y z", it.place)
    motors = {f"m{k}": 1500 + 200 * k * it.rudder for k in range(1, 5)}
    battery = {"battery_voltage": 16 - 0.001 * it.time, "depth": it.place[:, 2]}
    return write(folder / "a.csv", {**columns, **motors, **battery}, form="%.15g")


@case(holds="u v w p q r attitude", tolerance=0.1)
def csv_of_a_ship_beside_its_thrusters(folder, it):
    """Heading, heel and trim; in the other file thrusters that are called by what they turn."""
    pose = {"t": it.time, **it.euler("Heel[deg] Trim[deg] Heading[deg]", DEG)}
    pressure = {"P [bar]": 1 + 0.1 * it.place[:, 2], "max_roll": 3 + 0 * it.time}
    write(folder / "run3_pose.csv", pose | name_columns("u v w", it.body) | pressure)
    thrust = {"thr_yaw": it.rudder, "thr_surge": it.rpm / 1500 - 1, "yaw_pwm": 1500 + it.rpm / 9}
    write(folder / "run3_commands.csv", {"t": it.time, **thrust, "trim": 1500 + 900 * it.rudder})
    return f"{folder / 'run3_pose.csv'}+{folder / 'run3_commands.csv'}"


@case(holds="u v w")
def csv_of_a_heading_alone(folder, it):
    """Heave, and no roll and pitch: level is assumed, and said."""
    heading = {"heading_deg": it.angles[:, 2] / DEG, "yaw": 1500 + 500 * it.rudder}
    return write(folder / "a.csv", {"t": it.time, **heading, **name_columns("u v w", it.body)})


@case(tolerance=0.1)
def csv_of_a_slow_doppler_log(folder, it):
    """A velocity twice a second in rows of ten, blank between."""
    slow = {
        n: [repr(x) if k % 5 == 0 else "" for k, x in enumerate(item.tolist())]
        for n, item in name_columns("u v w", it.body).items()
    }
    return write(folder / "a.csv", {**it.table("t"), **slow})


@case(tolerance=0.1)
def csv_of_a_dead_gyro(folder, it):
    """Rates that say nothing while the attitude turns: they come from it."""
    dead = name_columns("p q r", 1e-8 * np.sin(it.rates * 1e3))
    return write(folder / "a.csv", {**it.table("t"), **dead})


@case()
def csv_of_mavlink(folder, it):
    """Names of messages, velocities along north, east, down, servos by number."""
    stem = "LOCAL_POSITION_NED."
    columns = {
        "timestamp": EPOCH + it.time,
        **name_columns("ATT.roll ATT.pitch ATT.yaw", it.angles),
    }
    columns |= name_columns("ATT.rollspeed ATT.pitchspeed ATT.yawspeed", it.rates)
    columns |= name_columns(f"{stem}vx {stem}vy {stem}vz", it.world)
    servo = {"SERVO_OUTPUT_RAW.servo1_raw": 1500 + 1000 * it.rudder}
    return write(folder / "a.csv", {**columns, **servo}, form="%.15g")


@case(holds="u v r attitude position rudder rpm")
def csv_of_a_surface_boat(folder, it):
    columns = {
        "t": it.time,
        **name_columns("x y psi", it.flat_place),
        **name_columns("u v r", it.flat),
    }
    return write(folder / "a.csv", {**columns, "delta": it.rudder, "n": it.rpm / 60})


@case(tolerance=0.05)
def csv_of_a_coarse_clock(folder, it):
    """Stamps of whole seconds at ten rows a second."""
    return write(folder / "a.csv", {**it.table(), "time": np.floor(it.time + 1e-9)})


@case(holds="u v rudder", tolerance=0.1, apart="attitude velocity")
def csv_of_ground_speed_without_the_vertical(folder, it):
    """North and east alone beside roll and pitch: level is assumed, and said."""
    angles = 0.2 * it.angles[:, :2]
    turns = Rotation.from_euler("ZYX", np.column_stack((it.angles[:, 2], angles[:, ::-1])))
    north, east, _ = turns.apply(it.body * (1, 1, 0)).T
    columns = {"time": it.time, "roll": angles[:, 0], "pitch": angles[:, 1], "yaw": it.angles[:, 2]}
    return write(
        folder / "a.csv", {**columns, "vel_north": north, "vel_east": east, "rudder": it.rudder}
    )


@case(holds="u v w p q r attitude position rudder")
def csv_with_z_up_beside_a_depth(folder, it):
    columns = it.table() | name_columns("roll pitch yaw", it.angles * FLIP)
    columns |= name_columns("u v w", it.body * FLIP) | name_columns("p q r", it.rates * FLIP)
    return write(folder / "a.csv", {**columns, "depth": it.place[:, 2]})


@case(loads=False, says="no line of column names")
def numbers_without_names(folder, it):
    np.savetxt(folder / "a.dat", np.column_stack((it.time, it.body, it.rates, it.angles)))
    return folder / "a.dat"


@case(holds="u v w small rudder", apart="attitude velocity.p velocity.q velocity.r")
def csv_of_small_angles_in_degrees(folder, it):
    """Angles of a few degrees and rates of a few degrees a second, no unit anywhere."""
    angles = it.angles * (1, 0.4, 0.13)
    turns = Rotation.from_euler("ZYX", angles[:, ::-1])
    steps = (turns[:-1].inv() * turns[1:]).as_rotvec() / 0.1
    columns = {
        "time": it.time,
        **name_columns("roll pitch yaw", angles / DEG),
        **name_columns("u v w", it.body),
    }
    columns |= name_columns("gyro_x gyro_y gyro_z", np.vstack((steps, steps[-1:])))
    return write(folder / "a.csv", {**columns, "rudder": it.rudder})


@case(holds="u v w p q r attitude")
def npz_of_a_quaternion_of_unsaid_order(folder, it):
    """x y z w, as ROS has it; nothing says so."""
    pose = it.turns.as_quat()
    np.savez(folder / "a.npz", time=it.time, vel=it.body, gyro=it.rates, quat=pose, fin=it.rudder)
    return folder / "a.npz"


@case()
def csv_of_many_sticks(folder, it):
    """Sixteen channels of a remote control, most of them still."""
    columns = it.table("timestamp") | {"timestamp": EPOCH + it.time}
    del columns["rudder"]
    sticks = {f"rc_channels[{k}]": 1500 + 0 * it.time for k in range(16)}
    sticks["rc_channels[3]"] = 1500 + 1000 * it.rudder
    return write(folder / "a.csv", {**columns, **sticks}, form="%.15g")


@case(loads=False, add=(("rate: HERTZ", "rate: 10"),), says="rate: HERTZ")
def csv_of_pandas_with_an_index_alone(folder, it):
    """The index of the table is no clock: its rate must be said."""
    return write(folder / "a.csv", it.table("") | {"": np.arange(900.0)})


@case(holds="", loads=False, says="velocity")
def moos_log_of_speed_alone(folder, it):
    lines = ["%% LOGSTART 1716912000"]
    for k, time in enumerate(it.time.tolist()):
        lines += [f"{time:.3f} NAV_HEADING pNav {it.angles[k, 2] / DEG % 360:.4f}"]
        lines += [f"{time:.3f} NAV_SPEED pNav {it.body[k, 0]:.4f}"]
        lines += [f"{time:.3f} DESIRED_RUDDER pHelm {it.rudder[k] / DEG:.4f}"]
    (folder / "a.alog").write_text("\n".join(lines), "utf-8")
    return folder / "a.alog"


@case(holds="u v w p q r attitude position rudder")
def ulog_of_px4(folder, it):
    log, turning = Ulog(), np.outer(it.rudder, (0, 0, 1))
    moving = np.column_stack((it.place, it.world)).tolist()
    topics = {
        "vehicle_attitude": ("float[4] q", "4f", it.q_ned.tolist()),
        "vehicle_local_position": (
            "float x;float y;float z;float vx;float vy;float vz;bool v_xy_valid",
            "6f?",
            [[*row, True] for row in moving],
        ),
        "vehicle_angular_velocity": ("float[3] xyz", "3f", it.rates.tolist()),
        "vehicle_torque_setpoint": ("float[3] xyz", "3f", turning.tolist()),
    }
    for name, (fields, *_) in topics.items():
        log.define(name, fields)
    for number, name in enumerate(topics):
        log.announce(number, name)
    for k, second in enumerate((it.time + 20).tolist()):
        for number, (_, kinds, rows) in enumerate(topics.values()):
            log.send(number, round(1e6 * second), kinds, *rows[k])
    return log.save(folder / "a.ulg")
