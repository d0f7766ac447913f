"""Logs as other people's writers leave them, all made from one small dive, whose truth is known.

strangers.toml lists those that are columns alone; every case writes into a folder and returns what
is given on the command line.
"""

import csv
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from writers import Dataflash, RosBag, Ulog

FLIP = np.array([1.0, -1.0, -1.0])  # turns axes with z down into those with z up, and back


EPOCH = 1716912000.0  # s, 28 May 2024, 16:00


class Truth:
    """A minute and a half of turning, pitching and rolling; FRD over NED, by scipy's rotations."""

    def __init__(self, n=900, step=0.1):
        self.time = time = step * np.arange(n)
        self.angles = np.sin(np.outer(time, (0.5, 0.31, 0.2))) * (0.1, 0.2, 0.8)
        self.turns = turns = turned(self.angles)
        waves = np.sin(0.4 * time), np.sin(0.6 * time), np.cos(0.5 * time)
        self.body = np.column_stack(waves) * (0.5, 0.2, 0.1) + (1.0, 0.0, 0.08)
        self.world = turns.apply(self.body)
        self.place = np.cumsum(self.world * step, axis=0) + np.array([0, 0, 5])
        self.rates = rates_of(turns, step)
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
        self.enu = in_enu(self.place)

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


def turned(angles):
    return Rotation.from_euler("ZYX", angles[:, ::-1])


def rates_of(turns, step=0.1):
    steps = (turns[:-1].inv() * turns[1:]).as_rotvec() / step
    return np.vstack((steps, steps[-1:]))


def in_enu(ned):
    return ned[:, [1, 0, 2]] * (1, 1, -1)


def name_columns(names, block):
    return dict(zip(names.split(), block.T, strict=True))


DEG = np.pi / 180


def write(path, columns, sep=",", form="%.9g"):
    """Write a table as the csv module does, with decimal commas where semicolons separate."""
    path.parent.mkdir(exist_ok=True)
    cells = ([x if isinstance(x, str) else form % x for x in it] for it in columns.values())
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, delimiter=sep).writerows([columns.keys(), *zip(*cells, strict=True)])
    if sep == ";":
        path.write_text(path.read_text("utf-8").replace(".", ","), "utf-8")
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
def csv_of_plotjuggler(folder, it):
    """All topics on one clock, a row a message, empty where the others speak."""
    odometry = ros_odometry(it, "/")
    time = np.sort(np.concatenate((it.time, it.time + 0.03))) + EPOCH
    columns = {"__time": [f"{item:.6f}" for item in time]}
    rows = {f"/odom/{name}": (values, 0) for name, values in odometry.items()}
    for name, (values, first) in (rows | {"/fins/rudder": (it.rudder, 1)}).items():
        columns[name] = [""] * 1800
        columns[name][first::2] = map(repr, values.tolist())
    return write(folder / "a.csv", columns)


def messages(bag, store, topic, kind, time, columns):
    """Return topic, type, arrival and message for each row; the header is stamped earlier."""
    cells = zip(*columns.values(), strict=True)
    rows = (dict(zip(columns, row, strict=True)) for row in cells)
    return [
        (topic, kind, EPOCH + at, message(bag, store, kind, EPOCH + second, row))
        for at, second, row in zip(late(time), time, rows, strict=True)
    ]


def message(bag, store, kind, stamp, row, path=""):
    """Return a message of any type with the numbers given by their paths, zero elsewhere."""
    given = {}
    for name, (node, detail) in store.fielddefs[kind][1]:
        here = f"{path}.{name}" if path else name
        if int(node) == 2:
            is_time = detail.endswith("/Time")
            inner = () if is_time else (bag, store, detail, stamp, row, here)
            given[name] = bag.stamp(stamp, store) if is_time else message(*inner)
        elif int(node) == 1:
            given[name] = "" if detail[0] == "string" else type_of(detail[0])(row.get(here, 0))
        elif int(detail[0][0]) == 2:
            given[name] = []
        else:
            values = [row[f"{here}[{k}]"] for k in range(64) if f"{here}[{k}]" in row]
            given[name] = np.array(values or [0] * detail[1], dtype=detail[0][1][0])
    return store.types[kind](**given)


