"""Added mass, centre of gravity and buoyancy of a vehicle, estimated together with the damping.

Parameters μ of the vehicle join the coefficients in the objective of output error, each with a
prior. Added mass is A(μ) = D A₀ D with D = diag(exp(μ/2)): the rows of its Cholesky factor are
scaled, so the mass matrix stays symmetric and positive definite. Slopes on μ are differences; the
variance is that of a delete-one-block jackknife plus the squares of half the difference of
estimates from two halves, of the undamped step that the minimisation has left and of the share of
the prior. Terms that the
model lacks and coloured sensor errors bias μ, also on axes whose own residuals are small: unless
all residuals are at the level of the white noise, no parameter is determined.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.continuation import RELATIVE_TOLERANCE, fit_windows
from hydrodamp.identification.fit import MIN_BLOCKS, critical_value, jackknife
from hydrodamp.identification.gauss_newton import (
    FINAL_TOLERANCE,
    minimise,
    newton_step,
    prior_share,
)
from hydrodamp.identification.grades import Grade
from hydrodamp.identification.held_out_replay import leave_one_out, split_pieces
from hydrodamp.identification.initial_iterate import make_objective
from hydrodamp.identification.multiple_shooting import (
    LinearisedResiduals,
    Outputs,
    ResidualSeries,
    Windows,
)
from hydrodamp.identification.output_error import half_estimates, update_estimate
from hydrodamp.identification.residual_level import highest_residual_level
from hydrodamp.identification.sensor_outputs import SensorOutputs
from hydrodamp.identification.sensor_parameters import SensorParameter
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

#: Posterior over prior standard deviation from which a parameter is not determined by the log.
MAX_DETERMINED_RATIO = 0.7

#: Steps of the last minimisation: mass and damping have a narrow valley.
MAX_STEPS = 40

#: Step of differences over the prior standard deviation.
DIFFERENCE_STEP = 0.01


#: Causes of a parameter that is not determined.
_WIDE = f"The standard error is at least {100.0 * MAX_DETERMINED_RATIO:.0f} % of the prior's."
_SCALE = "The gains of commands are free: the scale of the axis is open."


class ParameterEstimate(NamedTuple):
    """Value, standard error and prior value of a parameter, and why it is not determined."""

    value: float
    standard_error: float
    prior: float
    unit: str
    cause: str = ""

    @property
    def is_determined(self) -> bool:
        """Whether the log determines the parameter."""
        return not self.cause

    @property
    def grade(self) -> Grade:
        """The grade of the parameter."""
        return Grade.DETERMINED if self.is_determined else Grade.NOT_DETERMINED


@dataclass(frozen=True)
class VehicleEstimate:
    """Estimated parameters by label, the vehicle that has them, and remarks.

    Attributes
    ----------
    parameters : dict of str to ParameterEstimate
        Added mass of an axis such as ``A_Y`` [kg, kg m²], centre of gravity ``x_G`` ``y_G``
        ``z_G`` [m] and buoyancy ``B`` [N].
    vehicle : Vehicle
        With the estimates of the parameters that the log determines, and the priors of the others.
    remarks : tuple of str
        What cannot be determined, and why.

    Examples
    --------
    >>> import hydrodamp as hd
    >>> estimate = VehicleEstimate({}, hd.fleet["vt690"], ("The log determines no added mass.",))
    >>> print(estimate)
    The log determines no added mass.
    """

    parameters: dict[str, ParameterEstimate]
    vehicle: Vehicle
    remarks: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return a line for each parameter and remark."""
        half = critical_value()
        lines = [
            f"{label} {each.value:.4g} ± {half * each.standard_error:.2g} {each.unit} (95 %; prior "
            f"{each.prior:.4g}{'' if each.is_determined else ', not determined'})"
            for label, each in self.parameters.items()
        ]
        return "\n".join((*lines, *self.remarks))


