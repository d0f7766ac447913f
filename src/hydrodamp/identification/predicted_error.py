"""Predicted error of a replay: a band from the covariance of coefficients and the model error.

With the sensitivities S(t) of the replay to the coefficients and their covariance C, the error of
velocity i has the standard deviation

    s_i(t) = sqrt([S(t) C S(t)ᵀ]_ii + ρ_i² L_i² (1 − exp(−t/τ_i))),  ρ_i = max(1, r_i, r_(2)),

t the time since the start of the segment, r_i the standard deviation of its simulated velocity over
that of the velocity in the log, and r_(2) the second largest: missing terms couple two velocities.
The first part is large where the motion depends on coefficients that the training data do not
determine; where the form is adequate, C is the inverse of the Fisher information, and L is zero.
Otherwise the level L and the rise time τ of the error of the form, from replays of held-out data,
replace the difference to the weak form in C. A mission with more motion than the log, ρ_i > 1, is
an extrapolation. The initial velocity is exact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, covariance_root, freeze
from hydrodamp.basis.term import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.identification.adequacy import Form
from hydrodamp.identification.dissipativity import find_exceedances, velocity_ranges
from hydrodamp.identification.estimated_vehicle import with_estimated_vehicle
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import critical_value
from hydrodamp.kernels import core
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import DIVERGENCE_LIMIT, RateUnit
from hydrodamp.vehicle.vehicle import Vehicle

#: Numbers of the sensitivities in memory at a time: 64 MB.
_CHUNK_SIZE = 8_000_000


@dataclass(frozen=True, eq=False)
class PredictionBand:
    """A replay and its prediction band.

    Attributes
    ----------
    log : Log
        The log that was replayed.
    velocity, lower, upper : ndarray, shape (n, 6)
        The replay and the bounds of its band, linear [m/s] and angular [rad/s], body frame;
        NaN after divergence.
    level : float
        Confidence level of the band.
    extrapolated : tuple of str
        Velocities that leave their range in the training log: there the band is a guess.
    """

    log: Log
    velocity: FloatArray
    lower: FloatArray
    upper: FloatArray
    level: float
    extrapolated: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Copy and freeze the arrays."""
        shape = (self.log.n, 6)
        freeze(self, velocity=shape, lower=shape, upper=shape)

    @property
    def half_width(self) -> FloatArray:
        """Half the width of the band, shape (n, 6) [m/s, rad/s]."""
        return (self.upper - self.lower) / 2.0

    def rms_by_axis(self, axes: Sequence[str], rate_unit: RateUnit) -> dict[str, float | None]:
        """Return the RMS half-width of the velocity of each axis; None after divergence.

        Parameters
        ----------
        axes : sequence of str
            Free axes of the vehicle.
        rate_unit : {"deg", "rad"}
            Unit of angular rates.

        Returns
        -------
        half_width : dict of str to float or None
            By velocity, linear [m/s] and angular [``rate_unit``/s].
        """
        rms = np.sqrt(np.mean(self.half_width**2, axis=0))
        rms[3:] *= np.degrees(1.0) if rate_unit == "deg" else 1.0
        sizes = dict(zip(VELOCITIES, rms.tolist(), strict=True))
        names = [VELOCITY_OF[axis] for axis in axes]
        return {name: sizes[name] if np.isfinite(sizes[name]) else None for name in names}