def type_of(name):
    return float if name.startswith("float") else bool if name == "bool" else int


def odometry_messages(bag, store, it, topic="/odometry"):
    return messages(bag, store, topic, "nav_msgs/msg/Odometry", it.time, ros_odometry(it))


def twist(block):
    return name_columns("twist.linear.x twist.linear.y twist.linear.z", block)


def imu(it):
    columns = {"angular_velocity": it.rates * FLIP, "linear_acceleration": it.force * FLIP}
    columns |= {"orientation": it.q_enu}
    return {f"{n}.{c}": x for n, b in columns.items() for c, x in zip("xyzw", b.T, strict=False)}


def xyz(block):
    """Return rows as structures."""
    return [dict(zip("xyz", row, strict=True)) for row in block.tolist()]


def evaluate(it, expressions):
    """Return the columns that expressions on the dive give; none for None."""
    columns, scope = {}, {**globals(), **vars(it), "it": it, "random": np.random.default_rng(34)}
    for name, text in expressions.items():
        value = eval(text, scope)
        if value is None:
            del columns[name]
        elif isinstance(value, dict):
            columns |= {name + key: item for key, item in value.items()}
        elif " " in name and np.ndim(value) == 2:
            columns |= name_columns(name, value)
        else:
            columns[name] = value
    return columns


def write_columns(path, columns, sep=",", form="%.17g"):
    """Write columns in the format of the name."""
    if path.suffix == ".mat":
        savemat(path, columns)
    elif path.suffix == ".npz":
        np.savez(path, **columns)
    elif path.suffix == ".npy":
        np.save(path, np.rec.fromarrays([*columns.values()], names=[*columns]))
    elif path.suffix == ".h5":
        with pytest.importorskip("h5py").File(path, "w") as file:
            file.update(columns)
    elif path.suffix == ".parquet":
        arrow, parquet = (pytest.importorskip(f"pyarrow{tail}") for tail in ("", ".parquet"))
        rows = {name: [*values] for name, values in columns.items()}
        parquet.write_table(arrow.table(rows), path)
    else:
        write(path, columns, "\t" if path.suffix == ".tsv" else sep, form)
    return path


def write_files(files, sep, form, folder, it):
    paths = [
        write_columns(folder / name, evaluate(it, item), sep, form) for name, item in files.items()
    ]
    return paths[0].parent if "/" in min(files) else "+".join(map(str, paths))


def write_bag(topics, kind, folder, it):
    bag, sent = RosBag(), []
    store = bag.noetic if kind == "ROS1" else bag.modern
    for topic, expressions in topics.items():
        columns = evaluate(it, expressions)
        time = columns.pop("@", it.time)
        sent += messages(bag, store, *topic.split(), time, columns)
    sent.sort(key=lambda one: one[2])
    if kind == "ROS1":
        return bag.ros1(folder / "run.bag", sent)
    return bag.ros2(folder / "run", sent, kind)


with Path(__file__).with_suffix(".toml").open("rb") as listed:
    for name, entry in tomllib.load(listed).items():
        files, sep = entry.pop("files"), entry.pop("sep", ",")
        form, kind = entry.pop("form", "%.9g"), entry.pop("bag", None)
        tell = partial(write_bag, files, kind) if kind else partial(write_files, files, sep, form)
        CASES[name] = Case(tell, **entry)

ros1_odometry_and_wrench = CASES["ros1_odometry_and_wrench"].write


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


@case(loads=False, says="no line of column names")
def numbers_without_names(folder, it):
    np.savetxt(folder / "a.dat", np.column_stack((it.time, it.body, it.rates, it.angles)))
    return folder / "a.dat"


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


@case(holds="u v w p q r attitude position wrench", commands="")
def csv_of_matlab_elements_without_quotes(folder, it):
    """The same header as fprintf writes it: no cell is quoted."""
    path = Path(CASES["csv_of_matlab_elements"].write(folder, it))
    path.write_text(path.read_text("utf-8").replace('"', ""), "utf-8")
    return path