def estimate_vehicle_parameters(
    problem: Problem, model: DampingModel, names: Sequence[str] = ("added-mass",)
) -> VehicleEstimate:
    """Estimate parameters of the vehicle together with the coefficients of a model.

    Parameters
    ----------
    problem : Problem
        Vehicle and log, prepared for the model.
    model : DampingModel
        Its coefficients are estimated anew for every trial.
    names : sequence of str, optional
        ``added-mass``, ``center-of-gravity`` or ``buoyancy``.

    Returns
    -------
    estimate : VehicleEstimate
        Parameters with standard errors, and the vehicle.

    Raises
    ------
    MethodError
        If a name is unknown, or the vehicle does not state its added mass.

    Examples
    --------
    >>> import hydrodamp as hd
    >>> campaign, model = hd.reenact(seed=1, duration=20.0), hd.catalog["fossen"]
    >>> problem = hd.prepare(campaign.vehicle, campaign.train, model)
    >>> estimate = estimate_vehicle_parameters(problem, model, ["buoyancy"])
    >>> sorted(estimate.parameters)
    ['B']
    """
    unknown = [name for name in names if name not in VEHICLE_PARAMETERS]
    demand(not unknown and len(names) > 0, "names", ", ".join(VEHICLE_PARAMETERS), names)
    vehicle, model = problem.vehicle, model.restricted_to(problem.vehicle.axes)
    if "added-mass" in names and vehicle.added_mass is None:
        raise MethodError(
            f"the file of '{vehicle.name}' states the whole mass matrix: give `rigid_body` and "
            "`added_mass` apart, so that added mass can be estimated"
        )
    parameters = _parameters(vehicle, names)
    problem = replace(problem, equations=problem.equations.restrict_to(model))
    objective = make_objective(problem, model)
    std = np.array([each.std for each in parameters])
    base, names_of_outputs = objective.outputs, [VELOCITY_OF[axis] for axis in vehicle.axes]
    if isinstance(base, SensorOutputs):
        names_of_outputs = list(base.labels)
    outputs = _VehicleOutputs(base, vehicle, model, parameters)
    objective = replace(objective, outputs=outputs, scale=np.concatenate([objective.scale, std]))
    _, result = fit_windows(objective, model)
    tolerance = min(FINAL_TOLERANCE, RELATIVE_TOLERANCE / result.n_free)
    result = minimise(objective, result, tolerance, MAX_STEPS)
    mean, errors = result.coefficients[-len(std) :], std
    pieces = split_pieces(problem)
    if len(pieces) >= MIN_BLOCKS:
        replicates = leave_one_out(objective, result, pieces)[:, -len(std) :]
        halves = half_estimates(objective, pieces, partial(update_estimate, iterate=result))
        variance = np.diag(jackknife(replicates, problem.duration).covariance)
        difference = (halves[0] - halves[1])[-len(std) :] / 2.0
        remaining = newton_step(objective, result)[-len(std) :]
        prior = std * prior_share(objective, result)[-len(std) :]
        square = variance + difference**2 + remaining**2 + prior**2
        errors = np.minimum(np.sqrt(square), std)
    level = highest_residual_level(objective, result, names_of_outputs)
    gains = _free_gains(problem, model) if "added-mass" in names else []
    causes = [_WIDE if wide else "" for wide in (errors >= MAX_DETERMINED_RATIO * std).tolist()]
    remarks = []
    if gains:
        remarks.append(
            f"The gains of commands on {' '.join(gains)} are free: mass, damping and gains of such "
            "an axis have a common factor that no log determines. A known thrust [N], or a dive "
            "with a known ballast, resolves it."
        )
        scaled = [each.group == "added-mass" and AXES[each.axis] in gains for each in parameters]
        causes = [_SCALE if free else cause for free, cause in zip(scaled, causes, strict=True)]
    if level.is_excessive:
        causes = [f"{level}."] * len(causes)
        remarks.append(
            f"{level}: the model lacks terms, or sensor errors are coloured, and vehicle "
            "parameters absorb both. Choose a larger damping model, or take the values from a "
            "towing tank or strip theory."
        )
    if any(causes):
        labels = " ".join(each.label for each, why in zip(parameters, causes, strict=True) if why)
        remarks.append(f"The log does not determine {labels}: their priors are kept.")
    rows = zip(parameters, mean.tolist(), errors.tolist(), causes, strict=True)
    estimates = {each.label: each.estimate(*row) for each, *row in rows}
    if not all(causes):
        chosen = np.where([not cause for cause in causes], mean, 0.0)
        vehicle = _vehicle_at(vehicle, parameters, chosen)
    return VehicleEstimate(estimates, replace(vehicle, estimate=()), tuple(remarks))


class _Parameter(NamedTuple):
    """A parameter: group, axis, label, unit, prior value and prior standard deviation of μ."""

    group: str
    axis: int
    label: str
    unit: str
    prior: float
    std: float

    def estimate(self, value: float, error: float, cause: str) -> ParameterEstimate:
        """Return the parameter at μ with its standard error and why it is not determined."""
        if self.group == "added-mass":  # the logarithm
            size = self.prior * float(np.exp(value))
            return ParameterEstimate(size, size * error, self.prior, self.unit, cause)
        total = self.prior + value
        return ParameterEstimate(total, error, self.prior, self.unit, cause)


def _parameters(vehicle: Vehicle, names: Sequence[str]) -> tuple[_Parameter, ...]:
    parameters = []
    free = np.flatnonzero(vehicle.free).tolist()
    if "added-mass" in names and vehicle.added_mass is not None:
        for axis in free:
            added = float(vehicle.added_mass[axis, axis])
            if added > 0.0:
                unit = "kg" if axis < 3 else "kg m²"
                label = f"A_{AXES[axis]}"
                parameters.append(
                    _Parameter("added-mass", axis, label, unit, added, ADDED_MASS_STD)
                )
    if "center-of-gravity" in names:
        inertia = vehicle.mass_matrix.diagonal()
        gyration = float(np.sqrt(inertia[3:].max() / inertia[:3].max()))
        for axis, name in enumerate("xyz"):
            prior = float(vehicle.center_of_gravity[axis])
            std = CENTER_STD * gyration
            parameters.append(_Parameter("center-of-gravity", axis, f"{name}_G", "m", prior, std))
    if "buoyancy" in names:
        std = BUOYANCY_STD * vehicle.weight
        parameters.append(_Parameter("buoyancy", 0, "B", "N", vehicle.buoyancy, std))
    return tuple(parameters)


