"""Adaptive identifier (section IV of the paper): estimation without acceleration.

The error dynamics are ``M Δν̇ = −a Δν + (K̂ − K) ξ(ν)`` with the velocity error Δν = ν̂ − ν; the
coefficients follow the gradient law ``dK̂_ij/dt = −γ_ij Δν_i ξ_j``. The error gains a scale with
the signal-to-noise ratio of each velocity, the adaptation gains γ with the mean square of each
term.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.basis import guarded_speed
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.attitude import down_vectors, quaternion_from_euler
from hydrodamp.errors import MethodError, ProblemError, demand, did_you_mean
from hydrodamp.identification.differentiation import regressor_mean_square, signal_to_noise
from hydrodamp.identification.dissipativity import axis_terms
from hydrodamp.identification.fit import Fit, empty_fit, make_fit
from hydrodamp.identification.regression import BLOCK, Triangle
from hydrodamp.identification.weak_form import step_equations
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
        Argument of :meth:`AdaptiveIdentifier.step`.

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


def require_problem(source: Problem | EquationTable, quantity: str) -> Problem:
    """Return a source that is a problem; raise for settings that need a log."""
    if isinstance(source, Problem):
        return source
    raise MethodError(
        f"these settings take the {quantity} from a log: bind the method to a problem prepared "
        "from an earlier log."
    )


@dataclass(frozen=True)
class NoiseScaledGain:
    """Error gains ``a_i = share · SNR_i · M_ii``, SNR_i of the velocity on axis i.

    Noise of a measured velocity enters both the error and the terms. The bias of the
    coefficients from this correlation is about ``a_i / SNR_i``. The gain is therefore large
    for a clean velocity and small for a noisy one: ``share`` bounds the bias, relative to
    ``M_ii``, per second.

    Parameters
    ----------
    share : float
        Bandwidth over signal-to-noise ratio (of variances) [1/s].

    Raises
    ------
    MethodError
        If it is not positive.
    """

    share: float = 0.02

    def __post_init__(self) -> None:
        """Check the gain."""
        axis_gains(self.share, "share")


@dataclass(frozen=True)
class TermScaledGain:
    """Adaptation gains ``γ_ij = a_i / (settling · n_i mean ξ_j²)``, n_i terms on axis i.

    All coefficients converge at a similar rate, independent of their units, the inertia of
    their axis and the size of the model: a well excited one settles in about ``settling``
    seconds. The proof of the paper holds for any positive diagonal gains.

    Parameters
    ----------
    settling : float
        Settling time of a coefficient [s].

    Raises
    ------
    MethodError
        If it is not positive.
    """

    settling: float = 100.0

    def __post_init__(self) -> None:
        """Check the gain."""
        axis_gains(self.settling, "settling")


#: One gain for all axes, or six in the order X Y Z K M N.
AxisGains = float | tuple[float, ...]


def axis_gains(gain: AxisGains, name: str) -> FloatArray:
    """Return the positive gains of six axes from one gain or six."""
    gains = np.asarray(gain, dtype=np.float64)
    fits = gains.shape in ((), (6,)) and bool(np.all((gains > 0.0) & (gains < np.inf)))
    demand(fits, name, "one positive number or six, one an axis X Y Z K M N", gain)
    return np.broadcast_to(gains, (6,)).copy()


#: Share [1] of the damping wrench of an axis that the residuals of a converged estimate contain.
MAX_RESIDUAL_SHARE = 0.1


@dataclass(frozen=True)
class History:
    """Estimates over time, at every ``every``-th step.

    Attributes
    ----------
    time : ndarray, shape (k,)
        Clock of the log [s].
    velocity_error : ndarray, shape (k, 6)
        Estimated minus measured velocity; in the paper Delta v.
    coefficients : ndarray, shape (k, n_coefficients)
        In the order of the model's labels.
    labels : tuple of str
        Those labels.
    """

    time: FloatArray
    velocity_error: FloatArray
    coefficients: FloatArray
    labels: tuple[str, ...]


class Adaptation(NamedTuple):
    """The identifier bound to a plant and a model: constants of a step."""

    columns: EquationTable
    model: DampingModel
    entries: tuple[np.ndarray, np.ndarray]
    gains: core.Gains

    def start(self) -> FloatArray:
        """Return the initial coefficients of equation 1."""
        return self.columns.with_unknown(self.entries, initial_coefficients(self.model))


class State(NamedTuple):
    """State of an adaptive identifier.

    Attributes
    ----------
    adaptation : Adaptation
        Plant, model and gains.
    table : ndarray, shape (n_columns + 1, 6)
        All coefficients of equation 1, in the paper K-hat, transposed; the last row is the
        velocity error.
    last : Sample
        The sample of the last step.
    """

    adaptation: Adaptation
    table: FloatArray
    last: Sample

    @property
    def matrix(self) -> FloatArray:
        """All coefficients of equation 1, shape (n_columns, 6)."""
        return self.table[:-1]

    @property
    def velocity_error(self) -> FloatArray:
        """Estimated minus measured velocity [m/s, rad/s]; in the paper Delta v."""
        return np.asarray(self.table[-1])

    @property
    def damping(self) -> Damping:
        """The present estimate, with a stamp of its vehicle."""
        bound, vehicle = self.adaptation, vehicle_stamp(self.adaptation.columns.vehicle)
        return Damping(bound.model, self.matrix[bound.entries], vehicle=vehicle)

    def restart(self, sample: Sample) -> State:
        """Return the state at the first sample after a gap: zero error, same coefficients.

        Parameters
        ----------
        sample : Sample
            First sample after the gap.

        Returns
        -------
        state : State
            With the coefficients of this state.
        """
        return State(self.adaptation, frozen(np.vstack([self.matrix, np.zeros(6)])), sample)


@dataclass(frozen=True)
class AdaptiveIdentifier:
    """The paper's adaptive identifier with gains ``a`` and ``gamma``.

    Parameters
    ----------
    a : float, tuple of 6 floats or NoiseScaledGain
        Error gain, common or one for each axis X Y Z K M N; 20 in the paper, whose
        section V calls it alpha.
    gamma : float, tuple of 6 floats or TermScaledGain
        Adaptation gain, common, one for each axis, or scaled by term; 20 in the paper.
    passes : int
        Number of passes over the log.

    Raises
    ------
    MethodError
        If a gain is not positive or ``passes`` is less than one.

    Examples
    --------
    >>> AdaptiveIdentifier(a=20, gamma=20).key
    'ai'
    >>> AdaptiveIdentifier(a=NoiseScaledGain(), gamma=TermScaledGain(), passes=30).key
    'ai-scaled'
    """

    a: AxisGains | NoiseScaledGain = 20.0
    gamma: AxisGains | TermScaledGain = 20.0
    passes: int = 1

    def __post_init__(self) -> None:
        """Check the gains."""
        if not isinstance(self.a, NoiseScaledGain):
            axis_gains(self.a, "a")
        if not isinstance(self.gamma, TermScaledGain):
            axis_gains(self.gamma, "gamma")
        fits = isinstance(self.passes, int | np.integer) and self.passes >= 1
        demand(fits, "passes", "a whole number, at least 1", self.passes)

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "ai-scaled" if isinstance(self.gamma, TermScaledGain) else "ai"

    def bind(self, source: Problem | EquationTable, model: DampingModel) -> Adaptation:
        """Bind the gains to a plant and a model."""
        columns = source if isinstance(source, EquationTable) else source.equations
        free = model.restricted_to(columns.vehicle.axes)
        rows, axes = entries = columns.entries(free)
        if isinstance(self.a, NoiseScaledGain):
            problem = require_problem(source, "noise of each velocity")
            a = self.a.share * signal_to_noise(problem) * np.diag(problem.vehicle.mass_matrix)
        else:
            a = axis_gains(self.a, "a")
        if isinstance(self.gamma, TermScaledGain):
            problem = require_problem(source, "size of each term")
            size = regressor_mean_square(problem)[rows - columns.n_known]
            time = self.gamma.settling * np.bincount(axes, minlength=6)[axes] * size
            gamma = np.divide(a[axes], time, out=np.zeros(len(rows)), where=size > 0.0)
        else:
            gamma = axis_gains(self.gamma, "gamma")[axes]
        gains = core.Gains(columns.plant, a, columns.scatter(entries, gamma))
        return Adaptation(columns, free, entries, gains)

    def init(self, source: Problem | EquationTable, model: DampingModel, sample: Sample) -> State:
        """Return the state at the first sample.

        Parameters
        ----------
        source : Problem or EquationTable
            Equation 1; scaled gains need a problem.
        model : DampingModel
            Damping model to identify.
        sample : Sample
            First sample; see :func:`hydrodamp.identification.adaptive.observe`.

        Returns
        -------
        state : State
            Diagonal linear coefficients at -1, the others at 0, no error.
        """
        bound = self.bind(source, model)
        return State(bound, frozen(np.vstack([bound.start(), np.zeros(6)])), sample)

    def step(self, state: State, sample: Sample) -> State:
        """Return the state one sample later.

        Parameters
        ----------
        state : State
            From :meth:`init`, an earlier step, or ``state.restart(sample)`` after a gap.
        sample : Sample
            Next sample.

        Returns
        -------
        state : State
            The given state is unchanged.

        Raises
        ------
        ProblemError
            If time does not advance.
        """
        bound, table, last = state
        return State(bound, core.adapt_step(bound.gains, table, last, sample), sample)

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Process the log and return the last estimate.

        The status is ``NOT_CONVERGED`` if the terms explain residuals of more than a tenth of the
        damping wrench of an axis.
        """
        bound = self.bind(problem, model)
        if not bound.model.n_coefficients:
            return empty_fit(problem, bound.model, self.key, Status.EMPTY)
        matrix = self._run(problem, bound).matrix
        coefficients = matrix[bound.entries]
        if not np.all(np.isfinite(coefficients)):
            return empty_fit(problem, bound.model, self.key, Status.FAILED)
        converged = np.all(_residual_share(problem, bound, matrix) <= MAX_RESIDUAL_SHARE)
        status = Status.CONVERGED if converged else Status.NOT_CONVERGED
        return make_fit(problem, bound.model, self, coefficients, status=status)

    def history(self, problem: Problem, model: DampingModel, every: int = 1) -> History:
        """Process the log and return the estimates over time.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Damping model to identify.
        every : int
            Interval of the stored steps.

        Returns
        -------
        history : History
            Velocity errors and coefficients over time.

        Raises
        ------
        MethodError
            If ``every`` is less than one.
        """
        demand(every >= 1, "every", "at least 1", every)
        bound = self.bind(problem, model)
        run = self._run(problem, bound, every)
        rows, axes = bound.entries
        arrays = run.history_time, run.history_error, run.history_matrix[:, rows, axes]
        time, error, coefficients = map(frozen, arrays)
        return History(time, error, coefficients, bound.model.labels)

    def _run(self, problem: Problem, bound: Adaptation, every: int = 0) -> core.AdaptationRun:
        inputs, segments, passes = problem.inputs, problem.segments, self.passes
        return core.adapt(bound.gains, bound.start(), inputs, segments, passes=passes, every=every)


def scaled_identifier() -> AdaptiveIdentifier:
    """Return the identifier with gains from the whole log and thirty passes."""
    return AdaptiveIdentifier(a=NoiseScaledGain(), gamma=TermScaledGain(), passes=30)


def _residual_share(problem: Problem, bound: Adaptation, matrix: FloatArray) -> FloatArray:
    """Return the part of the residuals that the terms explain, over the damping wrench, by axis."""
    unknown, share = matrix[problem.equations.n_known :], np.zeros(6)

    def residual_rows() -> Iterator[FloatArray]:
        for start, stop in problem.segments.tolist():
            for first in range(start, stop - 1, BLOCK):
                end = min(first + BLOCK, stop - 1) + 1
                design, target = step_equations(problem, first, end, problem.inputs.velocity)
                yield np.hstack([design, target - design @ unknown])

    triangle = Triangle.of(problem.equations.basis, residual_rows())
    for axis, terms in enumerate(bound.model.terms):
        explained = np.linalg.norm(triangle.span(terms).directions.T @ triangle.target(axis))
        size = np.linalg.norm(triangle.r[:, :-6] @ unknown[:, axis])
        share[axis] = explained / size if size > 0.0 else explained > 0.0
    return share
