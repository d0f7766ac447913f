"""Online identifiers: what all laws share.

A law derives three types: the settings of its step in :class:`Adaptation`, its numbers and their
step in :class:`OnlineState`, and its public settings in :class:`OnlineIdentifier`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, Self, TypeVar

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.basis import guarded_speed
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.attitude import down_vectors, quaternion_from_euler
from hydrodamp.errors import MethodError, ProblemError, demand, did_you_mean
from hydrodamp.identification.differentiation import (
    regressor_mean_square,
    velocity_correlation_time,
)
from hydrodamp.identification.dissipativity import axis_terms
from hydrodamp.identification.fit import Fit, empty_fit
from hydrodamp.kernels import core
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, Problem, held_channels, vehicle_stamp
from hydrodamp.status import Status


def observe(
    equations: EquationTable,
    *,
    time: float,
    velocity: npt.ArrayLike,
    attitude: npt.ArrayLike = (0.0, 0.0, 0.0),
    commands: Mapping[str, float] | None = None,
    wrench: npt.ArrayLike | None = None,
    propulsion_ratio: float | None = None,
    previous: Sample | None = None,
) -> Sample:
    """Build a sample from the measurements at one instant.

    Parameters
    ----------
    equations : EquationTable
        Equation 1; gives the required commands.
    time : float
        Clock [s].
    velocity : array_like, shape (6,)
        u v w [m/s], p q r [rad/s], body frame.
    attitude : array_like, shape (3,) or (4,)
        Roll, pitch, yaw [rad], or a unit quaternion w x y z, body to
        north-east-down; level by default.
    commands : mapping of str to float, optional
        Commands, held until the next sample.
    wrench : array_like, shape (6,), optional
        Recorded wrench of the actuators, force [N] and moment
        [N m], body frame, on the right-hand side.
    propulsion_ratio : float, optional
        Recorded ratio; by default from the speed of the propeller.
    previous : Sample, optional
        The sample before, whose propeller speed was held until now.

    Returns
    -------
    sample : Sample
        Argument of ``step`` of an online identifier.

    Raises
    ------
    ProblemError
        If a command is missing, both wrench and actuators are given, a shape is wrong,
        or a number is not finite.
    """
    vehicle, free = equations.vehicle, equations.vehicle.free
    recorded = {name: np.array([value]) for name, value in (commands or {}).items()}
    for name in equations.required_commands:
        if name not in recorded:
            raise ProblemError(f"command '{name}' is missing.{did_you_mean(name, recorded)}")
    if equations.actuators and wrench is not None:
        raise ProblemError(
            "`wrench` would count the vehicle's actuators twice: omit it, or build the equation "
            "table from a log with a recorded wrench."
        )
    pose = np.asarray(attitude, dtype=np.float64)
    nu = frozen(velocity, (6,), "velocity", ProblemError)
    force = frozen(np.zeros(6) if wrench is None else wrench, (6,), "wrench", ProblemError)
    if pose.shape not in ((3,), (4,)):
        raise ProblemError(f"`attitude` must have shape (3,) or (4,); got {pose.shape}")
    speed = vehicle.propulsion_speed(recorded)
    if propulsion_ratio is not None or speed is None:
        ratio = 1.0 if propulsion_ratio is None else propulsion_ratio
        opening = closing = ratio * float(guarded_speed(nu * free))
    else:
        opening = float(speed[0])
        closing = opening if previous is None else float(previous.propulsion[0])
    sample = Sample.of(
        time=time,
        velocity=nu * free,
        down=down_vectors(pose if len(pose) == 4 else quaternion_from_euler(pose)),
        wrench=force * free,
        channels=held_channels(equations, recorded, 1)[0],
        propulsion=(opening, closing),
    )
    if not np.isfinite(sample.values).all():
        raise ProblemError(
            f"every number of a sample must be finite; at {sample.time} s one is not. Omit the "
            "sample, and after a longer gap use `state.restart(sample)`."
        )
    return sample


def initial_coefficients(model: DampingModel, known: Damping | None = None) -> FloatArray:
    """Return known coefficients, else those of the paper: −1 on the linear diagonal, else 0."""
    if known is not None:
        return known.onto(model)
    pairs = axis_terms(model)
    return np.array([-1.0 if str(term) == VELOCITIES[axis] else 0.0 for axis, term in pairs])


#: Correlation time of the velocities on board [s], where there is no log.
TYPICAL_TIME = 4.0

# Down vector and propulsion ratio that make no term zero.
_TYPICAL_DOWN, _TYPICAL_PROPULSION_RATIO = (0.3, 0.3, 0.9), 1.3


def check_typical_velocity(velocity: tuple[float, ...] | None) -> None:
    """Raise unless a typical velocity is absent or six positive numbers."""
    is_valid = velocity is None or (len(velocity) == 6 and all(0.0 < x < np.inf for x in velocity))
    demand(is_valid, "typical_velocity", "six positive numbers", velocity)


def find_scales(
    source: Problem | EquationTable, equations: EquationTable, velocity: tuple[float, ...] | None
) -> tuple[float, FloatArray]:
    """Return a correlation time [s] and the mean square of every unknown term.

    They are those of the log of a problem, or of a typical velocity.
    """
    if velocity is not None:
        nu, plant = np.array([velocity]), equations.plant
        propulsion = _TYPICAL_PROPULSION_RATIO * guarded_speed(nu)
        channels = np.ones((1, plant.n_channels))
        terms = core.regressor(plant.factors, nu, np.array([_TYPICAL_DOWN]), channels, propulsion)
        return TYPICAL_TIME, np.asarray(terms[0, equations.n_known :] ** 2)
    if not isinstance(source, Problem):
        raise MethodError(
            "these settings take the time scale and the size of each term from a log: bind the "
            "method to a problem prepared from an earlier log."
        )
    square = regressor_mean_square(source)
    if not np.all(np.isfinite(square)):
        raise MethodError("the mean square of a term is not finite: check the log for outliers.")
    return velocity_correlation_time(source), square


#: Rows and columns of coefficients in the table of equation 1.
Entries = tuple[np.ndarray, np.ndarray]

#: Settings of the step of a law, and its state.
Settings = TypeVar("Settings")
AnyState = TypeVar("AnyState", bound="OnlineState[Any]")


class Adaptation(NamedTuple, Generic[Settings]):
    """A law bound to a plant and a model, with its initial coefficients (p,)."""

    equations: EquationTable
    model: DampingModel
    entries: Entries
    start: FloatArray
    settings: Settings

    @property
    def table(self) -> FloatArray:
        """The coefficients of equation 1 before any data, (n_columns, 6)."""
        return self.equations.with_unknown(self.entries, self.start)


@dataclass(eq=False)
class OnlineState(ABC, Generic[Settings]):
    """State of an online identifier; a law adds its numbers."""

    adaptation: Adaptation[Settings]
    last: Sample

    @property
    @abstractmethod
    def coefficients(self) -> FloatArray:
        """The present estimate, in the order of the model's labels."""

    @abstractmethod
    def advance(self, sample: Sample) -> Self:
        """Return the state one sample later."""

    @abstractmethod
    def restart(self, sample: Sample) -> Self:
        """Return the state at the first sample after a gap, with the same coefficients.

        Parameters
        ----------
        sample : Sample
            First sample after the gap.

        Returns
        -------
        state : same type
            The given state is unchanged.
        """

    @property
    def damping(self) -> Damping:
        """The present estimate, with a stamp of its vehicle."""
        vehicle = vehicle_stamp(self.adaptation.equations.vehicle)
        return Damping(self.adaptation.model, self.coefficients, vehicle=vehicle)


