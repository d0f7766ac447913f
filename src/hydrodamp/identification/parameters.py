"""Parameters of sensors, commands and vehicle that are estimated together with the coefficients.

Those of sensors are biases, delays, lever arms and a current, which all windows share. The prior
standard deviation of a bias is the spread of its signal, that of a delay the correlation time of
the motion, that of a current the RMS speed, that of a lever arm speed over turn rate.

Those of a vehicle are added mass, centre of gravity and buoyancy. Added mass is A(θ) = D A₀ D with
D = diag(exp(θ/2)): the rows of its Cholesky factor are scaled, so the mass matrix stays symmetric
and positive definite.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.term import AXES, DOWN, Term
from hydrodamp.conditioning.sensor_log import Sensor, SensorLog
from hydrodamp.data.measurement import KIND_UNITS, KINDS
from hydrodamp.errors import MethodError
from hydrodamp.identification.grades import Grade, critical_value
from hydrodamp.identification.vehicle_values import vehicle_at
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.checks import channel_names
from hydrodamp.simulation.problem import Problem, build_inputs, equation_table
from hydrodamp.vehicle.priors import COMPONENTS, NEUTRAL_STD, WRENCH_GAIN_STD
from hydrodamp.vehicle.vehicle import Vehicle

#: Names that can be estimated.
VEHICLE_PARAMETERS = (
    "added-mass",
    "center-of-gravity",
    "buoyancy",
    "wrench-gain",
    "thrust-curve",
    "fin-curve",
)

#: Prior standard deviation of the logarithm of added mass: a hull estimate is right to a third.
ADDED_MASS_STD = 0.3

#: Prior standard deviation of the centre of gravity over the radius of gyration in pitch or yaw.
CENTER_STD = 0.05

#: Prior standard deviation of buoyancy over weight: a trimmed vehicle.
BUOYANCY_STD = NEUTRAL_STD

#: Standard deviations from the prior beyond which an estimate contradicts it.
MAX_DEVIATION = 2.0


@dataclass(frozen=True)
class Estimate:
    """Estimate of a parameter of sensors or of the vehicle.

    Attributes
    ----------
    value : float
        In the unit: what the fit uses, so the prior where the parameter is held at it.
    standard_error : float
        Of the value; of the joint estimate where the parameter is held.
    prior : float
        The value without a log; zero for what corrects the description of a sensor.
    unit : str
        Such as ``kg``.
    cause : str
        Why the log does not determine the parameter, in a sentence; empty where it does.
    joint_estimate : float or None
        What the log suggests for a parameter that is held: the estimate of the last fit in which
        it was free. None for a parameter that is free in the fit.
    origin : str
        Where the prior of a vehicle comes from, such as ``formula``; empty for sensors.
    is_contradicted : bool
        Whether the log contradicts the prior of a vehicle: it determines the value, which is
        further from the prior than twice √(std² + standard error²).

    Examples
    --------
    >>> print(free := Estimate(14.2, 0.1, 12.0, "kg"))
    14.2 ± 0.2 kg (95 %; prior 12)
    >>> print(free.hold_at_prior())
    12 kg (prior, not determined; joint estimate 14.2 ± 0.2, 95 %)
    """

    value: float
    standard_error: float
    prior: float
    unit: str
    cause: str = ""
    joint_estimate: float | None = None
    origin: str = ""
    is_contradicted: bool = False

    @property
    def is_held(self) -> bool:
        """Whether the fit holds the parameter at its prior."""
        return self.joint_estimate is not None

    @property
    def is_moved(self) -> bool:
        """Whether the log determines another value of the vehicle: 95 % exclude the prior."""
        distance = abs(self.value - self.prior)
        is_outside = distance > critical_value() * self.standard_error
        return bool(self.origin) and self.is_determined and is_outside

    @property
    def is_determined(self) -> bool:
        """Whether the log determines the parameter."""
        return not self.cause

    def hold_at_prior(self) -> Estimate:
        """Return the parameter at its prior, with the value as joint estimate."""
        return replace(self, value=self.prior, joint_estimate=self.value)

    @property
    def grade(self) -> Grade:
        """The grade of the parameter."""
        return Grade.DETERMINED if self.is_determined else Grade.NOT_DETERMINED

    def __str__(self) -> str:
        """Return the estimate with its 95 % interval and prior."""
        half, unit = critical_value() * self.standard_error, f" {self.unit}".rstrip()
        if self.joint_estimate is not None:
            joint = f"joint estimate {self.joint_estimate:.4g} ± {half:.2g}, 95 %"
            return f"{self.value:.4g}{unit} (prior, not determined; {joint})"
        suffix = "" if self.is_determined else ", not determined"
        return f"{self.value:.4g} ± {half:.2g}{unit} (95 %; prior {self.prior:.4g}{suffix})"


@dataclass(frozen=True)
class Parameter:
    """A parameter θ with prior mean zero: its physical value is ``prior + θ`` or ``prior exp(θ)``.

    ``std`` is the prior standard deviation of θ. The estimate of a right prior with an independent
    error of standard error s has the variance std² + s², a posterior mean even less: its distance
    from the prior is beyond MAX_DEVIATION of these roots in at most 5 % of draws.
    """

    label: str
    unit: str
    std: float
    prior: float = 0.0
    transform: Literal["identity", "logarithm"] = "identity"
    origin: str = ""

    def estimate(self, theta: float, error: float, cause: str = "") -> Estimate:
        """Return the physical value and standard error of θ."""
        value, slope = self.prior + theta, 1.0
        if self.transform == "logarithm":
            value = slope = self.prior * float(np.exp(theta))
        is_contradicted = abs(theta) > MAX_DEVIATION * np.hypot(self.std, error) and not cause
        return Estimate(
            value,
            slope * error,
            self.prior,
            self.unit,
            cause,
            origin=self.origin,
            is_contradicted=bool(self.origin) and bool(is_contradicted),
        )


def assign_parameters(
    sensor_log: SensorLog,
) -> tuple[tuple[Parameter, ...], list[dict[str, IntArray]]]:
    """Return the parameters to estimate, and the indices of those of each sensor by name."""
    parameters: list[Parameter] = []
    current: IntArray | None = None
    indices: list[dict[str, IntArray]] = []
    for sensor in sensor_log.sensors:
        by_name: dict[str, IntArray] = {}
        for name in sensor.measurement.estimate:
            if name == "current" and current is not None:
                by_name[name] = current
                continue
            added = _sensor_parameters(name, sensor, sensor_log)
            by_name[name] = np.arange(len(parameters), len(parameters) + len(added))
            parameters += added
            current = by_name[name] if name == "current" else current
        indices.append(by_name)
    return tuple(parameters), indices


def _sensor_parameters(name: str, sensor: Sensor, sensor_log: SensorLog) -> list[Parameter]:
    """Return the parameters of a name, with priors from the data."""
    measurement, log = sensor.measurement, sensor_log.log
    speed, rate = (
        float(np.sqrt(np.mean(log.velocity[:, axes] ** 2))) for axes in (slice(3), slice(3, 6))
    )
    if name == "bias":
        spread = np.maximum(np.nanstd(measurement.values, axis=0), sensor.std)
        pairs = zip(measurement.components, spread.tolist(), strict=True)
        unit = KIND_UNITS[sensor.kind]
        return [Parameter(f"{measurement.name} bias {axis}", unit, std) for axis, std in pairs]
    if name == "delay":
        return [Parameter(f"{measurement.name} delay", "s", log.time_scale)]
    if name == "current":
        return [Parameter(f"current {axis}", "m/s", speed) for axis in KINDS["position"]]
    length = speed / rate if rate > 0.0 else 1.0
    return [Parameter(f"{measurement.name} lever arm {axis}", "m", length) for axis in "xyz"]


def vehicle_parameters(vehicle: Vehicle, forced: Sequence[str] = ()) -> tuple[Parameter, ...]:
    """Return the parameters of a vehicle: its guesses, and those of the forced groups."""
    guesses = [name.replace("_", "-") for name in (*vehicle.std, *vehicle.estimate)]
    if not vehicle.free[2:5].any():
        guesses = [name for name in guesses if name != "buoyancy"]
    names = (*guesses, *forced)
    if "added-mass" in names and vehicle.added_mass is None:
        raise MethodError(
            f"the file of '{vehicle.name}' states the whole mass matrix: give `rigid_body` and "
            "`added_mass` apart, so that added mass can be estimated"
        )
    return tuple(_vehicle_parameters(vehicle, names))


def _vehicle_parameters(vehicle: Vehicle, names: Sequence[str]) -> Iterator[Parameter]:
    known, origin = vehicle.std, dict.fromkeys(COMPONENTS, "assumed") | dict(vehicle.origin)
    if "added-mass" in names and vehicle.added_mass is not None:
        rows = zip(
            AXES,
            vehicle.added_mass.diagonal().tolist(),
            known.get("added_mass", (ADDED_MASS_STD,) * 6),
            strict=True,
        )
        for axis, (name, added, std) in enumerate(rows):
            unit = "kg" if axis < 3 else "kg m²"
            if added > 0.0 < std and vehicle.free[axis]:
                yield Parameter(f"A_{name}", unit, std, added, "logarithm", origin["added_mass"])
    if "center-of-gravity" in names:
        inertia = vehicle.mass_matrix.diagonal()
        usual = CENTER_STD * float(np.sqrt(inertia[3:].max() / inertia[:3].max()))
        stds = known.get("center_of_gravity", (usual,) * 3)
        for name, prior, std in zip("xyz", vehicle.center_of_gravity.tolist(), stds, strict=True):
            if std > 0.0:
                yield Parameter(f"{name}_G", "m", std, prior, origin=origin["center_of_gravity"])
    (share,) = known.get("buoyancy", (BUOYANCY_STD,))
    if "buoyancy" in names and share > 0.0:
        if not vehicle.weight > 0.0:
            raise MethodError("buoyancy cannot be estimated: the vehicle file has no weight")
        std = share * vehicle.weight
        yield Parameter("B", "N", std, vehicle.buoyancy, origin=origin["buoyancy"])


def wrench_parameters(problem: Problem, model: DampingModel) -> Iterator[Parameter]:
    """Yield the gain of a recorded wrench on each axis where it varies and no term has a gain."""
    vehicle, wrench = problem.vehicle, problem.log.wrench
    if wrench is None:
        return
    varies = np.ptp(wrench, axis=0) > 0.0
    stds = vehicle.std.get("wrench_gain", (WRENCH_GAIN_STD,) * 6)
    origin = vehicle.origin.get("wrench_gain", "assumed")
    for axis, name in enumerate(AXES):
        has_gain = any(term.commands for term in model.terms[axis])
        if varies[axis] and vehicle.free[axis] and stds[axis] > 0.0 and not has_gain:
            prior = float(vehicle.wrench_gain[axis])
            yield Parameter(f"gain_{name}", "", stds[axis], prior, "logarithm", origin)


def rebuild_plant(
    problem: Problem, model: DampingModel, parameters: Sequence[Parameter]
) -> Callable[[FloatArray], Problem]:
    """Return the function that gives the problem of one model with the vehicle at θ."""
    labels = [each.label for each in parameters]
    moved = vehicle_at(problem.vehicle, {each.label: each.std for each in parameters})
    pairs = zip(map(Term.parse, DOWN), moved.restoring_matrix.T, strict=True)
    restoring = [term for term, wrench in pairs if wrench.any()]  # also where it is zero at θ

    @lru_cache(maxsize=len(parameters) + 1)  # windows of all lengths have the same θ
    def rebuild(*theta: float) -> Problem:
        vehicle = vehicle_at(problem.vehicle, dict(zip(labels, theta, strict=True)))
        table = equation_table(
            vehicle,
            (model,),
            actuators=problem.equations.actuators,
            propulsion_known=problem.propulsion_known,
            zeros=restoring,
        )
        wrench = problem.inputs.wrench * (vehicle.wrench_gain / problem.vehicle.wrench_gain)
        columns = [problem.equations.channels.index(name) for name in table.channels]
        inputs = replace(problem.inputs, channels=problem.inputs.channels[:, columns])
        if vehicle.actuators != problem.vehicle.actuators:
            inputs = build_inputs(table, problem.log)
        return replace(
            problem,
            models=(model,),
            equations=table.restrict_to(model),  # the channels of this model alone
            inputs=replace(inputs, wrench=wrench),
        )

    return lambda theta: rebuild(*theta.tolist())


def free_gains(problem: Problem, model: DampingModel) -> list[str]:
    """Return the axes on which a command has an unknown gain."""
    actuated = set(channel_names(problem.vehicle, problem.log))
    return [
        AXES[axis]
        for axis, terms in enumerate(model.terms)
        if any(set(term.commands) - actuated for term in terms)
    ]
