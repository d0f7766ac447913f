"""Curves of thrusters and fins as parameters of the vehicle, with priors from published thrust.

A thruster has the ratio of reverse to forward thrust, an exponent, a dead band and an exponent of
the voltage; a fin the gain of its force and the stall angle, where its effect ends. All but the
exponent of the voltage are logarithms.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
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

#: Prior of the dead band over the reference, and standard deviation of its logarithm.
DEAD_BAND, DEAD_BAND_STD = 28.0 / 400.0, 1.0

#: Of the exponent of the voltage: T200 1.2, against 1 of a file that states none.
VOLTAGE_STD = 0.5

#: Of the logarithm of the gain of a fin: the VT 690 has 72 % of the published value.
FIN_GAIN_STD = 0.3

#: Stall angle of a fin [rad], and standard deviation of its logarithm: 15 to 30 degrees.
STALL_ANGLE, STALL_STD = 0.35, 0.4

#: Largest deflections that may reach stall, and are angles [rad].
MIN_DEFLECTION, MAX_DEFLECTION = 0.5 * STALL_ANGLE, 0.5 * np.pi


def with_curves(problem: Problem, model: DampingModel, names: Sequence[str]) -> Problem:
    """Return a problem whose vehicle has a curve at its prior for each command to estimate."""
    actuators = problem.vehicle.actuators
    before = {each.command: each for each in actuators if isinstance(each, Curve)}
    thrusters, fins = driving_commands(problem, model)
    after = dict(before)
    for name in thrusters if "thrust-curve" in names else ():
        curve = before.get(name) or Curve(name, reference=_largest(problem, name))
        band = curve.dead_band or DEAD_BAND * curve.reference
        after[name] = replace(curve, dead_band=band)
    for name in fins if "fin-curve" in names else ():
        largest = _largest(problem, name)
        if name not in before and MIN_DEFLECTION < largest < MAX_DEFLECTION:
            after[name] = Curve(name, reference=largest, limit=STALL_ANGLE)
    return problem if after == before else replace_curves(problem, after.values())


def replace_curves(problem: Problem, curves: Iterable[Curve]) -> Problem:
    """Return a problem whose vehicle has these curves."""
    actuators = (x for x in problem.vehicle.actuators if not isinstance(x, Curve))
    vehicle = replace(problem.vehicle, actuators=(*curves, *actuators))
    changed = build_problem(vehicle, problem.log, problem.models)
    return replace(changed, sensor_log=problem.sensor_log)


def driving_commands(problem: Problem, model: DampingModel) -> tuple[list[str], list[str]]:
    """Return the varying commands of thrusters, and those of fins.

    A command that no actuator has is that of a fin if all its terms have a velocity.
    """
    log, actuators = problem.log, [*problem.vehicle.actuators]
    terms = [term for row in model.terms for term in row]
    driven = {name for term in terms for name in term.commands}
    thrusters = {name for term in terms if not term.velocities for name in term.commands}
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
    curves = {x.command: x for x in problem.vehicle.actuators if isinstance(x, Curve)}
    for name in thrusters if "thrust-curve" in names else ():
        yield from _thrust_parameters(curves[name], problem.log.command(name))
    for fin in problem.vehicle.actuators if "fin-curve" in names else ():
        if isinstance(fin, Fin) and fin.command in fins:
            yield Parameter(f"gain_{fin.command}", "", FIN_GAIN_STD, 1.0, "logarithm", "assumed")
    for name in fins if "fin-curve" in names else ():
        if (curve := curves.get(name)) and curve.limit:
            label = f"stall_{name}"
            yield Parameter(label, "rad", STALL_STD, curve.limit, "logarithm", "assumed")


def _thrust_parameters(curve: Curve, command: FloatArray) -> Iterator[Parameter]:
    """Yield the parameters of a thruster; a command of both signs has a reverse thrust."""
    name = curve.command
    if command.min() < 0.0 < command.max():
        yield Parameter(
            f"reverse_{name}", "", REVERSE_STD, curve.reverse_ratio, "logarithm", "assumed"
        )
    yield Parameter(f"exponent_{name}", "", EXPONENT_STD, curve.exponent, "logarithm", "assumed")
    yield Parameter(f"dead_band_{name}", "", DEAD_BAND_STD, curve.dead_band, "logarithm", "assumed")
    if curve.voltage is not None:
        prior = curve.voltage_exponent
        yield Parameter(f"voltage_{name}", "", VOLTAGE_STD, prior, origin="assumed")


def _largest(problem: Problem, name: str) -> float:
    return float(np.abs(problem.log.command(name)).max())
