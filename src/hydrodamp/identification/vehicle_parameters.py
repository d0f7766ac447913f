"""Added mass, centre of gravity and buoyancy of a vehicle as parameters θ of a problem.

Added mass is A(θ) = D A₀ D with D = diag(exp(θ/2)): the rows of its Cholesky factor are scaled, so
the mass matrix stays symmetric and positive definite.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.parameters import Parameter
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.checks import channel_names
from hydrodamp.simulation.problem import Problem, equation_table
from hydrodamp.vehicle.mass import rigid_body_mass_matrix
from hydrodamp.vehicle.vehicle import Vehicle

#: Names that can be estimated.
VEHICLE_PARAMETERS = ("added-mass", "center-of-gravity", "buoyancy")

#: Prior standard deviation of the logarithm of added mass: a hull estimate is right to a third.
ADDED_MASS_STD = 0.3

#: Prior standard deviation of the centre of gravity over the radius of gyration in pitch or yaw.
CENTER_STD = 0.05

#: Prior standard deviation of buoyancy over weight: a trimmed vehicle.
BUOYANCY_STD = 0.02


def vehicle_parameters(vehicle: Vehicle, names: Sequence[str]) -> tuple[Parameter, ...]:
    """Return the parameters of a vehicle by the names of their groups."""
    if "added-mass" in names and vehicle.added_mass is None:
        raise MethodError(
            f"the file of '{vehicle.name}' states the whole mass matrix: give `rigid_body` and "
            "`added_mass` apart, so that added mass can be estimated"
        )
    return tuple(_parameters(vehicle, names))


def _parameters(vehicle: Vehicle, names: Sequence[str]) -> Iterator[Parameter]:
    if "added-mass" in names and vehicle.added_mass is not None:
        diagonal = vehicle.added_mass.diagonal().tolist()
        for axis, (name, added) in enumerate(zip(AXES, diagonal, strict=True)):
            unit, std = "kg" if axis < 3 else "kg m²", ADDED_MASS_STD
            if added > 0.0 and vehicle.free[axis]:
                yield Parameter(f"A_{name}", unit, "vehicle", std, added, "logarithm")
    if "center-of-gravity" in names:
        inertia = vehicle.mass_matrix.diagonal()
        std = CENTER_STD * float(np.sqrt(inertia[3:].max() / inertia[:3].max()))
        for name, prior in zip("xyz", vehicle.center_of_gravity.tolist(), strict=True):
            yield Parameter(f"{name}_G", "m", "vehicle", std, prior)
    if "buoyancy" in names:
        yield Parameter("B", "N", "vehicle", BUOYANCY_STD * vehicle.weight, vehicle.buoyancy)


def rebuild_plant(
    problem: Problem, model: DampingModel, parameters: Sequence[Parameter]
) -> Callable[[FloatArray], Problem]:
    """Return the function that gives the problem of one model with the vehicle at θ."""
    labels = [each.label for each in parameters]

    def rebuild(theta: FloatArray) -> Problem:
        table = equation_table(
            vehicle_at(problem.vehicle, dict(zip(labels, theta.tolist(), strict=True))),
            (model,),
            actuators=problem.equations.actuators,
            propulsion_known=problem.propulsion_known,
        )
        return replace(problem, models=(model,), equations=table.restrict_to(model))

    return rebuild


def free_gains(problem: Problem, model: DampingModel) -> list[str]:
    """Return the axes on which a command has an unknown gain."""
    actuated = set(channel_names(problem.vehicle, problem.log))
    return [
        AXES[axis]
        for axis, terms in enumerate(model.terms)
        if any(set(term.commands) - actuated for term in terms)
    ]


def vehicle_at(vehicle: Vehicle, theta: dict[str, float]) -> Vehicle:
    """Return the vehicle at parameters θ by label, zero for those without."""
    added = np.zeros((6, 6)) if vehicle.added_mass is None else vehicle.added_mass
    factor = np.exp([0.5 * theta.get(f"A_{axis}", 0.0) for axis in AXES])
    changed, rigid = added * np.outer(factor, factor), vehicle.mass_matrix - added
    before = vehicle.center_of_gravity
    center = before + [theta.get(f"{name}_G", 0.0) for name in "xyz"]
    mass = float(rigid[:3, :3].trace()) / 3.0
    moved, unmoved = (
        rigid_body_mass_matrix(mass, np.zeros(3), point, "center_of_gravity")
        for point in (center, before)
    )
    return replace(
        vehicle,
        mass_matrix=rigid + (moved - unmoved) * np.outer(vehicle.free, vehicle.free) + changed,
        added_mass=changed,
        center_of_gravity=center,
        buoyancy=vehicle.buoyancy + theta.get("B", 0.0),
    )
