"""A colcon package for ROS 2: the model of gz-sim, its bridge, and launch files."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from hydrodamp.errors import demand
from hydrodamp.export.actuation import Actuation
from hydrodamp.export.codegen import render_template, vehicle_identifier
from hydrodamp.export.gazebo import GzSim
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.export.target import Files
from hydrodamp.export.verification import Engine
from hydrodamp.files import as_json
from hydrodamp.models.files import damping_document, format_model
from hydrodamp.simulation.problem import vehicle_stamp
from hydrodamp.vehicle.file import format_vehicle

#: Addresses that the schema of package.xml (REP 149) allows.
_ADDRESS = re.compile(r"[-\w%+]+(\.[-\w%+]+)*@[-a-z0-9%]+(\.[-a-z0-9%]+)*\.[a-z]{2,}", re.I | re.A)

LAUNCH_FILES = "simulate.launch.py", "live.launch.py", "replay.launch.py"


@dataclass(frozen=True)
class Ros2Package(GzSim):
    """A package that colcon builds: simulate in gz-sim, identify live, replay a bag.

    Parameters
    ----------
    maintainer, email, license : str
        Of ``package.xml``.
    density, step, legacy, link
        As of ``gz-sim``.
    """

    key: ClassVar[str] = "ros2-package"
    description: ClassVar[str] = "ROS 2 Jazzy or newer with ros_gz (colcon, ament_cmake)"
    maintainer: str = "maintainer"
    email: str = "maintainer@example.com"
    license: str = "Proprietary"

    def __post_init__(self) -> None:
        """Check the settings."""
        super().__post_init__()
        is_address = bool(_ADDRESS.fullmatch(self.email))
        demand(is_address, "email", "an address such as ada@example.com", f"'{self.email}'")
        for name in ("maintainer", "license"):
            text = getattr(self, name)
            demand(bool(text.strip()), name, "a text that is not empty", f"'{text}'")

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the package; the files of gz-sim are in its folder ``models``."""
        name = vehicle_identifier(plant)
        damping = replace(plant.damping, vehicle=vehicle_stamp(plant.vehicle))
        values = {
            "package": re.sub("_+", "_", name.lower()).strip("_"),
            "name": name,
            "effectors": Actuation(plant).effectors,
            "commands": plant.commands,
            "target": self,
        }
        templates = {name: name for name in ("package.xml", "CMakeLists.txt")}
        templates |= {f"launch/{each}": each for each in LAUNCH_FILES}
        templates |= {f"config/{each}": each for each in ("bridge.yaml", "simulator.yaml")}
        templates["scripts/replay.py"] = "replay.py"
        files = {
            path: render_template(f"ros2/{each}.j2", **values) for path, each in templates.items()
        }
        model = {
            f"models/{name}/{path}": text for path, text in super().render_files(plant).items()
        }
        return {
            **files,
            **model,
            "config/damping.json": as_json(damping_document(damping)),
            "config/model.yaml": format_model(damping.model),
            "config/vehicle.yaml": format_vehicle(plant.vehicle),
        }

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Read the model of the package as that of gz-sim."""
        with super().open_engine(folder / "models" / vehicle_identifier(plant), plant) as engine:
            yield engine
