"""Requirements of a vehicle on a log, which its quality report checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hydrodamp.basis.term import VELOCITY_OF
from hydrodamp.data.log import Log
from hydrodamp.identification.command_response import interpolation_remarks, response_remarks
from hydrodamp.identification.wrench_gains import check_gains
from hydrodamp.ingest.inspection.quality_report import Requirements
from hydrodamp.models.catalog import catalog
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.checks import (
    estimate_length,
    missing_actuation,
    missing_data,
    thruster_signs,
    unused_commands,
)
from hydrodamp.simulation.problem import prepare
from hydrodamp.vehicle.vehicle import Vehicle


def find_requirements(
    vehicle: Vehicle, log: Log, models: Sequence[DampingModel] = ()
) -> Requirements:
    """Return the requirements of a vehicle and models on a log.

    Axes whose wrench contradicts the motion are suspicions.
    """
    no_actuation = missing_actuation(vehicle, log)
    # Terms of a model may still use the commands of a vehicle without actuators.
    by_terms = no_actuation if log.command_names and not vehicle.commands else ""
    requirements = Requirements(
        velocities=tuple(VELOCITY_OF[axis] for axis in vehicle.axes),
        missing=tuple(fault for fault in missing_data(vehicle, log, ()) if fault != by_terms),
        reservations=(
            *unused_commands(vehicle, log, models),
            *filter(None, [by_terms and missing_actuation(vehicle, log, models)]),
        ),
        length=estimate_length(vehicle),
        signs=thruster_signs(vehicle),
        commands=vehicle.commands,
    )
    if requirements.missing or no_actuation:
        return requirements
    model = catalog["fossen"]
    coupled = catalog["prestero"]
    problem = prepare(vehicle, log, (model, coupled))
    remarks = (*interpolation_remarks(problem, coupled), *response_remarks(problem, coupled))
    return replace(
        requirements,
        suspicions=tuple(check_gains(problem, [model])),
        reservations=(*requirements.reservations, *remarks),
    )
