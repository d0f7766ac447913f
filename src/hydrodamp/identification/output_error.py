"""Output-error identification: multi-step simulation-error minimisation with error checks.

Two methods minimise the objective J(κ) of :mod:`hydrodamp.identification.gauss_newton`, the
concentrated log-likelihood of simulation errors over growing windows: :class:`OutputError`, and
:class:`Recommended`, which goes on to the likelihood of prediction errors and keeps it where score
tests find the form adequate. The covariance is a delete-one-block jackknife of one Gauss-Newton
step and of the prior, rescaled on each axis by the difference of the estimates from two halves.
Unless the form is adequate, it covers the difference to the weak form: two estimates that differ in
their sensitivity to a wrong form (J. A. Hausman, "Specification Tests in Econometrics" (1978),
doi:10.2307/1913827); where it is, it is the inverse of the Fisher information times the mean ratio
of the variances, at least one each: it keeps the correlations, of which a jackknife of few blocks
knows little.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.adequacy import Adequacy, Form
from hydrodamp.identification.command_curves import curve_parameters, with_curves
from hydrodamp.identification.command_response import response_remarks
from hydrodamp.identification.continuation import (
    RELATIVE_TOLERANCE,
    fit_windows,
    make_objective,
    minimise_finally,
)
from hydrodamp.identification.fit import MIN_BLOCKS, Fit, empty_fit
from hydrodamp.identification.gauss_newton import (
    MAX_ITERATIONS,
    Iterate,
    ShootingObjective,
)
from hydrodamp.identification.held_out_replay import (
    PieceNormals,
)
from hydrodamp.identification.parameter_estimates import (
    describe_changes,
    describe_estimates,
)
from hydrodamp.identification.parameters import (
    VEHICLE_PARAMETERS,
    Estimate,
    Parameter,
    rebuild_plant,
    vehicle_parameters,
    wrench_parameters,
)
from hydrodamp.identification.prediction_error import FilteredOutputs, minimise_prediction_errors
from hydrodamp.identification.rebuilt_outputs import (
    fix_parameters,
    free_parameters,
    transfer_iterate,
)
from hydrodamp.identification.score_test import correlate_innovations, score_further_terms
from hydrodamp.identification.shooting_fit import build_fit
from hydrodamp.kernels.kalman import Noise
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.status import Status

#: What is known of the form, and the noise.
_FormErrors = tuple[Adequacy | None, Noise | None]


@dataclass(frozen=True)
class OutputError:
    """Minimise the error of open-loop simulations over windows of growing length.

    The method minimises the truncated (multi-step) simulation error by damped Gauss-Newton steps,
    with the sensitivities of the Runge-Kutta steps of a replay. It estimates the initial state of
    each window, with the smoothed measured velocity as its prior. It starts from the weak form and
    adds the window lengths one after the other. Residuals of each velocity and length have an
    unknown variance of their own (concentrated likelihood). A ridge prior, whose strength the
    evidence sets (MacKay 1992), and a penalty on energy injection up to three times the measured
    velocities regularise the coefficients. After Farina and Piroddi (2010).

    Parameters
    ----------
    windows : tuple of float
        Window lengths [s], increasing; infinity for entire segments. Lengths beyond the longest
        segment count as infinity. By default 0.75, 1.5, 3 and 6 times the correlation time
        of the velocities (the lag at which their autocorrelation falls to 1/e, median over the
        velocities), then entire segments.
    estimate : tuple of str or None
        Parameters that are estimated with the coefficients in addition to those of the vehicle
        with a standard deviation: ``added-mass``, ``center-of-gravity``, ``buoyancy``,
        ``wrench-gain``, ``thrust-curve``, ``fin-curve``. None estimates none at all. Those that
        the log determines become part of the vehicle of the fit; the others are held at their
        priors, with the cause in ``Fit.estimates``.
    max_iterations : int
        Gauss-Newton steps of the last stage, at most; each stage before it has a quarter.

    Raises
    ------
    MethodError
        If the lengths are not positive and increasing, a parameter is unknown, or there is no
        step.

    Examples
    --------
    >>> OutputError().key, OutputError(windows=(5.0,)).windows
    ('oe', (5.0,))
    """

    windows: tuple[float, ...] = ()
    estimate: tuple[str, ...] | None = ()
    max_iterations: int = MAX_ITERATIONS

    key = "oe"
    compares_sensors = True

    def __post_init__(self) -> None:
        """Check the window lengths and the names of parameters."""
        lengths = np.asarray(self.windows, dtype=np.float64)
        if not (np.all(lengths > 0.0) and np.all(np.diff(lengths) > 0.0)):
            raise MethodError(f"`windows` must be positive and increasing [s]; got {self.windows}")
        known = all(name in VEHICLE_PARAMETERS for name in self.estimate or ())
        demand(known, "estimate", f"from {', '.join(VEHICLE_PARAMETERS)}", self.estimate)
        demand(self.max_iterations > 0, "max_iterations", "positive", self.max_iterations)

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify one model; the status is ``STOPPED`` if the minimisation did not converge."""
        vehicle, model = problem.vehicle, model.restricted_to(problem.vehicle.axes)
        parameters: tuple[Parameter, ...] = ()
        if self.estimate is not None:
            names = (*self.estimate, *(name.replace("_", "-") for name in vehicle.estimate))
            problem = with_curves(problem, model, names)
            vehicle = problem.vehicle
            parameters = vehicle_parameters(vehicle, self.estimate)
            parameters += tuple(curve_parameters(problem, model, names))
            if "wrench-gain" in self.estimate or "wrench_gain" in vehicle.std:
                parameters += tuple(wrench_parameters(problem, model))
        equations = problem.equations.restrict_to(model)
        if parameters:  # the vehicle of the fit has its estimates
            equations = replace(equations, vehicle=replace(vehicle, estimate=(), std={}))
        problem = replace(problem, equations=equations)
        if not model.n_coefficients:
            return empty_fit(problem, model, self.key, Status.EMPTY)
        objective = replace(make_objective(problem, model), max_iterations=self.max_iterations)
        fit = self._estimate(objective, model, parameters)
        remarks = (
            *response_remarks(problem, model),
            *describe_estimates(fit.estimates),
            *describe_changes(fit.estimates),
        )
        return replace(fit, remarks=(*fit.remarks, *remarks))

    def _estimate(
        self, objective: ShootingObjective, model: DampingModel, parameters: tuple[Parameter, ...]
    ) -> Fit:
        """Return the joint fit; a parameter of the vehicle that is not determined is held."""
        if not parameters:
            windows = fit_windows(objective, model, self.windows)
            return self._build_fit(objective, model, *windows)[0]
        joint, undetermined = _free_vehicle(objective, model, parameters), dict[str, Estimate]()
        start, result = fit_windows(joint, model, self.windows)
        while True:
            # mass and damping have a narrow valley
            result = minimise_finally(joint, result, RELATIVE_TOLERANCE / joint.n_coefficients)
            fit, noise = self._build_fit(joint, model, start, result)
            priors = {
                each.label: fit.estimates[each.label].hold_at_prior()
                for each in parameters
                if fit.estimates[each.label].cause
            }
            if not priors:
                return replace(fit, estimates=fit.estimates | undetermined)
            undetermined |= priors
            is_free = np.array([label not in priors for label in fit.estimates])
            index = np.append(np.ones(objective.n_coefficients, bool), is_free)
            parameters = tuple(each for each in parameters if each.label not in priors)
            if not parameters:
                windows = fit_windows(objective, model, self.windows)
                form = fit.adequacy, noise
                fit, _ = self._build_fit(objective, model, *windows, form)
                return replace(fit, estimates=fit.estimates | undetermined)
            joint = _free_vehicle(objective, model, parameters)
            start, result = (
                transfer_iterate(joint, each, each.coefficients[index]) for each in (start, result)
            )

    def _build_fit(
        self,
        objective: ShootingObjective,
        model: DampingModel,
        start: Iterate,
        result: Iterate,
        joint: _FormErrors = (None, None),
    ) -> tuple[Fit, Noise | None]:
        """Return the fit and the noise, from those of a joint fit if it has any."""
        normals = PieceNormals.of(objective, result)
        adequacy, noise = joint
        if adequacy is None or adequacy.form is Form.ADEQUATE:
            normals, adequacy, noise = self._refine(normals, model)
        else:  # a known vehicle lacks the terms that a free one lacks
            tests = adequacy.tests, adequacy.correlations
            adequacy = Adequacy.judge(*tests, normals.moving_r_squared)
        fit = build_fit(normals, model, self, start.coefficients, adequacy, noise)
        return fit, noise

    def _refine(
        self, windows: PieceNormals, model: DampingModel
    ) -> tuple[PieceNormals, Adequacy | None, Noise | None]:
        """Return normal equations, what is known of the form, and the noise."""
        return windows, None, None


