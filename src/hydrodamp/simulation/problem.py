"""A vehicle, a log and the terms asked for, turned into equation 1 as one table of arrays."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.basis.atoms import FIRST_CHANNEL
from hydrodamp.basis.basis import Basis, guarded_speed
from hydrodamp.data.log import Log
from hydrodamp.errors import ModelError, PropulsionWarning
from hydrodamp.kernels import core
from hydrodamp.kernels.plant import Inputs, Plant
from hydrodamp.models.damping import Damping, VehicleStamp
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.actuation import actuation_channels
from hydrodamp.simulation.checks import check_log
from hydrodamp.vehicle.vehicle import Vehicle, mass_matrix_digest


def vehicle_stamp(vehicle: Vehicle) -> VehicleStamp:
    """Return what a damping file says of the vehicle it belongs to."""
    digest = mass_matrix_digest(vehicle.mass_matrix)
    return VehicleStamp(vehicle.name, vehicle.weight, vehicle.buoyancy, digest)


def vehicle_digest(vehicle: Vehicle) -> str:
    """Return what tells a vehicle from another: all that is known of it."""
    seen = hashlib.sha256()
    for field in fields(vehicle):
        value = getattr(vehicle, field.name)
        is_array = isinstance(value, np.ndarray)
        seen.update(field.name.encode())
        seen.update(np.ascontiguousarray(value).data if is_array else repr(value).encode())
    return seen.hexdigest()


# A channel that is always zero; no command can have this name.
_ZERO = ""


@dataclass(frozen=True)
class EquationTable:
    """The table of equation 1 for one vehicle and the terms asked for.

    Attributes
    ----------
    vehicle : Vehicle
        Whose mass matrix, restoring forces and actuators are used.
    basis : Basis
        The unknown columns, restricted to the free axes.
    channels : tuple of str
        The held channels, in the order of the table.
    plant : Plant
        Known columns first, then ``basis``.
    known : ndarray, shape (n_known, 6)
        Coefficients of the known columns, force [N] and moment [N m] per unit
        of the column, on the right-hand side, body frame.
    actuators : bool
        Whether the vehicle's actuators are among the known columns; not where
        the log has their wrench itself.
    """

    vehicle: Vehicle
    basis: Basis
    channels: tuple[str, ...]
    plant: Plant
    known: FloatArray
    actuators: bool

    @cached_property
    def required_commands(self) -> tuple[str, ...]:
        """Return the commands without which no sample can be made, sorted."""
        names = {name for term in self.basis for name in term.commands}
        return tuple(sorted(names | set(self.vehicle.commands if self.actuators else ())))

    @property
    def n_known(self) -> int:
        """How many columns are known."""
        return len(self.known)

    def with_unknown(
        self, entries: tuple[np.ndarray, np.ndarray], coefficients: FloatArray
    ) -> FloatArray:
        """Return the table with ``coefficients`` put at ``entries``."""
        matrix = self.scatter(entries, coefficients)
        matrix[: self.n_known] = self.known
        return matrix

    def scatter(self, entries: tuple[np.ndarray, np.ndarray], values: FloatArray) -> FloatArray:
        """Return a table of zeros with ``values`` put at ``entries``."""
        table = np.zeros((self.n_known + len(self.basis), 6))
        table[entries] = values
        return table

    def require(self, model: DampingModel) -> None:
        """Refuse a model with terms that are no columns of the basis.

        Parameters
        ----------
        model : DampingModel
            Restricted to the free axes.

        Raises
        ------
        ModelError
            Names the terms that were not asked for when the log was prepared.
        """
        missing = [str(term) for term in model.basis if term not in self.basis]
        if missing:
            raise ModelError(
                f"model '{model.key}' has terms this problem was not prepared for: "
                f"{' '.join(missing)}. Name the model in `prepare(vehicle, log, models)`."
            )

    def restrict_to(self, model: DampingModel) -> EquationTable:
        """Return the table without the unknown columns that a model has no term of."""
        self.require(model)
        unknown = [self.n_known + self.basis.index(term) for term in model.basis]
        factors = self.plant.factors[[*range(self.n_known), *unknown]]
        return replace(self, basis=model.basis, plant=replace(self.plant, factors=factors))

    def entries(self, model: DampingModel) -> tuple[np.ndarray, np.ndarray]:
        """Return rows and axes of the table where the model's coefficients stand.

        Parameters
        ----------
        model : DampingModel
            Its terms must be columns of the basis.

        Returns
        -------
        rows, axes : ndarray of int, shape (n_coefficients,)
            In the order of the model's labels.

        Raises
        ------
        ModelError
            If a term of the model was not asked for when the log was prepared.
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
) -> EquationTable:
    """Write equation 1 of a vehicle and some models as one table.

    Parameters
    ----------
    vehicle : Vehicle
        Gives the known columns.
    models : tuple of DampingModel
        Give the unknown ones, restricted to the free axes.
    actuators : bool
        False where the log has the wrench of the actuators itself.
    propulsion_known : bool
        False makes the columns of terms with (eta-1) zero at every sample.

    Returns
    -------
    columns : Columns
        Known columns first.
    """
    basis = Basis.union(*(model.restricted_to(vehicle.axes).basis for model in models))
    known = (vehicle if actuators else replace(vehicle, actuators=())).known_columns()
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
    """Return the channels of a table, sample by sample."""
    made = table.vehicle.channels(commands) if table.actuators else {}
    found = {**commands, **made, _ZERO: np.zeros(n)}
    channels = np.empty((n, len(table.channels)))
    for place, name in enumerate(table.channels):
        channels[:, place] = found[name]
    return channels


