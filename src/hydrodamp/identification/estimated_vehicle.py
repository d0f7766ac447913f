"""The vehicle that a fit has estimated with its coefficients."""

from __future__ import annotations

from dataclasses import replace

from hydrodamp.identification.fit import Fit
from hydrodamp.simulation.problem import Problem, build_problem
from hydrodamp.vehicle.vehicle import Vehicle


def estimated_vehicle(vehicle: Vehicle, fit: Fit) -> Vehicle:
    """Return the vehicle of a fit where the fit has estimates for this vehicle, else this."""
    fitted, estimates = fit.vehicle, fit.estimates.values()
    if fitted is None or fitted.name != vehicle.name:
        return vehicle
    return fitted if any(each.origin and not each.is_held for each in estimates) else vehicle


def with_estimated_vehicle(problem: Problem, fit: Fit) -> Problem:
    """Return a problem with the vehicle that a fit has estimated."""
    vehicle = estimated_vehicle(problem.vehicle, fit)
    if vehicle is problem.vehicle:
        return problem
    changed = build_problem(vehicle, problem.log, problem.models)
    return replace(changed, sensor_log=problem.sensor_log)
