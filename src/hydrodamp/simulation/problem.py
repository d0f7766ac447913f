"""The identification problem: equation 1 of a vehicle, with regressors and inputs from a log."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.basis.basis import Basis
from hydrodamp.basis.term import FIRST_CHANNEL, VELOCITY_OF, Term
from hydrodamp.conditioning.sensor_log import SensorLog, rebuild_velocities
from hydrodamp.data.attitude import find_slopes
from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampWarning, ModelError, PropulsionWarning
from hydrodamp.kernels import core
from hydrodamp.kernels.plant import Inputs, Plant
from hydrodamp.models.damping import Damping, VehicleStamp
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.checks import (
    actuation_channels,
    check_log,
    held_propulsion,
    recorded_wrench,
)
from hydrodamp.simulation.ranges import remove_implausible
from hydrodamp.vehicle.vehicle import Vehicle, mass_matrix_digest


def vehicle_stamp(vehicle: Vehicle) -> VehicleStamp:
    """Return the identification of a vehicle that is stored with its coefficients."""
    digest = mass_matrix_digest(vehicle.mass_matrix)
    return VehicleStamp(vehicle.name, vehicle.weight, vehicle.buoyancy, digest)


def vehicle_digest(vehicle: Vehicle) -> str:
    """Return a hash of all parameters of a vehicle."""
    sha = hashlib.sha256()
    for field in fields(vehicle):
        value = getattr(vehicle, field.name)
        is_array = isinstance(value, np.ndarray)
        sha.update(field.name.encode())
        sha.update(np.ascontiguousarray(value).data if is_array else repr(value).encode())
    return sha.hexdigest()


# Name of a channel that is always zero; no command can have it.
_ZERO = ""


@dataclass(frozen=True)
class EquationTable:
    """Equation 1 of one vehicle: known and unknown terms as one table.

    Attributes
    ----------
    vehicle : Vehicle
        Gives mass matrix, restoring wrench and actuators.
    basis : Basis
        The unknown terms, restricted to the free axes.
    channels : tuple of str
        The sampled-and-held channels, in the order of the table.
    plant : Plant
        Known terms first, then ``basis``.
    known : ndarray, shape (n_known, 6)
        Coefficients of the known terms, force [N] and moment [N m] per unit
        of the term, on the right-hand side, body frame.
    actuators : bool
        Whether the vehicle's actuators are among the known terms; False where the log
        has a recorded wrench.
    """

    vehicle: Vehicle
    basis: Basis
    channels: tuple[str, ...]
    plant: Plant
    known: FloatArray
    actuators: bool

    @cached_property
    def required_commands(self) -> tuple[str, ...]:
        """Commands that every sample requires, sorted."""
        names = {name for term in self.basis for name in term.commands}
        return tuple(sorted(names | set(self.vehicle.commands if self.actuators else ())))

    @property
    def n_known(self) -> int:
        """Number of known terms."""
        return len(self.known)

    def with_unknown(
        self, entries: tuple[np.ndarray, np.ndarray], coefficients: FloatArray
    ) -> FloatArray:
        """Return the coefficient matrix with unknown coefficients at ``entries``."""
        matrix = self.scatter(entries, coefficients)
        matrix[: self.n_known] = self.known
        return matrix

    def scatter(self, entries: tuple[np.ndarray, np.ndarray], values: FloatArray) -> FloatArray:
        """Return a matrix of zeros with ``values`` at ``entries``."""
        table = np.zeros((self.n_known + len(self.basis), 6))
        table[entries] = values
        return table

    def hold(self, matrix: FloatArray, model: DampingModel) -> EquationTable:
        """Return the table with all coefficients of a matrix known but those of a model."""
        known, factors = matrix.copy(), self.plant.factors
        known[self.entries(model)] = 0.0
        unknown = self.restrict_to(model).plant.factors[self.n_known :]
        plant = replace(self.plant, factors=np.vstack([factors, unknown]))
        return replace(self, basis=model.basis, plant=plant, known=frozen(known))

    def require(self, model: DampingModel) -> None:
        """Raise if a model has terms outside the basis.

        Parameters
        ----------
        model : DampingModel
            Restricted to the free axes.

        Raises
        ------
        ModelError
            Names the missing terms.
        """
        missing = [str(term) for term in model.basis if term not in self.basis]
        if missing:
            raise ModelError(
                f"model '{model.key}' has terms this problem was not prepared for: "
                f"{' '.join(missing)}. Name the model in `prepare(vehicle, log, models)`."
            )

    def restrict_to(self, model: DampingModel) -> EquationTable:
        """Return the table with only the unknown terms of a model."""
        self.require(model)
        unknown = [self.n_known + self.basis.index(term) for term in model.basis]
        factors = self.plant.factors[[*range(self.n_known), *unknown]]
        return replace(self, basis=model.basis, plant=replace(self.plant, factors=factors))

    def entries(self, model: DampingModel) -> tuple[np.ndarray, np.ndarray]:
        """Return rows and axes of a model's coefficients in the coefficient matrix.

        Parameters
        ----------
        model : DampingModel
            Its terms must be in the basis.

        Returns
        -------
        rows, axes : ndarray of int, shape (n_coefficients,)
            In the order of the model's labels.

        Raises
        ------
        ModelError
            If a term of the model is not in the basis.
        """
        self.require(model)
        pairs = [
            (self.n_known + self.basis.index(term), axis)
            for axis, terms in enumerate(model.terms)
            for term in terms
        ]
        rows, axes = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
        return rows, axes


def equation_table(
    vehicle: Vehicle,
    models: tuple[DampingModel, ...],
    *,
    actuators: bool,
    propulsion_known: bool = True,
    zeros: Sequence[Term] = (),
) -> EquationTable:
    """Build equation 1 of a vehicle with the terms of models.

    Parameters
    ----------
    vehicle : Vehicle
        Gives the known terms.
    models : tuple of DampingModel
        Give the unknown terms, restricted to the free axes.
    actuators : bool
        False where the log has a recorded wrench.
    propulsion_known : bool
        False sets terms with (eta-1) to zero at every sample.
    zeros : sequence of Term
        Terms that are known ones even where they are zero.

    Returns
    -------
    equations : EquationTable
        Known terms first.
    """
    basis = Basis.union(*(model.restricted_to(vehicle.axes).basis for model in models))
    columns = (vehicle if actuators else replace(vehicle, actuators=())).known_columns()
    known = dict.fromkeys(zeros, np.zeros(6)) | columns
    names = {name for term in (*known, *basis) for name in term.commands}
    idle = [term.needs_propulsion and not propulsion_known for term in basis]
    channels = (*sorted(names), *((_ZERO,) if any(idle) else ()))
    unknown = basis.atom_table(channels).copy()
    unknown[idle] = [FIRST_CHANNEL + len(channels) - 1, 0, 0, 0]
    table = np.vstack([Basis(tuple(known)).atom_table(channels), unknown])
    return EquationTable(
        vehicle=vehicle,
        basis=basis,
        channels=channels,
        plant=Plant(vehicle.mass_matrix, vehicle.free, table, len(channels)),
        known=frozen(np.reshape([*known.values()], (-1, 6)) * vehicle.free),
        actuators=actuators,
    )


def held_channels(table: EquationTable, commands: Mapping[str, FloatArray], n: int) -> FloatArray:
    """Return the channels of a table at each sample, shape (n, n_channels)."""
    derived = table.vehicle.channels(commands) if table.actuators else {}
    values = {**commands, **derived, _ZERO: np.zeros(n)}
    rows = [values[name] for name in table.channels]
    return np.array(rows, dtype=np.float64, ndmin=2).reshape(-1, n).T.copy()


@dataclass(frozen=True)
class Problem:
    """Input of every method: equation 1 with the measurements of a log.

    It has no acceleration: methods that need it estimate it.

    Attributes
    ----------
    log : Log
        The measurements.
    models : tuple of DampingModel
        The models, restricted to the vehicle's free axes.
    equations : EquationTable
        Equation 1; ``equations.basis`` are the unknown terms.
    inputs : Inputs
        Velocity, down vector, wrench and channels at each sample.
    segments : ndarray of int, shape (n_segments, 2)
        First sample and one past the last of each segment.
    propulsion_known : bool
        Whether the log has a propulsion ratio, or a propeller speed that gives one.
    sensor_log : SensorLog or None
        The sensors of the log, and the velocities rebuilt from them; None without sensors.
    """

    log: Log
    models: tuple[DampingModel, ...]
    equations: EquationTable
    inputs: Inputs
    segments: IntArray
    propulsion_known: bool = True
    sensor_log: SensorLog | None = None

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle."""
        return self.equations.vehicle

    @property
    def n_samples(self) -> int:
        """Number of samples."""
        return len(self.inputs.time)

    @property
    def durations(self) -> FloatArray:
        """Duration of each segment [s]."""
        first, last = self.inputs.time[self.segments - [0, 1]].T
        return np.asarray(last - first)

    @property
    def duration(self) -> float:
        """Sum of the durations of all segments [s]."""
        return float(np.sum(self.durations))

    @property
    def segment_numbers(self) -> IntArray:
        """Segment number of each sample, shape (n,)."""
        return np.repeat(np.arange(len(self.segments)), np.diff(self.segments, axis=1).ravel())

    def __repr__(self) -> str:
        """Return vehicle, data and models in a few lines."""
        names = " ".join(self.equations.channels)
        return "\n".join(
            (
                f"Problem of {self.vehicle.name}, axes {' '.join(self.vehicle.axes)}",
                f"  data: {self.n_samples} samples in {len(self.segments)} segments, "
                f"{self.duration:.4g} s, from {self.log.source or 'memory'}",
                f"  models: {', '.join(model.key for model in self.models) or 'none'}",
                f"  unknown terms: {len(self.equations.basis)}; channels: {names or 'none'}",
            )
        )

    @cached_property
    def digest(self) -> str:
        """SHA-256 of vehicle and measurements, independent of file names."""
        header = (self.log.command_names, self.segments.tolist(), vehicle_digest(self.vehicle))
        sha = hashlib.sha256(repr(header).encode())
        for field in fields(self.log):
            value = getattr(self.log, field.name)
            if isinstance(value, np.ndarray):
                sha.update(field.name.encode() + np.ascontiguousarray(value).data)
        return sha.hexdigest()

    def regressor(
        self,
        start: int = 0,
        stop: int | None = None,
        *,
        step: int = 1,
        out: FloatArray | None = None,
    ) -> FloatArray:
        """Return the regressors of equation 1, known terms first.

        Parameters
        ----------
        start, stop : int, optional
            First sample and one past the last; all by default.
        step : int, optional
            Stride over samples.
        out : ndarray, shape (n, n_known + n_terms), optional
            Output array of any strides; a new one by default.

        Returns
        -------
        regressor : ndarray, shape (n, n_known + n_terms)
            The unknown terms are ξ of the paper.
        """
        index = slice(start, stop, step)
        return core.regressor(
            self.equations.plant.factors,
            self.inputs.velocity[index],
            self.inputs.down[index],
            self.inputs.channels[index],
            self.inputs.propulsion[index, 0],
            out=out,
        )

    def matrix(self, damping: Damping) -> FloatArray:
        """Return the coefficient matrix of equation 1, known and identified.

        Parameters
        ----------
        damping : Damping
            Its terms on free axes must be in the basis.

        Returns
        -------
        matrix : ndarray, shape (n_known + n_terms, 6)
            One row per term of equation 1.
        """
        free = damping.model.restricted_to(self.vehicle.axes)
        return self.equations.with_unknown(self.equations.entries(free), damping.onto(free))

    def extend_to(self, *models: DampingModel) -> Problem:
        """Return the problem with the terms of further models; itself where it has them all."""
        free = tuple(model.restricted_to(self.vehicle.axes) for model in models)
        if all(term in self.equations.basis for model in free for term in model.basis):
            return self
        extended = build_problem(self.vehicle, self.log, (*self.models, *free))
        return replace(extended, sensor_log=self.sensor_log)

    @property
    def used_commands(self) -> tuple[str, ...]:
        """Commands of the log that the vehicle or an unknown term uses."""
        actuators = self.vehicle.commands if self.log.wrench is None else ()
        used = {*self.equations.required_commands, *actuators}
        return tuple(name for name in self.log.command_names if name in used)

    def with_log(self, log: Log) -> Problem:
        """Return the problem of the same vehicle and models with another log."""
        log, sensor_log = _rebuild(self.vehicle, log)
        return replace(build_problem(self.vehicle, log, self.models), sensor_log=sensor_log)

    def undetermined(self, model: DampingModel) -> tuple[tuple[str], ...]:
        """Return labels with (eta-1) where the propulsion ratio is unknown, as groups of one."""
        terms = (term for row in model.terms for term in row)
        return tuple(
            (label,)
            for label, term in zip(model.labels, terms, strict=True)
            if term.needs_propulsion and not self.propulsion_known
        )


