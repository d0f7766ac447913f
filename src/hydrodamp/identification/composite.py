r"""Composite adaptive identifier: the paper's law with a memory of the filtered equation.

In continuous time, with the filter 1/(s + λ), y_f = K ξ_f needs no acceleration, as the filtered
Mν̇ follows by parts. With P = ∫ξ_f ξ_fᵀ and Q = ∫y_f ξ_fᵀ the law is, axis by axis,

    M Δν̇ = −a Δν + (K̂ − K) ξ,    dK̂/dt = −[Δν ξᵀ + κ (K̂P − Q)] Γ,    Γ⁻¹ = (δI + P)/γ.

Of V = ½ ΔνᵀMΔν + ½ tr(ΔK Γ⁻¹ ΔKᵀ) the paper's terms leave −ΔνᵀaΔν, the memory −κ tr(ΔK P ΔKᵀ), and
the gain that falls as information grows +tr(ΔK ξ_f ξ_fᵀ ΔKᵀ)/2γ. In discrete time the coefficients
move to the memory once in a block of time, implicitly, and P includes the block's own information:
for κ ≥ ½ the second term outweighs the third, and V does not grow over any step
(``kernels/csrc/composite.c`` has both steps). V falls exponentially in every direction that the
motion excited once; excitation need not persist. J.-J. E. Slotine and W. Li, Automatica 25 (1989)
509; G. Kreisselmeier, IEEE Transactions on Automatic Control 22 (1977) 2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import demand
from hydrodamp.identification.fit import Fit, empty_fit, make_fit
from hydrodamp.identification.online import (
    TYPICAL_TIME,
    Adaptation,
    Entries,
    OnlineIdentifier,
    OnlineState,
    check_typical_velocity,
    find_scales,
)
from hydrodamp.identification.recursive import MEMORY_BLOCKS, RELATIVE_BLOCK, RecursiveLeastSquares
from hydrodamp.kernels.composite import CompositeLaw, composite_run, composite_step
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import EquationTable, Problem
from hydrodamp.simulation.ranges import TYPICAL_VELOCITY
from hydrodamp.status import Status

#: Time constant of the filter over the correlation time of the velocities, the length of a block.
RELATIVE_FILTER = 0.125

#: Information before any data, in typical blocks of time.
PRIOR = 10.0

#: Weight of the memory; the proof needs 1/2 at least.
KAPPA = 1.0


@dataclass(eq=False)
class CompositeState(OnlineState[CompositeLaw]):
    """State of the composite adaptive identifier.

    Attributes
    ----------
    adaptation : Adaptation
        Plant, model and settings.
    last : Sample
        The sample of the last step.
    values : ndarray
        Coefficients, velocity error, filter and memory, packed.
    """

    values: FloatArray

    @property
    def matrix(self) -> FloatArray:
        """All coefficients of equation 1, shape (n_columns, 6)."""
        size = 6 * self.adaptation.settings.plant.n_terms
        return self.values[:size].reshape(-1, 6)

    @property
    def velocity_error(self) -> FloatArray:
        """Estimated minus measured velocity [m/s, rad/s]; in the paper Delta v."""
        size = 6 * self.adaptation.settings.plant.n_terms
        return self.values[size : size + 6]

    @property
    def coefficients(self) -> FloatArray:
        """The present estimate, in the order of the model's labels."""
        return np.asarray(self.matrix[self.adaptation.entries])

    def advance(self, sample: Sample) -> CompositeState:
        """Return the state one sample later."""
        law = self.adaptation.settings
        values = composite_step(law, self.values, self.last, sample)
        return CompositeState(self.adaptation, sample, values)

    def restart(self, sample: Sample) -> CompositeState:
        """Return the state at the first sample after a gap: same coefficients and memory."""
        values = self.adaptation.settings.begin_segment(self.values)
        return CompositeState(self.adaptation, sample, frozen(values))


