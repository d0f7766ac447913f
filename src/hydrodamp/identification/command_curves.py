"""Curves of thrusters and fins as parameters of the vehicle, with priors from published thrust.

A thruster has the ratio of reverse to forward thrust, an exponent, a dead band and an exponent of
the voltage; a fin the gain of its force and the stall angle, where its effect ends. All but dead
band and exponent of the voltage are logarithms.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.parameters import Parameter
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, build_problem
from hydrodamp.vehicle.actuators import Curve, Fin, Matrix, Propeller, Thruster

# Blue Robotics, T200 public performance data 10-20 V, September 2019 (https://cad.bluerobotics.com/
# T200-Public-Performance-Data-10-20V-September-2019.xlsx): thrust at 1900 and 1100 us 36.4 and
# -28.6 N at 12 V, 51.4 and -39.9 N at 16 V, none within 36 and 28 us of 1500 us; at 16 V 21.8 N at
# 1728 us.

#: Prior standard deviation of the logarithm of reverse over forward thrust: T200 -0.25.
REVERSE_STD = 0.3

#: Of the logarithm of the exponent: T200 0.33 (exponent 1.4), a quadratic curve 0.69.
EXPONENT_STD = 0.5

#: Of the dead band over the reference: T200 0.09 at 12 V, 0.07 at 16 V. The prior is none.
DEAD_BAND_STD = 0.1

#: Of the exponent of the voltage: T200 1.2, against 1 of a file that states none.
VOLTAGE_STD = 0.5

#: Of the logarithm of the gain of a fin: the VT 690 has 72 % of the published value.
FIN_GAIN_STD = 0.3

#: Stall angle [rad] that a fin must approach, and standard deviation of its logarithm: the prior is
#: this share of the largest deflection of the log, because a fit without stall is the alternative.
STALL_ANGLE, STALL_STD, PRIOR_STALL = 0.35, 0.4, 0.9

#: Smallest and largest deflection of a fin that may stall [rad].
DEFLECTIONS = (0.5 * STALL_ANGLE, 0.5 * np.pi)


def with_curves(problem: Problem, model: DampingModel, names: Sequence[str]) -> Problem:
    """Return a problem whose vehicle has a curve, at its prior, of each command to estimate."""
    known = {x.command for x in problem.vehicle.actuators if isinstance(x, Curve)}
    thrusters, fins = driving_commands(problem, model)
    added = [straight_curve(problem, x) for x in thrusters if "thrust-curve" in names]
    straight = [straight_curve(problem, x) for x in fins if "fin-curve" in names]
    added += [
        replace(curve, limit=PRIOR_STALL * curve.reference)
        for curve in straight
        if DEFLECTIONS[0] < curve.reference < DEFLECTIONS[1]
    ]
    added = [curve for curve in added if curve.command not in known]
    return add_curves(problem, added) if added else problem


def add_curves(problem: Problem, curves: Iterable[Curve]) -> Problem:
    """Return a problem whose vehicle has further curves."""
    vehicle = replace(problem.vehicle, actuators=(*curves, *problem.vehicle.actuators))
    changed = build_problem(vehicle, problem.log, problem.models)
    return replace(changed, sensor_log=problem.sensor_log)


def driving_commands(problem: Problem, model: DampingModel) -> tuple[list[str], list[str]]:
    """Return the varying commands of thrusters, and those of fins.

    A command that no actuator has is that of a fin if all its terms have a velocity or another
    command, as a rudder in the race of a propeller.
    """
    log, actuators = problem.log, problem.vehicle.actuators
    terms = [term for row in model.terms for term in row]
    driven = {name for term in terms for name in term.commands}
    alone = (term for term in terms if len(term.commands) == 1 and not term.velocities)
    thrusters = {name for term in alone for name in term.commands}
    fins = driven - thrusters
    for each in actuators if log.wrench is None else ():
        if isinstance(each, Matrix | Propeller) or getattr(each, "gain", None) is not None:
            thrusters |= {*each.commands}
        elif isinstance(each, Fin):
            fins.add(each.command)
    varying = [name for name in log.command_names if np.ptp(log.command(name)) > 0.0]
    tables = {each.command for each in actuators if isinstance(each, Thruster) and each.curve}
    groups = thrusters - fins - tables, fins - thrusters - tables
    return [x for x in varying if x in groups[0]], [x for x in varying if x in groups[1]]


def curve_parameters(
    problem: Problem, model: DampingModel, names: Sequence[str]
) -> Iterator[Parameter]:
    """Yield the parameters of the curves of a vehicle that has them."""
    thrusters, fins = driving_commands(problem, model)
    for group, commands in (("thrust-curve", thrusters), ("fin-curve", fins)):
        if group in names and not commands:
            raise MethodError(
                f"`{group}` needs a command that varies and that model '{model.key}' or "
                f"an actuator uses; the log has {', '.join(problem.log.command_names) or 'none'}: "
                "record one, give it a term, or do not estimate this"
            )
    curves = {x.command: x for x in problem.vehicle.actuators if isinstance(x, Curve)}
    for name in thrusters if "thrust-curve" in names else ():
        yield from thrust_parameters(curves[name], problem.log.command(name))
    for name in fins if "fin-curve" in names else ():
        if any(isinstance(x, Fin) and x.command == name for x in problem.vehicle.actuators):
            yield Parameter(f"gain_{name}", "", FIN_GAIN_STD, 1.0, "logarithm", "assumed")
        if (curve := curves.get(name)) and curve.limit:
            label = f"stall_{name}"
            yield Parameter(label, "rad", STALL_STD, curve.limit, "logarithm", "assumed")


def thrust_parameters(curve: Curve, command: FloatArray) -> Iterator[Parameter]:
    """Yield the parameters of a thruster; a command of both signs has a reverse thrust."""
    name, ratio, origin = curve.command, curve.reverse_ratio, "assumed"
    if command.min() < 0.0 < command.max():
        yield Parameter(f"reverse_{name}", "", REVERSE_STD, ratio, "logarithm", origin)
    yield Parameter(f"exponent_{name}", "", EXPONENT_STD, curve.exponent, "logarithm", origin)
    std, prior = DEAD_BAND_STD * curve.reference, curve.dead_band
    yield Parameter(f"dead_band_{name}", "", std, prior, origin=origin)
    if curve.voltage is not None:
        exponent = curve.voltage_exponent
        yield Parameter(f"voltage_{name}", "", VOLTAGE_STD, exponent, origin=origin)


def straight_curve(problem: Problem, name: str) -> Curve:
    """Return the curve whose value is the command, with the largest of the log as reference."""
    return Curve(name, reference=float(np.abs(problem.log.command(name)).max()))
