"""Test of a fit without curves for reverse ratios and exponents of thrusters.

From the curve of the command itself and the coefficients of a fit, one Gauss-Newton step with all
coefficients, initial states, ratios and exponents free estimates the curves, with errors of the
jackknife, as of delays.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.identification.command_curves import (
    add_curves,
    driving_commands,
    straight_curve,
    thrust_parameters,
)
from hydrodamp.identification.fit import MIN_BLOCKS, jackknife
from hydrodamp.identification.gauss_newton import Iterate, ShootingObjective, newton_step
from hydrodamp.identification.held_out_replay import PieceNormals, split_pieces
from hydrodamp.identification.parameter_estimates import MIN_SIGNIFICANCE, describe_label
from hydrodamp.identification.parameters import rebuild_plant
from hydrodamp.identification.rebuilt_outputs import free_parameters, transfer_iterate
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.actuators import Curve, Propeller


def significant_curves(
    objective: ShootingObjective, result: Iterate, model: DampingModel
) -> list[str]:
    """Return the ratios and exponents that differ from one beyond their errors, as text."""
    problem, pieces = objective.problem, split_pieces(objective.problem)
    known = {x.command for x in problem.vehicle.actuators if isinstance(x, Curve | Propeller)}
    names = [name for name in driving_commands(problem, model)[0] if name not in known]
    names = [name for name in names if np.ptp(np.sign(problem.log.command(name))) == 2.0]
    if not names or len(pieces) < MIN_BLOCKS:
        return []
    curves = [straight_curve(problem, name) for name in names]
    rows = [row for x in curves for row in thrust_parameters(x, problem.log.command(x.command))]
    parameters = tuple(row for row in rows if row.transform == "logarithm")
    rebuild = rebuild_plant(add_curves(problem, curves), model, parameters)
    joint, k = free_parameters(objective, parameters, rebuild), len(parameters)
    start = transfer_iterate(joint, result, np.append(result.coefficients, np.zeros(k)))
    values = newton_step(joint, start)[-k:]
    replicates = PieceNormals.of(joint, start, pieces).replicates[:, -k:]
    errors = jackknife(replicates, problem.duration).standard_errors
    ratios = (np.abs(values) / errors).tolist()
    triples = zip((row.label for row in parameters), np.exp(values).tolist(), ratios, strict=True)
    return [
        f"{describe_label(label)} is {value:.2g} ({ratio:.0f} standard errors)"
        for label, value, ratio in triples
        if ratio > MIN_SIGNIFICANCE
    ]