def prediction_band(
    problem: Problem,
    damping: Damping,
    level: float = 0.95,
    *,
    degrees_of_freedom: float = np.inf,
    form_errors: Mapping[str, tuple[float, float, float]] | None = None,
) -> PredictionBand:
    """Return the prediction band of a replay, to first order in the coefficients.

    The covariance C of the coefficients gives ``J C Jᵀ`` with the sensitivities J of
    every sample. Gravity and buoyancy act along the measured attitude.

    Parameters
    ----------
    problem : Problem
        Prepared for (at least) the terms of the damping.
    damping : Damping
        With covariance.
    level : float
        Confidence level at each sample separately.
    degrees_of_freedom : float
        Of the covariance.
    form_errors : dict of str to tuple of float, optional
        Level [m/s, rad/s] and rise time [s] of the error of the form, and standard deviation of
        each velocity in a log, by axis; none by default.

    Returns
    -------
    band : PredictionBand
        Sensitivities are propagated chunk by chunk, so memory does not grow with the log.

    Raises
    ------
    MethodError
        If the damping has no covariance, or a setting is out of range.
    """
    half = critical_value(level, degrees_of_freedom)
    if damping.covariance is None:
        raise MethodError(
            f"the coefficients of '{damping.model.key}' have no covariance, hence no band: "
            "use a method that estimates one"
        )
    free = damping.model.restricted_to(problem.vehicle.axes)
    indices = [damping.model.index(label) for label in free.labels]
    root = covariance_root(damping.covariance[np.ix_(indices, indices)])
    entries, n = problem.equations.entries(free), free.n_coefficients
    matrix, length = problem.matrix(damping), max(_CHUNK_SIZE // (6 * (n + 6)), 2)
    velocity = np.full((problem.n_samples, 6), np.nan)
    width, sizes = velocity.copy(), form_errors or {}
    form_level, rise, usual = np.array([sizes.get(axis, (0.0, 1.0, 0.0)) for axis in AXES]).T
    for start, stop in problem.segments.tolist():
        initial, deviation = problem.inputs.velocity[start], np.zeros((6, root.shape[1]))
        for first in range(start, stop - 1, length - 1):
            chunk = slice(first, min(first + length, stop))
            measured = problem.inputs.velocity[chunk].copy()
            measured[0] = initial
            inputs, span = problem.inputs.select(chunk, measured), np.array([[0, len(measured)]])
            arguments = problem.equations.plant, matrix, inputs, span, entries
            velocity[chunk], _, jacobian = core.replay(*arguments, limit=DIVERGENCE_LIMIT)
            on_coefficients, on_initial = np.split(jacobian, [n], axis=2)
            total = on_initial @ deviation + on_coefficients @ root
            width[chunk] = (total**2).sum(axis=2)
            initial, deviation = velocity[chunk][-1], total[-1]
            if not np.isfinite(initial).all():
                break
        known = np.isfinite(velocity[start:stop]).all(axis=1)
        motion = velocity[start:stop][known].std(axis=0)
        ratio = np.maximum(np.divide(motion, usual, out=np.ones(6), where=usual > 0.0), 1.0)
        ratio = np.maximum(ratio, np.sort(ratio)[-2])  # missing terms couple two velocities
        horizon = problem.inputs.time[start:stop, None] - problem.inputs.time[start]
        width[start:stop] -= (ratio * form_level) ** 2 * np.expm1(-horizon / rise)
    width = half * np.sqrt(width)
    return PredictionBand(problem.log, velocity, velocity - width, velocity + width, level)


def predict_error(vehicle: Vehicle, fit: Fit, log: Log, level: float = 0.95) -> PredictionBand:
    """Return the band around a replay that contains the true velocity, by the errors of a fit.

    Parameters
    ----------
    vehicle : Vehicle
        Mass, restoring forces and actuators.
    fit : Fit
        With covariance. Unless its form is adequate, the band allows for errors of the form, as
        large as in replays of held-out training data.
    log : Log
        The mission: gives the initial velocities, the actuation and the attitude.
    level : float
        Confidence level at each sample separately.

    Returns
    -------
    band : PredictionBand
        Of the motion without sensor noise, from an exact initial velocity.

    Raises
    ------
    MethodError
        If the fit has no covariance, or the level is out of range.
    ProblemError
        If the log lacks what the vehicle or a term needs.

    Examples
    --------
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> from hydrodamp.identification.output_error import OutputError
    >>> from hydrodamp.models.catalog import catalog
    >>> campaign = reenact(duration=20.0)
    >>> problem = prepare(campaign.vehicle, campaign.train, catalog["linear"])
    >>> fit = OutputError().identify(problem, catalog["linear"])
    >>> band = predict_error(campaign.vehicle, fit, campaign.test)
    >>> bool(np.all(band.half_width >= 0.0))
    True
    """
    uncertainty, damping, freedom = fit.uncertainty, fit.damping, np.inf
    if uncertainty is not None:
        freedom = uncertainty.degrees_of_freedom
        if fit.adequacy is not None and fit.adequacy.form is Form.ADEQUATE:
            # only variances of the noise stand in a file; its correlations are the same
            total, noise = uncertainty.standard_errors, uncertainty.noise_only.standard_errors
            ratio = np.divide(noise, total, out=np.zeros_like(total), where=total > 0.0)
            damping = replace(damping, covariance=uncertainty.rescale(ratio).covariance)
        elif fit.form_errors:
            damping = replace(damping, covariance=uncertainty.without_bias.covariance)
    problem = with_estimated_vehicle(prepare(vehicle, log, fit.model), fit)
    with np.errstate(over="ignore", invalid="ignore"):  # a divergent replay has no band
        band = prediction_band(
            problem, damping, level, degrees_of_freedom=freedom, form_errors=fit.form_errors
        )
    finite = band.velocity[np.isfinite(band.velocity).all(axis=1)]
    exceeded = find_exceedances(fit.training_range, velocity_ranges(finite, vehicle.axes))
    return replace(band, extrapolated=tuple(exceeded))