def _free_gains(problem: Problem, model: DampingModel) -> list[str]:
    """Return the axes on which a command has an unknown gain."""
    actuated = set(channel_names(problem.vehicle, problem.log))
    return [
        AXES[axis]
        for axis, terms in enumerate(model.terms)
        if any(set(term.commands) - actuated for term in terms)
    ]


def _vehicle_at(vehicle: Vehicle, parameters: Sequence[_Parameter], mu: FloatArray) -> Vehicle:
    """Return the vehicle at μ."""
    scale = np.zeros(6)
    added = np.zeros((6, 6)) if vehicle.added_mass is None else vehicle.added_mass
    rigid, center, buoyancy = vehicle.mass_matrix - added, vehicle.center_of_gravity, 0.0
    shift = np.zeros(3)
    for each, value in zip(parameters, mu.tolist(), strict=True):
        if each.group == "added-mass":
            scale[each.axis] = value
        elif each.group == "center-of-gravity":
            shift[each.axis] = value
        else:
            buoyancy = value
    factor = np.exp(0.5 * scale)
    mass = float(rigid[:3, :3].trace()) / 3.0
    moved, before = (
        rigid_body_mass_matrix(mass, np.zeros(3), point, "center_of_gravity")
        for point in (center + shift, center)
    )
    changed = added * np.outer(factor, factor)
    free = np.outer(vehicle.free, vehicle.free)
    return replace(
        vehicle,
        mass_matrix=rigid + (moved - before) * free + changed,
        added_mass=changed,
        center_of_gravity=center + shift,
        buoyancy=vehicle.buoyancy + buoyancy,
    )


@dataclass(frozen=True, eq=False)
class _VehicleOutputs:
    """Outputs whose last parameters are those of the vehicle, with differences as slopes."""

    base: Outputs
    vehicle: Vehicle
    model: DampingModel
    vehicle_parameters: tuple[_Parameter, ...]

    @property
    def interval(self) -> float:
        """Sampling interval of the slowest sensor [s]."""
        return self.base.interval

    @property
    def parameters(self) -> Sequence[SensorParameter]:
        """Parameters of sensors, then of the vehicle."""
        of_vehicle = (SensorParameter(each.label, "", each.std) for each in self.vehicle_parameters)
        return (*self.base.parameters, *of_vehicle)

    def jacobian_entries(self, windows: Windows) -> int:
        """Return the entries of the Jacobian of a window."""
        return self.base.jacobian_entries(windows)

    def weights(self, counts: FloatArray) -> FloatArray:
        """Return weights of the residuals of each output."""
        return self.base.weights(counts)

    def select(self, samples: IntArray) -> _VehicleOutputs:
        """Return the outputs of some samples."""
        return replace(self, base=self.base.select(samples))

    def _split(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        n = len(self.vehicle_parameters)
        return parameters[:-n], parameters[-n:]

    def _windows_at(self, windows: Windows, mu: FloatArray) -> Windows:
        """Return the windows of the vehicle at μ."""
        problem = windows.problem
        table = equation_table(
            _vehicle_at(self.vehicle, self.vehicle_parameters, mu),
            (self.model,),
            actuators=problem.equations.actuators,
            propulsion_known=problem.propulsion_known,
        ).restrict_to(self.model)
        entries = table.entries(self.model)
        changed = replace(problem, equations=table)
        return replace(windows, problem=changed, entries=entries, outputs=self.base)

    def residuals(self, windows: Windows, parameters: FloatArray) -> Iterator[ResidualSeries]:
        """Yield the residuals of the outputs."""
        known, mu = self._split(parameters)
        return self.base.residuals(self._windows_at(windows, mu), known)

    def linearise(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> LinearisedResiduals:
        """Linearise averages of the residuals."""
        known, mu = self._split(parameters)
        result = self.base.linearise(self._windows_at(windows, mu), known, residual_std)
        columns = [result.columns[:, :-1]]
        for index, each in enumerate(self.vehicle_parameters):
            moved = mu.copy()
            moved[index] += DIFFERENCE_STEP * each.std
            trial = self.base.linearise(self._windows_at(windows, moved), known, residual_std)
            change = result.columns[:, -1:] - trial.columns[:, -1:]
            columns.append(change / (DIFFERENCE_STEP * each.std))
        return result._replace(columns=np.hstack([*columns, result.columns[:, -1:]]))
