"""General model: the terms of an expert for a vehicle of which little is known.

On each axis ``τ_i = Σ k_ij f_j`` with linear and quadratic damping, cross-flow drag, lift and
products of two velocities, which correct the Coriolis forces of a guessed mass; gains of every
command that no actuator uses, on every axis, or of the recorded wrench; righting moment, net
weight and a constant force. Least squares needs no choice of axes by the user: weak gains come out
near zero.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES, VELOCITIES, Term
from hydrodamp.data.log import Log
from hydrodamp.identification.dissipativity import is_damping_term, velocity_box
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.checks import CHANNELS
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.vehicle.vehicle import Vehicle

#: Key of the general model.
GENERAL_KEY = "general"

#: End of the key of a model with the inputs of a log.
INPUTS = "+inputs"

#: Damping of each axis: of its own velocity, cross-flow, lift, and products of two velocities.
_DAMPING = {
    "X": "u u|u| vr wq v^2 w^2 q^2 r^2",
    "Y": "v v|v| |u|v r r|r| v|r| |v|r uv ur wp",
    "Z": "w w|w| |u|w q q|q| w|q| |w|q uw uq vp",
    "K": "p p|p| |u|p v",
    "M": "q q|q| |u|q w w|w| w|q| |w|q u uw",
    "N": "r r|r| |u|r v v|v| v|r| |v|r uv ur",
}

#: Righting moment and net weight, where a vehicle rolls or pitches.
_RESTORING = {"X M": "down_x", "Y K": "down_y", "Z": "down_z"}

#: Gains of a command {0} under way: thrust of a force or a speed; lift, and its drag, of a fin.
_UNDER_WAY = {"X Y Z K M N": "{0}", "X": "{0}*|{0}| u^2*{0}*{0}", "Y Z K M N": "u^2*{0}"}

#: Gains of a command {0} where surge changes its sign: thrust, less in a flow, and its suction.
_ANY_SPEED = {"X Y Z K M N": "{0} |u|*{0}", "X": "{0}*{0}"}

#: Columns are duplicates above this cosine [1] of their angle.
_MIN_DUPLICATE_COSINE = 1.0 - 1e-9

#: Samples on which columns are compared, about.
_MAX_COMPARED_SAMPLES = 20_000

#: Atoms that are never negative.
NONNEGATIVE_ATOMS = (*(f"|{name}|" for name in VELOCITIES), "U", "V")

#: Atoms with the sign of a velocity.
SIGNED_ATOMS = (*VELOCITIES, "V_v", "V_w")


def general_model(vehicle: Vehicle, log: Log) -> DampingModel:
    """Return the terms of an expert for a vehicle of which little is known.

    Linear and quadratic damping, cross-flow drag, lift and products of two velocities;
    gains on every axis of every command that no actuator of the vehicle uses, or a gain
    of a recorded wrench by axis (its deviation from 1); righting moment, net weight and a
    constant force. With them, the estimate replays well also where mass, trim and gains
    are guesses; single coefficients then have no meaning.

    Parameters
    ----------
    vehicle : Vehicle
        Free axes and actuators.
    log : Log
        Training data, with commands or a wrench. Of the velocities it matters whether
        surge keeps its sign, and which terms are proportional to each other.

    Returns
    -------
    model : DampingModel
        Key ``general``, without terms that are zero or proportional to another one.

    Examples
    --------
    >>> import hydrodamp as hd
    >>> campaign = hd.reenact(duration=20.0)
    >>> model = hd.general_model(campaign.vehicle, campaign.train)
    >>> model.key, "Y_v|v|" in model.labels
    ('general', True)
    """
    model = DampingModel.from_table(_DAMPING, key=GENERAL_KEY, title="General")
    model = add_inputs(model, vehicle, log)
    return replace(remove_duplicates(prepare(vehicle, log, model), model), key=GENERAL_KEY)


def add_inputs(model: DampingModel, vehicle: Vehicle, log: Log) -> DampingModel:
    """Add gains of the commands that no actuator uses, restoring and a constant to a model."""
    rows: dict[str, list[str]] = {axis: ["1"] for axis in AXES}
    for axes, terms in _input_terms(vehicle, log):
        for axis in axes.split():
            rows[axis] += terms.split()
    table = {axis: " ".join(terms) for axis, terms in rows.items()}
    return model.with_terms(table, key=f"{model.key}{INPUTS}").restricted_to(vehicle.axes)


def _input_terms(vehicle: Vehicle, log: Log) -> Iterator[tuple[str, str]]:
    if {"K", "M"} & set(vehicle.axes):
        yield from _RESTORING.items()
    if log.wrench is not None:
        driven = np.ptp(log.wrench, axis=0) > 0.0
        yield from ((axis, " ".join(CHANNELS[axis])) for axis in np.array(AXES)[driven].tolist())
        return
    gains = _UNDER_WAY if is_under_way(log.velocity) else _ANY_SPEED
    for name in log.command_names:
        if name not in vehicle.commands and np.ptp(log.command(name)) > 0.0:
            yield from ((axes, terms.format(name)) for axes, terms in gains.items())


def is_under_way(velocity: FloatArray) -> bool:
    """Return whether surge keeps its sign and stays away from zero."""
    return bool(velocity_box(velocity).min_abs[0] > 0.0)


def remove_duplicates(problem: Problem, model: DampingModel) -> DampingModel:
    """Remove terms that are zero throughout or proportional to another one."""
    step = max(problem.n_samples // _MAX_COMPARED_SAMPLES, 1)
    columns = problem.regressor(step=step)[:, problem.equations.n_known :]
    size = np.linalg.norm(columns, axis=0)
    unit = columns / np.where(size > 0.0, size, 1.0)
    duplicate = np.abs(unit.T @ unit) > _MIN_DUPLICATE_COSINE
    column = {term: index for index, term in enumerate(problem.equations.basis)}
    rows = []
    for terms in model.terms:
        distinct: list[Term] = []
        for term in sorted(terms, key=_precedence):
            index = column[term]
            earlier = [column[previous] for previous in distinct]
            if size[index] > 0.0 and not duplicate[index, earlier].any():
                distinct.append(term)
        rows.append(tuple(distinct))
    return replace(model, terms=tuple(rows))


def _precedence(term: Term) -> tuple[bool, bool, bool]:
    """Return the sort key of terms that are proportional: of a constant command, damping stays."""
    return bool(term.commands), is_damping_term(term), not _is_odd(term)


def _is_odd(term: Term) -> bool:
    return sum(factor in SIGNED_ATOMS for factor in term.factors) % 2 == 1
