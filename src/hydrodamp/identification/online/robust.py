"""The adaptive identifier made robust against noise, idleness and wrong models."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, empty_fit, fitted
from hydrodamp.identification.online.adaptation import Bound, RobustAdaptation, first_guess
from hydrodamp.identification.online.adaptive import History
from hydrodamp.identification.online.gains import (
    ByNoise,
    ByStep,
    Numbers,
    error_gains,
    per_axis,
    with_log,
)
from hydrodamp.identification.online.limits import Limits, OwnDrag
from hydrodamp.identification.online.projection import Projection, inverted, joined
from hydrodamp.identification.online.robust_state import RobustState
from hydrodamp.identification.online.settling import SETTLED, Stretch, share_missing
from hydrodamp.identification.online.whitening import ByExcitation, Gains, gain_matrices
from hydrodamp.identification.rows.velocity_noise import noise_variance
from hydrodamp.kernels.inputs import Sample
from hydrodamp.kernels.robustness import Adapting, Robustness, RobustRun
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.columns import Columns
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.status import Status


@dataclass(frozen=True)
class RobustIdentifier:
    """The adaptive identifier with all that keeps it from drifting.

    Parameters
    ----------
    a : float, tuple of 6 floats, ByNoise or ByStep
        Error gain; the default is fast against the sampling, where the noise of
        measured velocities biases the coefficients least.
    gamma : float, tuple of 6 floats, ByTerm or ByExcitation
        Adaptation gain: a number, one a term, or a matrix an axis.
    leakage : float
        How fast coefficients return to ``reference`` where nothing holds them [1/s].
    reference : Damping, optional
        Where leakage leads and the first pass starts, such as a published set; the
        paper's start by default.
    dead_zone : float
        Velocity error that teaches nothing, as a multiple of the one that noise of the
        velocities makes, both measured as the root of the kinetic energy.
    limits : Limits, optional
        Bounds kept at every step.
    project : Projection, optional
        Applied to the result, in the metric of the proof, such as ``OntoDissipative()``.
    passes : int
        How often the log is gone through.
    tail : float
        Share of the last pass that the estimate is the mean of over time; zero gives
        the last value.

    Raises
    ------
    MethodError
        If a setting is out of range.

    Examples
    --------
    >>> RobustIdentifier().key
    'ai-robust'
    """

    a: Numbers | ByNoise | ByStep = field(default_factory=ByStep)
    gamma: Gains = field(default_factory=ByExcitation)
    leakage: float = 0.0
    reference: Damping | None = None
    dead_zone: float = 0.0
    limits: Limits | None = field(default_factory=OwnDrag)
    project: Projection | None = None
    passes: int = 5
    tail: float = 1.0

    def __post_init__(self) -> None:
        """Refuse settings the proof does not cover."""
        if not isinstance(self.a, ByNoise | ByStep):
            per_axis(self.a, "a")
        if isinstance(self.gamma, float | int | tuple):
            per_axis(self.gamma, "gamma")
        for name in ("leakage", "dead_zone"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise MethodError(f"`{name}` must be zero or more; got {getattr(self, name)}")
        if not isinstance(self.passes, int | np.integer) or self.passes < 1:
            raise MethodError(f"`passes` must be a whole number, at least 1; got {self.passes}")
        if not 0.0 <= self.tail <= 1.0:
            raise MethodError(f"`tail` must be a share of a pass, from 0 to 1; got {self.tail}")

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "ai-robust"

    def bind(self, source: Problem | Columns, model: DampingModel) -> RobustAdaptation:
        """Bind the settings to a plant and a model.

        Parameters
        ----------
        source : Problem or Columns
            Equation 1 as one table; settings that follow a log need a problem.
        model : DampingModel
            Which terms.

        Returns
        -------
        adaptation : RobustAdaptation
            What a step needs, on a log or live.

        Raises
        ------
        MethodError
            If a setting follows a log and there is none.
        """
        bound = Bound.to(source if isinstance(source, Columns) else source.columns, model)
        a = error_gains(self.a, source)
        lower, upper = (None, None) if self.limits is None else self.limits.of(bound.model)
        robustness = Robustness(
            entries=bound.entries,
            a=a,
            gains=gain_matrices(self.gamma, source, bound.entries, a),
            rest=first_guess(bound.model, self.reference),
            lower=lower,
            upper=upper,
            leakage=self.leakage,
            dead_zone=self._dead_zone(source),
        )
        return RobustAdaptation(bound, robustness)

    def init(self, source: Problem | Columns, model: DampingModel, sample: Sample) -> RobustState:
        """Start online at the first sample of a run.

        Parameters
        ----------
        source : Problem or Columns
            Equation 1 as one table; settings that follow a log need a problem, such as
            one of last week's dive.
        model : DampingModel
            Which terms.
        sample : Sample
            The first one; see :func:`hydrodamp.identification.online.sample_by_sample.observe`.

        Returns
        -------
        state : RobustState
            At the reference, no error.
        """
        adaptation = self.bind(source, model)
        return RobustState(adaptation, Adapting.at(adaptation.robustness.led_to), sample)

    def step(self, state: RobustState, sample: Sample) -> RobustState:
        """Return the state one sample later; the given one stays as it is.

        Parameters
        ----------
        state : RobustState
            From :meth:`init`, an earlier step, or ``state.restarted(sample)``
            after a gap.
        sample : Sample
            The next one.

        Returns
        -------
        state : RobustState
            A new one.
        """
        return state.advanced(sample)

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Go through the log and return the mean estimate of the last pass's tail.

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
        adaptation = self.bind(problem, model)
        bound, start = adaptation.bound, adaptation.robustness.led_to
        if not bound.model.n_coefficients:
            return empty_fit(problem, bound.model, self.key, Status.EMPTY)
        stretch = Stretch.of(problem, self.passes)
        for _ in range(self.passes - 1):
            run = self._run(problem, adaptation, start, 0)
            start = run.adapting.coefficients
        run = self._run(problem, adaptation, start, stretch.half)
        before = run.track.coefficients[0] if self.passes == 1 and stretch.half else start
        found = run.adapting.mean if self.tail > 0.0 else run.adapting.coefficients
        if not np.all(np.isfinite(found)):
            return empty_fit(problem, bound.model, self.key, Status.FAILED)
        moved = run.adapting.coefficients - before
        share = share_missing(problem, adaptation, found, moved, stretch.duration)
        return fitted(
            problem,
            bound.model,
            self,
            self._projected(problem, adaptation, found),
            status=Status.SETTLED if np.all(share <= SETTLED) else Status.NOT_SETTLED,
        )

    def history(self, problem: Problem, model: DampingModel, every: int = 1) -> History:
        """Go through the log and return how the estimate came about, pass by pass.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.
        every : int
            Keep one step of a pass in this many.

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
        adaptation = self.bind(problem, model)
        start, tracks = adaptation.robustness.led_to, []
        for _ in range(self.passes):
            run = self._run(problem, adaptation, start, every)
            start = run.adapting.coefficients
            tracks.append(run.track)
        return History(
            time=frozen(np.concatenate([track.time for track in tracks])),
            velocity_error=frozen(np.concatenate([track.by_axis for track in tracks])),
            coefficients=frozen(np.concatenate([track.coefficients for track in tracks])),
            labels=adaptation.bound.model.labels,
        )

    def _dead_zone(self, source: Problem | Columns) -> float:
        """Return the size of error that noise makes: the root of the sum of M_ii sigma_i^2."""
        if self.dead_zone == 0.0:
            return 0.0
        problem = with_log(source, "noise of each velocity")
        return self.dead_zone * float(
            np.sqrt(noise_variance(problem) @ np.diag(problem.vehicle.mass_matrix))
        )

    def _run(
        self, problem: Problem, adaptation: RobustAdaptation, start: FloatArray, every: int
    ) -> RobustRun:
        steps = int((np.diff(problem.segments) - 1).sum())
        return kernels.robust_run(
            adaptation.bound.columns.plant,
            adaptation.robustness,
            start,
            problem.inputs,
            problem.segments,
            mean_from=tail_start(steps, self.tail),
            every=every,
        )

    def _projected(
        self, problem: Problem, adaptation: RobustAdaptation, coefficients: FloatArray
    ) -> FloatArray:
        """Project in the metric of the proof: towards a truth that dissipates, V cannot rise."""
        if self.project is None or not np.all(np.isfinite(coefficients)):
            return coefficients
        robustness = adaptation.robustness
        gains = robustness.entries.squares(robustness.gains)
        metric = joined([inverted(gain) for gain in gains])
        return self.project(problem, adaptation.bound.damping(coefficients), metric).coefficients


def tail_start(steps: int, tail: float) -> int:
    """Return the step that the tail of a pass begins with."""
    return steps - round(tail * steps)
