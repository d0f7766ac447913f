"""JAX, PyTorch, acados, do-mpc: equation 1 with derivatives, and an example of a depth step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from operator import attrgetter
from pathlib import Path
from typing import ClassVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.export.codegen import render_template, template_values, vehicle_identifier
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.scripts import DEPTH_STEP, CasADi, execute_module, render_examples
from hydrodamp.export.target import Files, Target, require_package
from hydrodamp.export.verification import Engine, attitude_quaternions


class _Functions(Target):
    """A Python module of functions of arrays, and the depth step."""

    def render_files(self, plant: ExportedPlant) -> Files:
        """Return the module and the example."""
        module = render_template(f"{self.key}.py.j2", **template_values(plant))
        example = render_examples(plant, {DEPTH_STEP: "depth_step.py.j2"}, key=self.key)
        return {f"{vehicle_identifier(plant)}.py": module, **example}


@dataclass(frozen=True)
class JAX(_Functions):
    """Pure functions for ``jit``, ``vmap`` and ``grad``."""

    key: ClassVar[str] = "jax"
    description: ClassVar[str] = "JAX 0.8 or newer"

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Compile the acceleration in double precision and yield it."""
        require_package("jax")
        import jax

        module = execute_module(folder / f"{vehicle_identifier(plant)}.py")
        acceleration = jax.jit(module.acceleration)
        with jax.enable_x64(True):
            yield Engine(
                f"JAX {jax.__version__}",
                lambda at: np.asarray(acceleration(*(values.T for values in at))).T,
            )


@dataclass(frozen=True)
class PyTorch(_Functions):
    """Functions of tensors for autograd and ``torch.func``."""

    key: ClassVar[str] = "torch"
    description: ClassVar[str] = "PyTorch 2.0 or newer"

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Yield the acceleration."""
        require_package("torch", source="pip install torch")
        import torch

        module = execute_module(folder / f"{vehicle_identifier(plant)}.py")

        def accelerations(at: States) -> FloatArray:
            return np.asarray(module.acceleration(*(torch.tensor(each.T) for each in at))).T

        yield Engine(f"PyTorch {version('torch')}", accelerations)


class _Model(CasADi):
    """CasADi's module with a model of a controller, and the depth step."""

    package: ClassVar[str]
    source: ClassVar[str]
    expressions: ClassVar[tuple[str, ...]]
    """State, control and derivative of the model."""

    @contextmanager
    def open_engine(self, folder: Path, plant: ExportedPlant) -> Iterator[Engine]:
        """Make the model and yield its accelerations."""
        require_package("casadi")
        require_package(self.package, source=self.source)
        module = execute_module(folder / f"{vehicle_identifier(plant)}.py")
        state, control, rate = attrgetter(*self.expressions)(module.make_model())
        derivative = module.ca.Function("rate", [state, control], [rate])

        def accelerations(at: States) -> FloatArray:
            position = np.zeros((len(at.velocity), 3))
            state = np.column_stack([at.velocity, position, attitude_quaternions(at.down)])
            return np.asarray(derivative(state.T, np.column_stack([at.inputs, at.wrench]).T))[:6].T

        yield Engine(f"{self.package} {version(self.package)}", accelerations)


@dataclass(frozen=True)
class Acados(_Model):
    """CasADi's module with an ``AcadosModel``, explicit and implicit."""

    key: ClassVar[str] = "acados"
    description: ClassVar[str] = "acados with acados_template"
    template: ClassVar[str] = "acados.py.j2"
    examples: ClassVar[Mapping[str, str]] = {DEPTH_STEP: "acados_step.py.j2"}
    package: ClassVar[str] = "acados_template"
    source: ClassVar[str] = "https://docs.acados.org/python_interface"
    expressions: ClassVar[tuple[str, ...]] = "x", "u", "f_expl_expr"


@dataclass(frozen=True)
class DoMPC(_Model):
    """CasADi's module with a continuous model of do-mpc."""

    key: ClassVar[str] = "do-mpc"
    description: ClassVar[str] = "do-mpc 5"
    template: ClassVar[str] = "do_mpc.py.j2"
    examples: ClassVar[Mapping[str, str]] = {DEPTH_STEP: "do_mpc_step.py.j2"}
    package: ClassVar[str] = "do_mpc"
    source: ClassVar[str] = "pip install do-mpc"
    expressions: ClassVar[tuple[str, ...]] = "x.cat", "u.cat", "_rhs.cat"
