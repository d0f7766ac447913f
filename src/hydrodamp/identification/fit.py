"""An identified damping model: coefficients, covariance and status; and the method protocol.

The delete-one-block jackknife of n estimates κ₍b₎ without block b gives the covariance
``Cov = (n − 1)/n Σ_b (κ₍b₎ − κ̄)(κ₍b₎ − κ̄)ᵀ``, which allows for any dependence within a block:
R. G. Miller (1974), doi:10.1093/biomet/61.1.1.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from hydrodamp.arrays import FloatArray, Shape, freeze, jackknife_covariance
from hydrodamp.data.digests import MAX_DIGESTS, velocity_digests
from hydrodamp.errors import MethodError, demand, first_few, repr_html
from hydrodamp.identification.adequacy import Adequacy
from hydrodamp.identification.dissipativity import energy_injection_warnings, velocity_ranges
from hydrodamp.identification.grades import Grade, critical_value
from hydrodamp.identification.parameters import Estimate
from hydrodamp.kernels.kalman import Noise
from hydrodamp.models.damping import Damping, coefficient_columns
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.checks import command_ranges, missing_actuation
from hydrodamp.simulation.problem import Problem, vehicle_stamp
from hydrodamp.status import Status
from hydrodamp.vehicle.vehicle import Vehicle

# Median ratio of standard errors, all residuals over noise alone, above which a fit reports it.
_MODEL_FORM_RATIO = 1.5


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariance of estimated coefficients, and the confidence intervals that follow from it.

    Attributes
    ----------
    covariance : ndarray, shape (n, n)
        Of the coefficients, from all residuals: noise and model-form error.
    degrees_of_freedom : float
        Of the covariance estimate: intervals use Student's t with this many.
    method : str
        Name of the covariance estimator, as read in messages.
    noise : ndarray, shape (n, n), or None
        The covariance from noise alone, with the allowance for bias; None where the method does not
        separate it.
    block : float or None
        Length of the blocks [s]; None where there are none.
    n_blocks : int
        How many blocks the data hold.
    bias_allowance : str
        The bias that the covariance includes, in words; empty for none.
    bias : ndarray, shape (n,), or None
        The vector b whose outer product ``b bᵀ`` the covariance includes for that; None for none.
    leverage : ndarray, shape (n,), or None
        Variance of each coefficient for white residuals of variance one: the information of the
        manoeuvres alone. None where the method does not give it.

    Raises
    ------
    MethodError
        If a covariance is not square, their shapes differ, or the degrees of freedom are
        not positive.

    Examples
    --------
    >>> known = Uncertainty(np.diag([4.0, 9.0]), degrees_of_freedom=np.inf, method="by hand")
    >>> known.standard_errors.tolist(), known.interval([10.0, 20.0])[0].round(2).tolist()
    ([2.0, 3.0], [6.08, 13.92])
    """

    covariance: FloatArray
    degrees_of_freedom: float
    method: str
    noise: FloatArray | None = None
    block: float | None = None
    n_blocks: int = 0
    bias_allowance: str = ""
    bias: FloatArray | None = None
    leverage: FloatArray | None = None

    def __post_init__(self) -> None:
        """Copy the arrays and check them."""
        n, freedom = len(self.covariance), self.degrees_of_freedom
        shapes: dict[str, Shape] = {"covariance": (n, n), "noise": (n, n)}
        shapes |= {"leverage": (n,), "bias": (n,)}
        arrays = {name: shape for name, shape in shapes.items() if getattr(self, name) is not None}
        freeze(self, MethodError, np.float64, **arrays)
        demand(freedom > 0.0, "degrees_of_freedom", "positive", freedom)

    @property
    def standard_errors(self) -> FloatArray:
        """Standard error of each coefficient, shape (n,)."""
        return np.sqrt(np.diag(self.covariance))

    def rescale(self, factors: FloatArray) -> Uncertainty:
        """Multiply every standard error by a factor; correlations are unchanged."""
        scale = factors[:, None] * factors
        noise = None if self.noise is None else self.noise * scale
        bias = None if self.bias is None else self.bias * factors
        return replace(self, covariance=self.covariance * scale, noise=noise, bias=bias)

    def inflate(self, shift: FloatArray, allowance: str) -> Uncertainty:
        """Add a possible bias of all coefficients to the covariance.

        The bias is estimated from the same log and has a variance of its own. Only the excess of
        its square over the variance is added, so that each variance is at least the bias squared.

        Parameters
        ----------
        shift : ndarray, shape (n,)
            The possible bias, of either sign.
        allowance : str
            Its cause, to be read after "They allow for".

        Returns
        -------
        uncertainty : Uncertainty
            Both covariances plus an outer product; the degrees of freedom are unchanged.

        Examples
        --------
        >>> known = Uncertainty(np.diag([9.0, 0.0]), np.inf, "by hand")
        >>> known.inflate(np.array([4.0, 1.0]), "a bias").standard_errors.tolist()
        [4.0, 1.0]
        """
        excess = np.maximum(shift**2 - np.diag(self.covariance), 0.0)
        bias = np.sqrt(excess) * np.sign(shift)
        noise = None if self.noise is None else self.noise_only.inflate(shift, "").covariance
        total = self.covariance + np.outer(bias, bias)
        return replace(self, covariance=total, noise=noise, bias_allowance=allowance, bias=bias)

    @property
    def without_bias(self) -> Uncertainty:
        """Uncertainty with the covariance before :meth:`inflate`."""
        bias = np.zeros(len(self.covariance)) if self.bias is None else self.bias
        covariance = self.covariance - np.outer(bias, bias)
        return replace(self, covariance=covariance, noise=None, bias_allowance="", bias=None)

    @property
    def noise_only(self) -> Uncertainty:
        """Uncertainty from noise alone; the same value where the method does not separate it."""
        if self.noise is None:
            return self
        return replace(self, covariance=self.noise, noise=None, bias=None)

    def critical_value(self, level: float = 0.95) -> float:
        """Return the factor from a standard error to half a confidence interval.

        Parameters
        ----------
        level : float
            Confidence level, 0 to 1.

        Returns
        -------
        factor : float
            Quantile of Student's t; 1.96 for many degrees of freedom.

        Raises
        ------
        MethodError
            If the level is not between 0 and 1.
        """
        return critical_value(level, self.degrees_of_freedom)

    def interval(self, coefficients: FloatArray, level: float = 0.95) -> FloatArray:
        """Return the confidence interval of each coefficient.

        Parameters
        ----------
        coefficients : array_like, shape (n,)
            The estimate.
        level : float
            Confidence level, 0 to 1.

        Returns
        -------
        interval : ndarray, shape (n, 2)
            Lower and upper bounds.

        Raises
        ------
        MethodError
            If the level is not between 0 and 1.
        """
        half = self.critical_value(level) * self.standard_errors
        centre = np.asarray(coefficients, dtype=np.float64)
        return np.column_stack([centre - half, centre + half])

    def __str__(self) -> str:
        """Describe the covariance estimator in one or two sentences."""
        if self.block is None:
            return f"Standard errors are from {self.method}."
        return (
            f"Standard errors are from {self.method}, in {self.n_blocks} blocks of "
            f"{self.block:.3g} s; intervals have {self.degrees_of_freedom:.0f} degrees of freedom."
            + (f" They allow for {self.bias_allowance}." if self.bias_allowance else "")
            + self._misfit()
        )

    def _misfit(self) -> str:
        if self.noise is None:
            return ""
        total, noise = np.diag(self.covariance), np.diag(self.noise)
        known = (total > 0.0) & (noise > 0.0)
        ratio = float(np.sqrt(np.median(total[known] / noise[known]))) if known.any() else 1.0
        if ratio < _MODEL_FORM_RATIO:
            return ""
        return (
            f" They are {ratio:.2g} times those of noise alone: model-form error dominates, and "
            "other manoeuvres would give other coefficients."
        )


