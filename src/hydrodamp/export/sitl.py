"""ArduPilot SITL: the Python file as a server of the JSON interface, driven by servo outputs."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.errors import MethodError, VehicleError, demand, no_such
from hydrodamp.export.codegen import render_template, template_values, vehicle_identifier
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.scripts import Python, execute_module
from hydrodamp.export.target import Files
from hydrodamp.export.verification import MAX_STEP, Engine
from hydrodamp.simulation.replay import DIVERGENCE_LIMIT
from hydrodamp.vehicle.mass import STANDARD_GRAVITY

WATER_DENSITY = 1000.0  # kg/m^3; determines the height over which the buoyancy ends at the surface
MAX_SERVO = 32

_FRAMES = tomllib.loads(Path(__file__).with_name("ardusub_frames.toml").read_text("utf-8"))
#: Degrees of freedom by the names of ArduSub, in the order and with the sign of X Y Z K M N.
_AXES = {"forward": 1.0, "lateral": 1.0, "throttle": -1.0, "roll": 1.0, "pitch": 1.0, "yaw": 1.0}


class Channel(NamedTuple):
    """An input of the model and what drives it; ``half`` is its change from 1500 to 1900 us."""

    command: str
    idle: float
    middle: float
    half: float
    servos: tuple[tuple[int, float], ...]


@dataclass(frozen=True)
class SITL(Python):
    """A server of ArduPilot's JSON interface: one Python file that needs NumPy only.

    Parameters
    ----------
    frame : str
        Frame of ArduSub, such as ``"vectored"``. Without ``servos``, each motor drives the command
        that pushes the vehicle in its direction.
    servos : str
        Entries ``SOURCE:COMMAND`` or ``SOURCE:COMMAND:LOW:HIGH``, separated by commas. The source
        is the number of a servo output, or a degree of freedom of the frame (``forward``,
        ``lateral``, ``throttle``, ``roll``, ``pitch``, ``yaw``); LOW and HIGH are the command at
        1100 and 1900 us. By default the outputs drive the commands in their order.
    pulse_range : str
        ``LOW:HIGH`` of the commands whose entry does not have them.
    """

    key: ClassVar[str] = "sitl"
    description: ClassVar[str] = "ArduPilot SITL, JSON interface"
    frame: str = ""
    servos: str = ""
    pulse_range: str = ""

    def __post_init__(self) -> None:
        """Check the frame and the range."""
        if self.frame and self.frame not in _FRAMES:
            raise MethodError(no_such("frame", self.frame, _FRAMES))
        if self.pulse_range:
            _read_range(self.pulse_range.split(":"), "pulse_range")

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the file: the target ``python``, and the server."""
        vehicle, name = plant.vehicle, vehicle_identifier(plant)
        volume = vehicle.buoyancy / (WATER_DENSITY * STANDARD_GRAVITY) * ("Z" in vehicle.axes)
        values = {
            "channels_of_servos": self.map_servos(plant),
            "buoyancy": vehicle.buoyancy,
            "center": vehicle.center_of_buoyancy.tolist(),
            "side": float(np.cbrt(volume)),
            "max_step": MAX_STEP,
            "limit": DIVERGENCE_LIMIT,
        }
        return {f"{name}.py": render_template("sitl.py.j2", **template_values(plant), **values)}

    def map_servos(self, plant: ExportedPlant) -> list[Channel]:
        """Return what drives each input of a plant."""
        inputs = plant.inputs
        if not inputs:
            raise VehicleError(
                f"'{plant.vehicle.name}' has no actuators, and its damping no gains of commands, "
                "that a servo could drive: add `actuators` to the vehicle file, or identify a "
                "model with terms of commands."
            )
        default = (f"{number}:{name}" for number, name in enumerate(inputs, 1))
        entries = [text.split(":") for text in (self.servos or ",".join(default)).split(",")]
        if self.frame and not self.servos:
            entries = self._match_motors(plant)
        channels: dict[str, Channel] = {}
        for source, *words in ([word.strip() for word in entry] for entry in entries):
            command, *values = words or [""]
            wanted = f"SOURCE:COMMAND of {', '.join(inputs)}"
            demand(command in inputs, "servos", wanted, f"'{command}'")
            demand(command not in channels, "servos", "one entry a command", f"'{command}' again")
            low, high = self._range_of(command, values)
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            idle = 0.0 if low * high <= 0.0 else middle
            channels[command] = Channel(command, idle, middle, half, self._weights(source))
        missing = [name for name in inputs if name not in channels]
        demand(not missing, "servos", "an entry for each command", f"none for {', '.join(missing)}")
        return [channels[name] for name in inputs]

    def _range_of(self, command: str, values: Sequence[str]) -> tuple[float, float]:
        """Return a command at 1100 and at 1900 us."""
        if values:
            return _read_range(values, "servos")
        wanted = "LOW:HIGH, the commands at 1100 and 1900 us, such as `--set pulse_range=-1:1`"
        got = f"neither it nor SOURCE:{command}:LOW:HIGH"
        demand(bool(self.pulse_range), "pulse_range", wanted, got)
        return _read_range(self.pulse_range.split(":"), "pulse_range")

    def _weights(self, source: str) -> tuple[tuple[int, float], ...]:
        """Return servo outputs with weights: one, or those of a degree of freedom of the frame."""
        rows = _FRAMES.get(self.frame, {})
        if source in rows:
            inverse = np.linalg.pinv(np.array([*rows.values()], dtype=float).T)
            weights = enumerate(inverse[[*rows].index(source)].tolist(), 1)
            return tuple((servo, weight) for servo, weight in weights if abs(weight) > 1e-12)
        has = f"a servo output from 1 to {MAX_SERVO}, or {', '.join(rows) or 'set `frame`'}"
        valid = source.isdecimal() and 1 <= int(source) <= MAX_SERVO
        demand(valid, "servos", f"SOURCE:COMMAND with {has}", f"'{source}'")
        return ((int(source), 1.0),)

    def _match_motors(self, plant: ExportedPlant) -> list[list[str]]:
        """Return the entry of each motor: the first command with its direction, or the opposite."""
        ranges = np.array([self._range_of(name, ()) for name in plant.inputs])
        n, middle = len(ranges), ranges.mean(axis=1)
        low, high = (np.tile(middle, (n, 1)) + np.diag(ends - middle) for ends in ranges.T)
        still, down = np.zeros((n, 6)), np.tile([0.0, 0.0, 1.0], (n, 1))
        at_low, at_high = (plant.applied_wrench(States(still, down, x, still)) for x in (low, high))
        pushes = dict(zip(plant.inputs, at_high - at_low, strict=True))
        rows = _FRAMES[self.frame]
        none = [0.0] * len(next(iter(rows.values())))
        motors = np.array([np.multiply(rows.get(key, none), sign) for key, sign in _AXES.items()]).T
        entries = []
        for number, factors in enumerate(motors, 1):
            axes = {axis: x for axis, x in zip(AXES, factors.tolist(), strict=True) if x}
            signs = {name: np.sign(push * factors).sum() for name, push in pushes.items()}
            name = next((name for name, sign in signs.items() if abs(sign) == len(axes)), "")
            if not name:
                raise MethodError(
                    f"motor {number} of the frame '{self.frame}' pushes "
                    f"{' '.join(f'{x:+g}'[0] + axis for axis, x in axes.items())}, and none of "
                    f"{', '.join(pushes) or 'the commands left'} does so or the opposite: correct "
                    "the vehicle's thrusters or the frame, or set `servos`, such as 1:NAME,2:NAME."
                )
            values = ranges[plant.inputs.index(name)].tolist()[:: int(np.sign(signs[name]))]
            entries.append([str(number), name, *map(str, values)])
            del pushes[name]
        return entries

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Run the file and yield the steps of its server."""
        with super().open_engine(folder, plant) as engine:
            module = execute_module(folder / f"{vehicle_identifier(plant)}.py")
            yield _Server(engine, module)


class _Server(Engine):
    """The vehicle of the server, far below the surface, which equation 1 does not have."""

    step = "Runge-Kutta of the server, at most {:g} s"

    def __init__(self, engine: Engine, module: Any) -> None:
        super().__init__(engine.name, engine.accelerations)
        self._simulation = module.Simulation()

    def set_state(self, attitude: FloatArray, velocity: FloatArray) -> None:
        """Set the state."""
        position = 0.0, 0.0, np.inf
        self._simulation.state = np.concatenate([velocity, position, attitude])

    def advance(
        self, h: float, inputs: FloatArray, first: FloatArray, last: FloatArray
    ) -> FloatArray:
        """Take a step [s] with the mean of the wrench; return the velocity after it."""
        self._simulation.advance(h, inputs, 0.5 * (first + last))
        return np.asarray(self._simulation.state[:6])


def _read_range(texts: Sequence[str], setting: str) -> tuple[float, float]:
    """Return LOW and HIGH."""
    try:
        low, high = (float(text) for text in texts)
    except ValueError:
        low = high = np.nan
    valid = bool(np.isfinite([low, high]).all()) and low != high
    demand(valid, setting, "two different numbers LOW:HIGH", f"'{':'.join(texts)}'")
    return low, high
