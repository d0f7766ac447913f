"""The vehicle that a fit has estimated with its coefficients."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.identification.fit import Fit
from hydrodamp.identification.vehicle_values import LOGARITHMS, vehicle_at
from hydrodamp.simulation.problem import Problem, build_problem
from hydrodamp.vehicle.vehicle import Vehicle


def estimated_vehicle(vehicle: Vehicle, fit: Fit) -> Vehicle:
    """Return the vehicle of a fit that has estimated values of this very vehicle, else this."""
    fitted = fit.vehicle
    estimates = {label: each for label, each in fit.estimates.items() if each.origin}
    is_free = any(not each.is_held for each in estimates.values())
    if fitted is None or fitted.name != vehicle.name or not is_free:
        return vehicle
    theta = {
        label: float(np.log(each.value / each.prior))
        if label.startswith(LOGARITHMS)
        else each.value - each.prior
        for label, each in estimates.items()
    }
    estimated = vehicle_at(vehicle, theta)
    return fitted if np.allclose(estimated.mass_matrix, fitted.mass_matrix) else vehicle


def with_estimated_vehicle(problem: Problem, fit: Fit) -> Problem:
    """Return a problem with the vehicle that a fit has estimated."""
    vehicle = estimated_vehicle(problem.vehicle, fit)
    if vehicle is problem.vehicle:
        return problem
    changed = build_problem(vehicle, problem.log, problem.models)
    return replace(changed, sensor_log=problem.sensor_log)