def correlation(covariance: FloatArray) -> FloatArray:
    """Return the correlation matrix of a covariance."""
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = np.where((deviation > 0.0) & np.isfinite(deviation), deviation, np.nan)
    return np.asarray(np.clip(covariance / np.outer(known, known), -1.0, 1.0))


@dataclass(frozen=True)
class Fit:
    """An identified damping model.

    Attributes
    ----------
    damping : Damping
        The model with its coefficients and, where the method gives one, their covariance.
    method : str
        Key of the method.
    status : Status
        The outcome.
    rank : int or None
        Rank of the regression, summed over axes; None for online methods.
    aliased : tuple of tuple of str
        Groups of labels whose regressors are linearly dependent. The regressor of a group of one
        is zero at every sample.
    n_samples : int
        Number of samples used.
    provenance : dict of str to str
        Log, segments, vehicle, settings and digest.
    remarks : tuple of str
        Messages of the method: chosen settings, cost of a constraint, results of checks.
    uncertainty : Uncertainty or None
        Standard errors and intervals; its covariance is that of the damping. None where
        the method gives none for coloured noise.
    training_range : dict of str to tuple of float
        Minimum and maximum of each free velocity [m/s, rad/s] in the training log, without 1 % of
        the samples at either end; symmetric about zero except for the surge of a vehicle under way.
    command_range : dict of str to tuple of float
        Minimum and maximum of each command in the training log, in its own unit.
    grades : dict of str to Grade
        How well the training data determine each coefficient, by label; empty where not graded.
    vehicle : Vehicle or None
        The vehicle that the coefficients belong to; None where unknown.
    estimates : dict of str to Estimate
        Parameters of sensors and of the vehicle that were estimated with the coefficients, by
        label such as ``dvl delay`` or ``A_Y``.
    parameter_covariance : ndarray, shape (k, p + k), or None
        Rows of the k free parameters in the joint covariance; None where there are none.
    indirect : tuple of str
        Labels of coefficients that only sensors of other motions determine; weak at best.
    unconverged : tuple of str
        Axes on which the optimiser stopped before it converged, such as ``Y``.
    held_out_r_squared : dict of str to float
        R² of the replay of each free velocity by estimates without the replayed part of the log,
        by axis; empty for methods that do not replay.
    form_errors : dict of str to tuple of float
        Error of the form in these replays, without sensor errors: level [m/s, rad/s], rise time
        [s], and standard deviation of the velocity in the log, by axis; empty where the form is
        adequate.
    adequacy : Adequacy or None
        What score tests say of the form of the model; None where the method has none.
    noise : Noise or None
        Pushes on the vehicle and errors of its measured velocities, at the estimate of the
        prediction errors; None where the method has none.
    """

    damping: Damping
    method: str
    status: Status
    rank: int | None = None
    aliased: tuple[tuple[str, ...], ...] = ()
    n_samples: int = 0
    provenance: dict[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    uncertainty: Uncertainty | None = None
    training_range: dict[str, tuple[float, float]] = field(default_factory=dict)
    grades: dict[str, Grade] = field(default_factory=dict)
    vehicle: Vehicle | None = None
    estimates: dict[str, Estimate] = field(default_factory=dict)
    parameter_covariance: FloatArray | None = field(default=None, compare=False)
    indirect: tuple[str, ...] = ()
    unconverged: tuple[str, ...] = ()
    held_out_r_squared: dict[str, float] = field(default_factory=dict)
    form_errors: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    adequacy: Adequacy | None = None
    command_range: dict[str, tuple[float, float]] = field(default_factory=dict)
    noise: Noise | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        """Copy the covariance of the parameters and check its shape."""
        if self.parameter_covariance is not None:
            n, p = len(self.joint_labels), self.model.n_coefficients
            freeze(self, MethodError, parameter_covariance=(n - p, n))

    @property
    def model(self) -> DampingModel:
        """The model that was identified."""
        return self.damping.model

    @property
    def joint_labels(self) -> tuple[str, ...]:
        """Labels of the coefficients, then of the parameters that are free in the fit."""
        free = (label for label, each in self.estimates.items() if not each.is_held)
        return (*self.model.labels, *free)

    @property
    def joint_covariance(self) -> FloatArray | None:
        """Covariance of coefficients and free parameters, in the order of ``joint_labels``.

        Its units are products of those of the coefficients and of the estimates. None where the
        coefficients have no covariance.
        """
        known, rows = self.damping.covariance, self.parameter_covariance
        if known is None or rows is None:
            return known
        return np.block([[known, rows[:, : len(known)].T], [rows]])

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Speeds near the training range at which the damping injects energy, in sentences."""
        return tuple(energy_injection_warnings(self.damping, self.training_range))

    @property
    def summary_lines(self) -> tuple[str, ...]:
        """Warnings, status, form, remarks and the covariance estimator, in sentences."""
        form = () if self.adequacy is None else (str(self.adequacy),)
        notes = () if self.damping.covariance is None else (self.uncertainty or WHITE_NOISE_NOTE,)
        return (*self.warnings, self.status.value, *form, *self.remarks, *map(str, notes))

    def _repr_html_(self) -> str:
        times = critical_value() if self.uncertainty is None else self.uncertainty.critical_value()
        return repr_html(self, coefficient_columns(self.damping, times, self.grades.values()))

    def __str__(self) -> str:
        """Return summary and coefficients as text."""
        rank = "" if self.rank is None else f", rank {self.rank}"
        head = f"{self.model.key} by {self.method}: {self.model.n_coefficients} coefficients{rank}"
        groups = first_few([f"  aliased: {' '.join(group)}" for group in self.aliased], 8, "groups")
        return "\n".join([head, *self.summary_lines, *groups, str(self.damping)])

    __repr__ = __str__


#: Message for a covariance that does not allow for coloured residuals.
WHITE_NOISE_NOTE = (
    "Standard errors assume white residuals: they are too small where residuals are correlated."
)


class Method(Protocol):
    """An identification method with its settings."""

    @property
    def key(self) -> str:
        """Key on the command line."""
        ...

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify the coefficients of one model.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            The terms; restricted to the vehicle's free axes.

        Returns
        -------
        fit : Fit
            Coefficients, status and, where the method gives it, covariance.
        """
        ...


def digest(problem: Problem, model: DampingModel, method: object) -> str:
    """Return a hash of all that determines a fit: data, vehicle, terms, settings and version."""
    import hydrodamp

    terms = model.restricted_to(problem.vehicle.axes).terms
    inputs = (problem.digest, model.key, terms, repr(method), hydrodamp.__version__)
    return hashlib.sha256(repr(inputs).encode()).hexdigest()[:16]


def make_fit(
    problem: Problem,
    model: DampingModel,
    method: Method,
    coefficients: FloatArray,
    *,
    covariance: FloatArray | None = None,
    uncertainty: Uncertainty | None = None,
    rank: int | None = None,
    aliased: tuple[tuple[str, ...], ...] = (),
    status: Status | None = None,
    n_samples: int | None = None,
    remarks: tuple[str, ...] = (),
) -> Fit:
    """Build the fit of estimated coefficients, with status, vehicle stamp and provenance.

    Parameters
    ----------
    problem : Problem
        The data that were used.
    model : DampingModel
        Restricted to the free axes.
    method : Method
        The fit stores its key and its settings.
    coefficients : ndarray, shape (n_coefficients,)
        In the order of the model's labels.
    covariance : ndarray, shape (n_coefficients, n_coefficients), optional
        Of the coefficients, where there is no uncertainty.
    uncertainty : Uncertainty, optional
        Covariance with degrees of freedom and method.
    rank : int, optional
        Rank of the regression, summed over axes.
    aliased : tuple of tuple of str
        Groups of labels whose regressors are linearly dependent.
    status : Status, optional
        By default ``RANK_DEFICIENT`` where a coefficient is aliased, else ``OK``. Always
        ``FAILED`` where a coefficient is not finite.
    n_samples : int, optional
        Number of samples used; all of the problem by default.
    remarks : tuple of str
        Messages, in sentences.

    Returns
    -------
    fit : Fit
        With vehicle stamp, provenance and training range.
    """
    if not np.all(np.isfinite(coefficients)):
        return empty_fit(problem, model, method.key, Status.FAILED)
    if uncertainty is not None:
        covariance = uncertainty.covariance
    named = {label for group in aliased for label in group}
    aliased += tuple(group for group in problem.undetermined(model) if group[0] not in named)
    vehicle = vehicle_stamp(problem.vehicle)
    digests = velocity_digests(problem.log, problem.n_samples // MAX_DIGESTS + 1)
    return Fit(
        damping=Damping(model, coefficients, covariance=covariance, vehicle=vehicle),
        method=method.key,
        status=status or (Status.RANK_DEFICIENT if aliased else Status.OK),
        rank=rank,
        aliased=aliased,
        n_samples=problem.n_samples if n_samples is None else n_samples,
        provenance={
            "log": problem.log.source or "in memory",
            "segments": " ".join(segment.name for segment in problem.log.segments),
            "samples": str(problem.n_samples),
            "duration": f"{problem.duration:.4g} s",
            "rate": f"{problem.log.sample_rate:.3g} Hz",
            "vehicle": problem.vehicle.name,
            "settings": repr(method),
            "digest": digest(problem, model, method),
            "velocity_digests": " ".join(map("{:x}".format, np.concatenate(digests).tolist())),
        },
        remarks=remarks,
        uncertainty=uncertainty,
        training_range=velocity_ranges(problem.inputs.velocity, problem.vehicle.axes),
        vehicle=problem.vehicle,
        command_range=command_ranges(problem.log),
    )


def empty_fit(
    problem: Problem, model: DampingModel, method: str, status: Status, *remarks: str
) -> Fit:
    """Return a fit without coefficients (NaN), with a status that gives the reason."""
    missing = np.full(model.n_coefficients, np.nan)
    damping = Damping(model, missing, vehicle=vehicle_stamp(problem.vehicle))
    return Fit(damping, method, status, n_samples=problem.n_samples, remarks=remarks)


def check_sensors(problem: Problem, method: Method) -> None:
    """Raise if a method needs velocities that the log has not recorded."""
    sensor_log = problem.sensor_log
    if sensor_log is None or not sensor_log.names or getattr(method, "compares_sensors", False):
        return
    raise MethodError(
        f"`{method.key}` needs the velocities {' '.join(sensor_log.names)} at every sample, and "
        f"the log has {sensor_log.description}: use `oe` or `recommended`, which compare sensors "
        "at their own times, or record the velocities, as by a DVL"
    )


def check_actuation(problem: Problem, model: DampingModel) -> None:
    """Raise if the log has no motion, or neither wrench nor a command that a term uses."""
    if not problem.inputs.velocity.any():
        raise MethodError(
            "all velocities of the log are zero: use a log in which the vehicle moves"
        )
    free = model.restricted_to(problem.vehicle.axes)
    if message := missing_actuation(problem.vehicle, problem.log, (free,)):
        raise MethodError(message)


def identify_or_refuse(method: Method, problem: Problem, model: DampingModel) -> Fit:
    """Return the fit of a method; where it raises, an empty fit with the message as remark."""
    try:
        check_actuation(problem, model)
        check_sensors(problem, method)
        return method.identify(problem, model)
    except MethodError as error:
        free = model.restricted_to(problem.vehicle.axes)
        return empty_fit(problem, free, method.key, Status.REFUSED, str(error))


#: Blocks below which a covariance is not estimated, and blocks at most.
MIN_BLOCKS, MAX_BLOCKS = 4, 32


def jackknife(
    estimates: FloatArray, duration: float, leverage: FloatArray | None = None
) -> Uncertainty:
    """Return the uncertainty of estimates (n, p) without one of n blocks of a duration [s] each."""
    n, method = len(estimates), "the delete-one-block jackknife"
    return Uncertainty(
        jackknife_covariance(estimates), n - 1, method, None, duration / n, n, leverage=leverage
    )
