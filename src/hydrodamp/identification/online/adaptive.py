"""Section IV: the adaptive identifier, which needs no acceleration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, empty_fit, provenance
from hydrodamp.identification.online.adaptation import Adaptation
from hydrodamp.identification.online.gains import (
    ByNoise,
    ByTerm,
    Numbers,
    adaptation_gains,
    error_gains,
    per_axis,
)
from hydrodamp.identification.online.sample_by_sample import State
from hydrodamp.identification.online.settling import SETTLED, missing_share
from hydrodamp.kernels.adapted import Adapted
from hydrodamp.kernels.inputs import Sample
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.columns import Columns
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.stamp import stamp
from hydrodamp.simulation.status import Status


@dataclass(frozen=True)
class History:
    """How the estimate came about, at every ``every``-th step.

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


@dataclass(frozen=True)
class AdaptiveIdentifier:
    """The paper's adaptive identifier with gains ``a`` and ``gamma``.

    Parameters
    ----------
    a : float, tuple of 6 floats or ByNoise
        Error gain, one or one an axis X Y Z K M N; 20 in the paper, whose
        section V calls it alpha.
    gamma : float, tuple of 6 floats or ByTerm
        Adaptation gain, one, one an axis or by term; 20 in the paper.
    passes : int
        How often the log is gone through.

    Raises
    ------
    MethodError
        If a gain is not positive or there is no pass.

    Examples
    --------
    >>> AdaptiveIdentifier(a=20, gamma=20).key
    'ai'
    >>> AdaptiveIdentifier(a=ByNoise(), gamma=ByTerm(), passes=30).key
    'ai-scaled'
    """

    a: Numbers | ByNoise = 20.0
    gamma: Numbers | ByTerm = 20.0
    passes: int = 1

    def __post_init__(self) -> None:
        """Refuse gains the proof does not cover."""
        if not isinstance(self.a, ByNoise):
            per_axis(self.a, "a")
        if not isinstance(self.gamma, ByTerm):
            per_axis(self.gamma, "gamma")
        if not isinstance(self.passes, int | np.integer) or self.passes < 1:
            raise MethodError(f"`passes` must be a whole number, at least 1; got {self.passes}")

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "ai-scaled" if isinstance(self.gamma, ByTerm) else "ai"

    def bind(self, source: Problem | Columns, model: DampingModel) -> Adaptation:
        """Bind the gains to a plant and a model.

        Parameters
        ----------
        source : Problem or Columns
            Equation 1 as one table; gains by noise or term need a problem.
        model : DampingModel
            Which terms.

        Returns
        -------
        adaptation : Adaptation
            What a step needs, on a log or live.
        """
        columns = source if isinstance(source, Columns) else source.columns
        free = model.restricted_to(columns.vehicle.axes)
        entries, a = columns.entries(free), error_gains(self.a, source)
        gains = adaptation_gains(self.gamma, source, entries, a)
        return Adaptation(columns, free, entries, a, columns.scattered(entries, gains))

    def init(self, source: Problem | Columns, model: DampingModel, sample: Sample) -> State:
        """Start online at the first sample of a run.

        Parameters
        ----------
        source : Problem or Columns
            Equation 1 as one table; gains by noise or term need a problem.
        model : DampingModel
            Which terms.
        sample : Sample
            The first one; see :func:`hydrodamp.identification.online.sample_by_sample.observe`.

        Returns
        -------
        state : State
            Diagonal linear coefficients at -1, the others at 0, no error.
        """
        bound = self.bind(source, model)
        return State(bound, frozen(bound.start()), frozen(np.zeros(6)), sample)

    def step(self, state: State, sample: Sample) -> State:
        """Return the state one sample later; the given one stays as it is.

        Parameters
        ----------
        state : State
            From :meth:`init`, an earlier step, or ``state.restarted(sample)``
            after a gap.
        sample : Sample
            The next one.

        Returns
        -------
        state : State
            Made in a few microseconds by the compiled core.
        """
        return state.advanced(sample)

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Go through the log and return the last estimate.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.

        Returns
        -------
        fit : Fit
            ``NOT_SETTLED`` where the coefficients still move at the end.
        """
        bound = self.bind(problem, model)
        if not bound.model.n_coefficients:
            return empty_fit(problem, bound.model, self.key, Status.EMPTY)
        run, moved, duration = self._last_stretch(problem, bound)
        coefficients = run.matrix[bound.entries]
        if not np.all(np.isfinite(coefficients)):
            return empty_fit(problem, bound.model, self.key, Status.FAILED)
        share = missing_share(problem, bound, run.matrix, moved, duration)
        status = Status.SETTLED if np.all(share <= SETTLED) else Status.NOT_SETTLED
        return Fit(
            damping=Damping(bound.model, coefficients, vehicle=stamp(problem.vehicle)),
            method=self.key,
            status=status,
            aliased=problem.undetermined(bound.model),
            n_samples=problem.n_samples,
            provenance=provenance(problem, model, self),
        )

    def history(self, problem: Problem, model: DampingModel, every: int = 1) -> History:
        """Go through the log and return how the estimate came about.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.
        every : int
            Keep one step in this many.

        Returns
        -------
        history : History
            Velocity errors and coefficients over time.

        Raises
        ------
        MethodError
            If ``every`` is less than one.
        """
        if every < 1:
            raise MethodError(f"`every` must be at least 1, got {every}")
        bound = self.bind(problem, model)
        run = self._run(problem, bound, every)
        rows, axes = bound.entries
        return History(
            time=frozen(run.history_time),
            velocity_error=frozen(run.history_error),
            coefficients=frozen(run.history_matrix[:, rows, axes]),
            labels=bound.model.labels,
        )

    def _last_stretch(
        self, problem: Problem, bound: Adaptation
    ) -> tuple[Adapted, FloatArray, float]:
        """Run, and return how far the table moved over the last pass, or half a single one."""
        bounds = problem.segments
        steps = int((np.diff(bounds) - 1).sum())
        ends, starts = problem.inputs.time[bounds[:, 1] - 1], problem.inputs.time[bounds[:, 0]]
        duration = float((ends - starts).sum())
        single = self.passes == 1
        run = self._run(problem, bound, max(steps // 2 if single else steps, 1))
        before = run.history_matrix[0 if single else -2]
        return run, run.matrix - before, duration / 2 if single else duration

    def _run(self, problem: Problem, bound: Adaptation, every: int) -> Adapted:
        return kernels.adapt(
            bound.columns.plant,
            bound.a,
            bound.gamma,
            bound.start(),
            problem.inputs,
            problem.segments,
            passes=self.passes,
            every=every,
        )