@dataclass(frozen=True)
class CompositeIdentifier(OnlineIdentifier[CompositeLaw, CompositeState]):
    """The paper's adaptive identifier with a memory of the filtered equation, in one pass.

    All scales come from the log and the vehicle: a block of time is the correlation time τ of the
    velocities, the filter has the time constant τ/8 = 1/λ, the velocity error decays at a/M = λ,
    γ = λ²M/4n keeps the adaptation of n typical terms from oscillation, and δ is the information of
    10 typical blocks, or of the memory if it is shorter. Rank, status and covariance are those of
    :class:`RecursiveLeastSquares` with the same memory; the covariance includes the difference of
    both estimates.

    Parameters
    ----------
    memory : float, optional
        Time constant of forgetting [s]; by default all data have the same weight.
    block : float, optional
        Length of a block of time [s]; by default the correlation time of the velocities.
    start : Damping, optional
        Initial coefficients, such as a published set; those of the paper by default.
    typical_velocity : tuple of 6 floats, optional
        Typical u v w [m/s] p q r [rad/s] that scale the terms, with channels of 1 and a block of
        4 s, where there is no log to take the scales from.

    Raises
    ------
    MethodError
        If a setting is not positive.

    Examples
    --------
    >>> CompositeIdentifier().key
    'ai-composite'
    """

    memory: float = np.inf
    block: float | None = None
    start: Damping | None = None
    typical_velocity: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        """Check the settings."""
        check_typical_velocity(self.typical_velocity)
        demand(self.memory > 0.0, "memory", "positive", self.memory)
        fits = self.block is None or 0.0 < self.block < np.inf
        demand(fits, "block", "positive and finite", self.block)

    key = "ai-composite"

    def _settings(
        self, source: Problem | EquationTable, equations: EquationTable, entries: Entries
    ) -> CompositeLaw:
        rows, axes = entries
        time, square = find_scales(source, equations, self.typical_velocity)
        block = self.block or time
        prior = min(PRIOR, self.memory / block)  # a memory that is short holds no more
        size = np.sqrt(prior * square[rows - equations.n_known])
        a = np.diag(equations.vehicle.mass_matrix) / (RELATIVE_FILTER * block)
        n_terms = np.maximum(np.bincount(axes, minlength=6), 1)
        return CompositeLaw(
            equations.plant,
            rows,
            axes,
            equations.with_unknown(entries, np.zeros(len(rows))),
            np.divide(1.0, size, out=np.zeros(len(size)), where=size > 0.0),
            block,
            -float(np.expm1(-block / self.memory)),
            a=a,
            gamma=a / (4.0 * n_terms * RELATIVE_FILTER * block),
            rate=1.0 / (RELATIVE_FILTER * block),
            kappa=KAPPA,
        )

    def _initial_state(self, bound: Adaptation[CompositeLaw], sample: Sample) -> CompositeState:
        return CompositeState(bound, sample, frozen(bound.settings.initial_state(bound.start)))

    def _estimate(self, problem: Problem, bound: Adaptation[CompositeLaw]) -> Fit:
        law, inputs = bound.settings, problem.inputs
        start = law.initial_state(bound.start)
        values = composite_run(law, start, inputs, problem.segments)
        last = inputs.sample(problem.n_samples - 1)
        state = CompositeState(bound, last, values)
        if not np.all(np.isfinite(values)):
            return empty_fit(problem, bound.model, self.key, Status.FAILED)
        if not law.n_blocks(values):
            return empty_fit(problem, bound.model, self.key, Status.TOO_FEW_SAMPLES)
        fit = self._least_squares().identify(problem, bound.model)
        if fit.uncertainty is None:
            return empty_fit(problem, bound.model, self.key, fit.status)
        difference = state.coefficients - fit.damping.coefficients
        covariance = fit.uncertainty.covariance + np.outer(difference, difference)
        return make_fit(
            problem,
            bound.model,
            self,
            state.coefficients,
            uncertainty=replace(fit.uncertainty, covariance=covariance),
            rank=fit.rank,
            aliased=fit.aliased,
            status=fit.status,
        )

    def _least_squares(self) -> RecursiveLeastSquares:
        """Return recursive least squares of the same memory, for standard errors and rank."""
        block = self.block and RELATIVE_BLOCK * self.block
        return RecursiveLeastSquares(
            block, self.memory, start=self.start, typical_velocity=self.typical_velocity
        )


#: Settings on board: scales from typical velocities, and the memory of recursive least squares.
ONBOARD = CompositeIdentifier(
    memory=MEMORY_BLOCKS * RELATIVE_BLOCK * TYPICAL_TIME, typical_velocity=TYPICAL_VELOCITY
)