class OnlineIdentifier(ABC, Generic[Settings, AnyState]):
    """A law that updates its estimate sample by sample."""

    #: Initial coefficients; those of the paper by default.
    start: Damping | None = None

    @property
    @abstractmethod
    def key(self) -> str:
        """The key on the command line."""

    @abstractmethod
    def _settings(
        self, source: Problem | EquationTable, equations: EquationTable, entries: Entries
    ) -> Settings:
        """Return the settings of the step for the coefficients at entries of equation 1."""

    @abstractmethod
    def _initial_state(self, bound: Adaptation[Settings], sample: Sample) -> AnyState:
        """Return the state at the first sample."""

    @abstractmethod
    def _estimate(self, problem: Problem, bound: Adaptation[Settings]) -> Fit:
        """Process the log and return the last estimate of one coefficient or more."""

    def bind(self, source: Problem | EquationTable, model: DampingModel) -> Adaptation[Settings]:
        """Bind the law to a plant and a model."""
        equations = source if isinstance(source, EquationTable) else source.equations
        free = model.restricted_to(equations.vehicle.axes)
        entries, start = equations.entries(free), initial_coefficients(free, self.start)
        settings = self._settings(source, equations, entries)
        return Adaptation(equations, free, entries, start, settings)

    def init(
        self, source: Problem | EquationTable, model: DampingModel, sample: Sample
    ) -> AnyState:
        """Return the state at the first sample.

        Parameters
        ----------
        source : Problem or EquationTable
            Equation 1; a problem from an earlier log where settings take scales from it.
        model : DampingModel
            Damping model to identify.
        sample : Sample
            First sample; see :func:`hydrodamp.observe`.

        Returns
        -------
        state : State or RecursiveState
            The initial coefficients, before any data.
        """
        return self._initial_state(self.bind(source, model), sample)

    def step(self, state: AnyState, sample: Sample) -> AnyState:
        """Return the state one sample later.

        Parameters
        ----------
        state : State or RecursiveState
            From ``init``, an earlier step, or ``state.restart(sample)`` after a gap.
        sample : Sample
            Next sample.

        Returns
        -------
        state : State or RecursiveState
            The given state is unchanged.

        Raises
        ------
        ProblemError
            If time does not advance.
        """
        return state.advance(sample)

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Process the log and return the last estimate."""
        bound = self.bind(problem, model)
        if not bound.model.n_coefficients:
            return empty_fit(problem, bound.model, self.key, Status.EMPTY)
        return self._estimate(problem, bound)