@dataclass(frozen=True)
class Problem:
    """The only input of every method: equation 1 filled with a log.

    It holds no acceleration: an estimate of it is a value of the method.

    Attributes
    ----------
    log : Log
        What was measured.
    models : tuple of DampingModel
        What was asked for, restricted to the vehicle's free axes.
    columns : Columns
        Equation 1 as one table; ``columns.basis`` are the unknown terms.
    inputs : Inputs
        Velocity, attitude, wrench and held channels, sample by sample.
    segments : ndarray of int, shape (n_segments, 2)
        First sample and one past the last of each segment.
    propulsion_known : bool
        Whether the log has a propulsion ratio, or a propeller's speed that gives one.
    """

    log: Log
    models: tuple[DampingModel, ...]
    equations: EquationTable
    inputs: Inputs
    segments: IntArray
    propulsion_known: bool = True

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle it was prepared for."""
        return self.equations.vehicle

    @property
    def n_samples(self) -> int:
        """How many samples the log has."""
        return len(self.inputs.time)

    @property
    def durations(self) -> FloatArray:
        """Time that each segment covers [s]."""
        first, last = self.inputs.time[self.segments - [0, 1]].T
        return np.asarray(last - first)

    @property
    def duration(self) -> float:
        """Time covered by all segments together, without what is between them [s]."""
        return float(np.sum(self.durations))

    @property
    def segment_numbers(self) -> IntArray:
        """Number of the segment each sample is from, shape (n,)."""
        return np.repeat(np.arange(len(self.segments)), np.diff(self.segments, axis=1).ravel())

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the vehicle and of all that was measured, whatever files it came from."""
        said = (self.log.command_names, self.segments.tolist(), vehicle_digest(self.vehicle))
        seen = hashlib.sha256(repr(said).encode())
        for field in fields(self.log):
            value = getattr(self.log, field.name)
            if isinstance(value, np.ndarray):
                seen.update(field.name.encode() + np.ascontiguousarray(value).data)
        return seen.hexdigest()

    def regressor(
        self,
        start: int = 0,
        stop: int | None = None,
        *,
        step: int = 1,
        out: FloatArray | None = None,
    ) -> FloatArray:
        """Return the columns of equation 1, known first, at some samples.

        Parameters
        ----------
        start, stop : int, optional
            First sample and one past the last; all by default.
        step : int, optional
            Take one sample in this many.
        out : ndarray, shape (n, n_known + n_terms), optional
            Array of any strides to fill; a new one by default.

        Returns
        -------
        regressor : ndarray, shape (n, n_known + n_terms)
            In the paper the unknown part is xi.
        """
        part = slice(start, stop, step)
        return core.regressor(
            self.equations.plant.factors,
            self.inputs.velocity[part],
            self.inputs.down[part],
            self.inputs.channels[part],
            self.inputs.propulsion[part, 0],
            out=out,
        )

    def matrix(self, damping: Damping) -> FloatArray:
        """Return all coefficients of equation 1, known and identified, as one table.

        Parameters
        ----------
        damping : Damping
            Its terms on free axes must be columns of the basis.

        Returns
        -------
        matrix : ndarray, shape (n_known + n_terms, 6)
            One row a column of equation 1.
        """
        free = damping.model.restricted_to(self.vehicle.axes)
        return self.equations.with_unknown(self.equations.entries(free), damping.onto(free))

    def extend_to(self, *models: DampingModel) -> Problem:
        """Return the problem with columns of further models; itself where it has them all."""
        free = tuple(model.restricted_to(self.vehicle.axes) for model in models)
        if all(term in self.equations.basis for model in free for term in model.basis):
            return self
        return _filled(self.vehicle, self.log, (*self.models, *free))

    def undetermined(self, model: DampingModel) -> tuple[tuple[str], ...]:
        """Return the labels with (eta-1) where the ratio is unknown, each a group of its own."""
        terms = (term for row in model.terms for term in row)
        return tuple(
            (label,)
            for label, term in zip(model.labels, terms, strict=True)
            if term.needs_propulsion and not self.propulsion_known
        )


