"""Outputs with parameters θ that change the plant or its inputs: vehicle and commands.

``rebuild(θ)`` returns the problem at θ; its differences give the slopes on θ of mass matrix, known
coefficients and inputs, which a replay propagates with those on the coefficients.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.gauss_newton import Iterate, ShootingObjective
from hydrodamp.identification.multiple_shooting import (
    LinearisedResiduals,
    Outputs,
    ResidualSeries,
    Windows,
)
from hydrodamp.identification.parameters import Parameter
from hydrodamp.kernels.plant import PlantSlopes
from hydrodamp.simulation.problem import Problem

#: Step of differences over the prior standard deviation.
DIFFERENCE_STEP = 1e-4


@dataclass(frozen=True, eq=False)
class RebuiltOutputs:
    """Outputs whose last parameters are those that ``rebuild`` takes.

    ``rebuild`` has the plant and the inputs of the samples that the outputs have.
    """

    base: Outputs
    rebuilt: tuple[Parameter, ...]
    rebuild: Callable[[FloatArray], Problem]

    @property
    def interval(self) -> float:
        """Sampling interval of the slowest sensor [s]."""
        return self.base.interval

    @property
    def parameters(self) -> Sequence[Parameter]:
        """Parameters of the outputs, then those of plant and inputs."""
        return (*self.base.parameters, *self.rebuilt)

    @property
    def samples_per_residual(self) -> float:
        """Samples per independent residual."""
        return self.base.samples_per_residual

    def with_base(self, base: Outputs) -> RebuiltOutputs:
        """Return other outputs with the same parameters of plant and inputs."""
        return replace(self, base=base)

    def jacobian_entries(self, windows: Windows) -> int:
        """Return the entries of the Jacobian of a window."""
        return self.base.jacobian_entries(windows)

    def weights(self, counts: FloatArray) -> FloatArray:
        """Return weights of the residuals of each output."""
        return self.base.weights(counts)

    def select(self, samples: IntArray) -> RebuiltOutputs:
        """Return the outputs of some samples, with the rebuilt inputs of the same samples."""

        def rebuild(theta: FloatArray) -> Problem:
            problem = self.rebuild(theta)
            return replace(problem, inputs=problem.inputs.select(samples))

        return replace(self, base=self.base.select(samples), rebuild=rebuild)

    def apply_plant(self, windows: Windows, parameters: FloatArray) -> tuple[Windows, FloatArray]:
        """Return the windows of plant and inputs at θ, and the parameters of the base."""
        n = len(self.rebuilt)
        problem = self.rebuild(parameters[-n:])
        changed = replace(windows.problem, equations=problem.equations, inputs=problem.inputs)
        entries = problem.equations.entries(problem.models[0])
        windows = replace(windows, problem=changed, entries=entries, outputs=self.base)
        return windows, parameters[:-n]

    def residuals(self, windows: Windows, parameters: FloatArray) -> Iterator[ResidualSeries]:
        """Yield the residuals of the outputs."""
        return self.base.residuals(*self.apply_plant(windows, parameters))

    def averages(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> FloatArray:
        """Return the averages of the residuals."""
        return self.base.averages(*self.apply_plant(windows, parameters), residual_std)

    def linearise(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> LinearisedResiduals:
        """Linearise averages of the residuals."""
        at, known = self.apply_plant(windows, parameters)
        slopes = self._plant_slopes(parameters[len(known) :])
        return self.base.linearise(replace(at, slopes=slopes), known, residual_std)

    def _plant_slopes(self, theta: FloatArray) -> PlantSlopes:
        """Return differences of the plant and its inputs at θ."""
        at, steps = self.rebuild(theta), [DIFFERENCE_STEP * each.std for each in self.rebuilt]
        moved = [self.rebuild(theta + row) for row in np.diag(steps)]

        def slopes(values: Callable[[Problem], FloatArray]) -> FloatArray:
            pairs = zip(moved, steps, strict=True)
            return np.array([(values(each) - values(at)) / step for each, step in pairs])

        return PlantSlopes(
            slopes(lambda each: each.vehicle.mass_matrix),
            slopes(lambda each: each.equations.known),
            slopes(lambda each: each.inputs.wrench),
            slopes(lambda each: each.inputs.channels),
        )


def free_parameters(
    objective: ShootingObjective,
    parameters: tuple[Parameter, ...],
    rebuild: Callable[[FloatArray], Problem],
) -> ShootingObjective:
    """Return the objective with further parameters of plant and inputs."""
    outputs = RebuiltOutputs(objective.outputs, parameters, rebuild)
    scale = np.concatenate([objective.scale, [each.std for each in parameters]])
    return replace(objective, outputs=outputs, scale=scale)


def transfer_iterate(
    objective: ShootingObjective, iterate: Iterate, coefficients: FloatArray
) -> Iterate:
    """Return the iterate of an objective with other parameters, at these coefficients."""
    linearisations = tuple(
        each._replace(windows=replace(each.windows, outputs=objective.outputs))
        for each in iterate.linearisations
    )
    return objective.move(replace(iterate, linearisations=linearisations), coefficients)


def fix_parameters(
    objective: ShootingObjective, iterate: Iterate
) -> tuple[ShootingObjective, Iterate]:
    """Return objective and iterate with plant and inputs at the estimate; these are not free."""
    entire, known = objective.outputs.apply_plant(objective.windows(np.inf), iterate.coefficients)
    plant: dict[str, Any] = {
        "problem": entire.problem,
        "entries": entire.entries,
        "outputs": entire.outputs,
    }
    free = np.ix_(*[[*range(len(known)), -1]] * 2)
    linearisations = tuple(
        each._replace(windows=replace(each.windows, **plant), normal=each.normal[free])
        for each in iterate.linearisations
    )
    fixed = replace(objective, scale=objective.scale[: len(known)], **plant)
    return fixed, replace(iterate, coefficients=known, linearisations=linearisations)