@dataclass(frozen=True)
class Recommended(OutputError):  # noqa: N818 (output error is a method, not an exception)
    """Output error, or prediction error where the form of the model is adequate.

    From the estimate of :class:`OutputError`, the likelihood of the innovations of an extended
    Kalman filter is maximised, with pushes on the vehicle and coloured errors of the velocities,
    whose strengths are estimated too. It is efficient where the model holds the truth, also where
    an autopilot answers the pushes, and is the result where score tests find no term missing and
    the innovations are white. Else the estimate of :class:`OutputError` is: it predicts motions
    best.

    Parameters
    ----------
    windows, estimate, max_iterations
        As of :class:`OutputError`.

    Raises
    ------
    MethodError
        If the lengths are not positive and increasing, or a parameter is unknown.

    Examples
    --------
    >>> Recommended().key
    'recommended'
    """

    key = "recommended"

    def _refine(
        self, windows: PieceNormals, model: DampingModel
    ) -> tuple[PieceNormals, Adequacy | None, Noise | None]:
        objective = windows.objective
        if objective.problem.sensor_log is not None or len(windows.pieces) < MIN_BLOCKS:
            return windows, None, None
        r_squared = windows.moving_r_squared
        rounds = minimise_prediction_errors(objective, windows.iterate)
        for filtered in rounds:
            tests = score_further_terms(*filtered, model)
            correlations = correlate_innovations(*filtered)
            adequacy = Adequacy.judge(tests, correlations, r_squared)
            # rough estimates of the noise suffice where a form is clearly wrong, and bias others
            if adequacy.is_clearly_missing:
                break
        noise = cast(FilteredOutputs, fix_parameters(*filtered)[0].outputs).noise
        if adequacy.form is Form.ADEQUATE:
            return PieceNormals.of(*filtered), adequacy, noise
        return windows, adequacy if correlations or adequacy.missing else None, noise


def _free_vehicle(
    objective: ShootingObjective, model: DampingModel, parameters: tuple[Parameter, ...]
) -> ShootingObjective:
    """Return the objective with free parameters of the vehicle."""
    rebuild = rebuild_plant(objective.problem, model, parameters)
    return free_parameters(objective, parameters, rebuild)