def prepare(vehicle: Vehicle, log: Log, models: Iterable[DampingModel] | DampingModel) -> Problem:
    """Turn a vehicle, a log and the models asked for into arrays.

    Parameters
    ----------
    vehicle : Vehicle
        Everything known; its free axes decide which velocities are needed.
    log : Log
        What was measured.
    models : DampingModel or iterable of DampingModel
        Whose terms are to be identified.

    Returns
    -------
    problem : Problem
        The input of every method.

    Raises
    ------
    ProblemError
        If the log lacks what the vehicle or a term needs: every lack is named.
    """
    asked = (models,) if isinstance(models, DampingModel) else tuple(models)
    free = tuple(model.restricted_to(vehicle.axes) for model in asked)
    check_log(vehicle, log, free)
    problem = _filled(vehicle, log, free)
    if any(problem.undetermined(model) for model in free):
        warnings.warn(
            "the log has no `eta` and the vehicle no propeller with a speed: the propulsion ratio "
            "is taken as one, so coefficients of terms with (eta-1) cannot be identified and are "
            "zero",
            PropulsionWarning,
            stacklevel=2,
        )
    return problem


def _filled(vehicle: Vehicle, log: Log, models: tuple[DampingModel, ...]) -> Problem:
    commands = {name: log.command(name) for name in log.command_names}
    held = vehicle.propulsion_speed(commands)
    known = log.propulsion_ratio is not None or held is not None
    actuators = bool(vehicle.actuators) and log.wrench is None
    table = equation_table(vehicle, models, actuators=actuators, propulsion_known=known)
    if not commands.keys() >= {name for term in table.basis for name in term.commands}:
        commands = {**actuation_channels(vehicle, log), **commands}
    velocity = log.velocity * vehicle.free
    inputs = Inputs(
        time=log.time,
        velocity=velocity,
        down=log.down,
        wrench=np.zeros((log.n, 6)) if log.wrench is None else log.wrench * vehicle.free,
        channels=held_channels(table, commands, log.n),
        propulsion=_propulsion(log, velocity, held),
    )
    return Problem(log, models, table, inputs, log.bounds, propulsion_known=known)


def _propulsion(log: Log, velocity: FloatArray, held: FloatArray | None) -> FloatArray:
    """Return u_c at each sample as a step begins there and as one ends there."""
    if log.propulsion_ratio is not None or held is None:
        ratio = 1.0 if log.propulsion_ratio is None else log.propulsion_ratio
        recorded = ratio * guarded_speed(velocity)
        return np.column_stack([recorded, recorded])
    closing = np.concatenate([held[:1], held[:-1]])
    starts = log.bounds[:, 0]
    closing[starts] = held[starts]
    return np.column_stack([held, closing])