def prepare(vehicle: Vehicle, log: Log, models: Iterable[DampingModel] | DampingModel) -> Problem:
    """Build the identification problem of a vehicle, a log and models.

    Parameters
    ----------
    vehicle : Vehicle
        Its free axes determine the required velocities.
    log : Log
        The measurements.
    models : DampingModel or iterable of DampingModel
        Models whose terms are to be identified.

    Returns
    -------
    problem : Problem
        The input of every method.

    Raises
    ------
    ProblemError
        If the log lacks data that the vehicle or a term requires; all are named.
    MethodError
        If `log` is not a log.

    Warns
    -----
    OutlierWarning
        For each channel with implausible samples, which are left out: beyond the range of the
        vehicle, "unknown" to MAVLink or a DVL, or a few that no motion explains. A channel that is
        mostly beyond the range is kept and named.
    """
    requested = (models,) if isinstance(models, DampingModel) else tuple(models)
    free = tuple(model.restricted_to(vehicle.axes) for model in requested)
    check_log(vehicle, log, free)
    log, sensor_log = _rebuild(vehicle, remove_implausible(vehicle, log, free))
    problem = replace(build_problem(vehicle, log, free), sensor_log=sensor_log)
    if any(problem.undetermined(model) for model in free):
        warnings.warn(
            "the log has no `eta` and the vehicle no propeller with a speed: the propulsion ratio "
            "is taken as one, so coefficients of terms with (eta-1) cannot be identified and are "
            "zero",
            PropulsionWarning,
            stacklevel=2,
        )
    return problem


def _rebuild(vehicle: Vehicle, log: Log) -> tuple[Log, SensorLog | None]:
    """Return the log with the velocities that it lacks, and its sensors, if any."""
    needed = [VELOCITY_OF[axis] for axis in vehicle.axes]
    if not log.measurements and set(needed) <= set(log.velocity_names):
        return log, None
    sensor_log = rebuild_velocities(log, needed)
    for sentence in sensor_log.remarks:
        warnings.warn(sentence, HydrodampWarning, stacklevel=4)
    return sensor_log.log, sensor_log


def build_problem(vehicle: Vehicle, log: Log, models: tuple[DampingModel, ...]) -> Problem:
    """Return the problem of a log whose channels are complete and plausible, or simulated."""
    commands = {name: log.command(name) for name in log.command_names}
    known = log.propulsion_ratio is not None or vehicle.propulsion_speed(commands) is not None
    actuators = bool(vehicle.actuators) and log.wrench is None
    table = equation_table(vehicle, models, actuators=actuators, propulsion_known=known)
    return Problem(log, models, table, build_inputs(table, log), log.bounds, propulsion_known=known)


def build_inputs(table: EquationTable, log: Log) -> Inputs:
    """Return the inputs of equation 1 of a log."""
    vehicle, commands = table.vehicle, {name: log.command(name) for name in log.command_names}
    speed = vehicle.propulsion_speed(commands)
    if not commands.keys() >= {name for term in table.basis for name in term.commands}:
        commands = {**actuation_channels(vehicle, log), **commands}
    velocity = log.velocity * vehicle.free
    return Inputs(
        time=log.time,
        velocity=velocity,
        down=log.down,
        wrench=recorded_wrench(vehicle, log),
        channels=held_channels(table, commands, log.n),
        propulsion=held_propulsion(log, velocity, speed),
        down_slope=find_slopes(log.down, log.time, log.bounds),
    )
