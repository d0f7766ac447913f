"""What a method returns: a damping model with numbers, and how far to trust it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from scipy.special import stdtrit

from hydrodamp.arrays import FloatArray, freeze
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.operating_range import energy_injection_warnings, velocity_ranges
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.checks import missing_actuation
from hydrodamp.simulation.problem import Problem, prepare, vehicle_stamp
from hydrodamp.simulation.status import Status
from hydrodamp.text import first_few
from hydrodamp.vehicle.vehicle import Vehicle

# From here on a median ratio of standard errors is worth a sentence.
_WIDER = 1.5


def critical_value(level: float = 0.95, degrees_of_freedom: float = np.inf) -> float:
    """Return how many standard errors an interval reaches to either side."""
    demand(0.0 < level < 1.0, "level", "between 0 and 1", level)
    demand(degrees_of_freedom > 0.0, "degrees_of_freedom", "positive", degrees_of_freedom)
    return float(stdtrit(degrees_of_freedom, 0.5 + level / 2.0))


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """How far to trust some coefficients.

    Attributes
    ----------
    covariance : ndarray, shape (n, n)
        Of the coefficients, from all that the model leaves over.
    degrees_of_freedom : float
        How well it is known: intervals use Student's t with this many.
    method : str
        How it was found, in words.
    noise : ndarray, shape (n, n), or None
        The same from noise alone; None where the method does not tell them apart.
    block : float or None
        Length of the blocks [s]; None where there are none.
    n_blocks : int
        How many fit side by side.
    allowance : str
        What they allow for beyond that, in words; empty for nothing.
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
    >>> found = Uncertainty(np.diag([4.0, 9.0]), degrees_of_freedom=np.inf, method="by hand")
    >>> found.standard_errors.tolist(), found.interval([10.0, 20.0])[0].round(2).tolist()
    ([2.0, 3.0], [6.08, 13.92])
    """

    covariance: FloatArray
    degrees_of_freedom: float
    method: str
    noise: FloatArray | None = None
    block: float | None = None
    n_blocks: int = 0
    bias_allowance: str = ""
    leverage: FloatArray | None = None

    def __post_init__(self) -> None:
        """Copy the arrays and check them."""
        n = len(self.covariance)
        if self.leverage is not None:
            freeze(self, MethodError, leverage=(n,))
        freeze(self, MethodError, covariance=(n, n))
        if self.noise is not None:
            freeze(self, MethodError, noise=(n, n))
        known = self.degrees_of_freedom
        demand(known > 0.0, "degrees_of_freedom", "positive", known)

    @property
    def standard_errors(self) -> FloatArray:
        """Standard error of each coefficient, shape (n,)."""
        return np.sqrt(np.diag(self.covariance))

    def rescale(self, factors: FloatArray) -> Uncertainty:
        """Return the same with every standard error larger by a factor, correlations kept."""
        by = factors[:, None] * factors
        noise = None if self.noise is None else self.noise * by
        return replace(self, covariance=self.covariance * by, noise=noise)

    def inflate(self, shift: FloatArray, allowance: str) -> Uncertainty:
        """Return the same with room for a shift of all coefficients together.

        A shift is found from the same record and scatters, too. What of it the scatter does
        not account for is added, so that each variance is at least the shift squared.

        Parameters
        ----------
        shift : ndarray, shape (n,)
            How far they may be off, in one direction or the other.
        allowance : str
            For what, to be read after "They allow for".

        Returns
        -------
        uncertainty : Uncertainty
            Both covariances raised by an outer product; the degrees of freedom stay.

        Examples
        --------
        >>> found = Uncertainty(np.diag([9.0, 0.0]), np.inf, "by hand")
        >>> found.inflate(np.array([4.0, 1.0]), "a bias").standard_errors.tolist()
        [4.0, 1.0]
        """
        return replace(
            self,
            covariance=_with_room(self.covariance, shift),
            noise=None if self.noise is None else _with_room(self.noise, shift),
            bias_allowance=allowance,
        )

    @property
    def noise_only(self) -> Uncertainty:
        """What noise alone makes of the same manoeuvres; itself where that is not known apart."""
        if self.noise is None:
            return self
        return replace(self, covariance=self.noise, noise=None)

    def critical_value(self, level: float = 0.95) -> float:
        """Return how many standard errors an interval reaches to either side.

        Parameters
        ----------
        level : float
            Share of repetitions in which the interval holds what is sought.

        Returns
        -------
        reach : float
            Quantile of Student's t; 1.96 for many degrees of freedom.

        Raises
        ------
        MethodError
            If the level is not between 0 and 1.
        """
        return critical_value(level, self.degrees_of_freedom)

    def interval(self, coefficients: FloatArray, level: float = 0.95) -> FloatArray:
        """Return the interval of each coefficient.

        Parameters
        ----------
        coefficients : array_like, shape (n,)
            The estimate.
        level : float
            As in :meth:`reach`.

        Returns
        -------
        interval : ndarray, shape (n, 2)
            Lower and upper end.

        Raises
        ------
        MethodError
            If the level is not between 0 and 1.
        """
        half = self.critical_value(level) * self.standard_errors
        centre = np.asarray(coefficients, dtype=np.float64)
        return np.column_stack([centre - half, centre + half])

    def __str__(self) -> str:
        """Return one sentence, or two."""
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
        own, noise = np.diag(self.covariance), np.diag(self.noise)
        known = (own > 0.0) & (noise > 0.0)
        ratio = float(np.sqrt(np.median(own[known] / noise[known]))) if known.any() else 1.0
        if ratio < _WIDER:
            return ""
        return (
            f" They are {ratio:.2g} times those of noise alone: most of the errors are the "
            "model's form, and other manoeuvres would give other coefficients."
        )


def _with_room(covariance: FloatArray, shift: FloatArray) -> FloatArray:
    beyond = np.sqrt(np.maximum(shift**2 - np.diag(covariance), 0.0)) * np.sign(shift)
    return covariance + np.outer(beyond, beyond)


def correlation(covariance: FloatArray) -> FloatArray:
    """Return the correlation of estimates."""
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = np.where((deviation > 0.0) & np.isfinite(deviation), deviation, np.nan)
    found: FloatArray = np.clip(covariance / np.outer(known, known), -1.0, 1.0)
    return found


@dataclass(frozen=True)
class Fit:
    """An identified damping model.

    Attributes
    ----------
    damping : Damping
        The model with its numbers and, where the method knows it, covariance.
    method : str
        Key of the method.
    status : Status
        The outcome in words.
    rank : int or None
        Coefficients that the data can distinguish, summed over axes; None for
        online methods.
    aliased : tuple of tuple of str
        Labels that the data cannot distinguish, group by group. A group of one
        is a column that is zero throughout.
    n_samples : int
        Samples used.
    provenance : dict of str to str
        Log, vehicle and settings, in words.
    remarks : tuple of str
        What the method found on its way, in sentences: what it chose, what a
        constraint costs, what was checked.
    uncertainty : Uncertainty or None
        Standard errors and intervals; its covariance is that of the damping. None where
        the method knows none for coloured noise.
    training_range : dict of str to tuple of float
        Least and greatest value of each free velocity [m/s, rad/s] in the training log, without
        1 % of the samples at either end. All but the surge of a vehicle under way count in
        either direction.
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

    @property
    def model(self) -> DampingModel:
        """The model that was identified."""
        return self.damping.model

    @property
    def summary_lines(self) -> tuple[str, ...]:
        """What to read with the numbers: where damping drives, the outcome, remarks, errors."""
        said = (
            *energy_injection_warnings(self.damping, self.training_range),
            self.status.value,
            *self.remarks,
        )
        if self.uncertainty is not None:
            return (*said, str(self.uncertainty))
        return said if self.damping.covariance is None else (*said, WHITE_NOISE_NOTE)

    def __str__(self) -> str:
        """Return the outcome and the coefficients, one screen."""
        rank = "" if self.rank is None else f", rank {self.rank}"
        head = f"{self.model.key} by {self.method}: {self.model.n_coefficients} coefficients{rank}"
        groups = first_few([f"  aliased: {' '.join(one)}" for one in self.aliased], 8, "groups")
        said = [head, *self.summary_lines, *groups, str(self.damping)]
        return "\n".join(said)


#: What is said of a covariance that does not allow for coloured noise.
WHITE_NOISE_NOTE = (
    "Standard errors take the residuals as white: they are too narrow where these are correlated."
)


class Method(Protocol):
    """A way to identify coefficients: a value with one verb."""

    @property
    def key(self) -> str:
        """The key it has on the command line."""
        ...

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify the model's coefficients from a prepared problem."""
        ...


def identify(model: DampingModel, vehicle: Vehicle, log: Log, method: Method) -> Fit:
    """Identify one model from one log.

    Parameters
    ----------
    model : DampingModel
        Which terms.
    vehicle : Vehicle
        Everything known.
    log : Log
        What was measured.
    method : Method
        How, such as ``LeastSquares()``.

    Returns
    -------
    fit : Fit
        Coefficients and how far to trust them.

    Raises
    ------
    ProblemError
        If the log lacks what the vehicle or a term needs.
    """
    return method.identify(prepare(vehicle, log, model), model)


def digest(problem: Problem, model: DampingModel, method: object) -> str:
    """Return what tells one fit from another: data and vehicle, terms, settings, version."""
    import hydrodamp

    terms = model.restricted_to(problem.vehicle.axes).terms
    asked = (problem.digest, model.key, terms, repr(method), hydrodamp.__version__)
    return hashlib.sha256(repr(asked).encode()).hexdigest()[:16]


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
    """Put together the fit of a method that came to numbers.

    Parameters
    ----------
    problem : Problem
        What was used.
    model : DampingModel
        Restricted to the free axes.
    method : Method
        Its key and its settings go into the fit.
    coefficients : ndarray, shape (n_coefficients,)
        In the order of the model's labels.
    covariance : ndarray, shape (n_coefficients, n_coefficients), optional
        Of the coefficients, where there is no uncertainty.
    uncertainty : Uncertainty, optional
        How far to trust the coefficients.
    rank : int, optional
        Coefficients that the data can distinguish, summed over axes.
    aliased : tuple of tuple of str
        Labels that the data cannot distinguish, group by group.
    status : Status, optional
        ``RANK_DEFICIENT`` where something is aliased, else ``OK``; ``FAILED`` whatever
        was asked for where a coefficient is not finite.
    n_samples : int, optional
        Samples used; all of the problem by default.
    remarks : tuple of str
        Sentences.

    Returns
    -------
    fit : Fit
        With the vehicle's stamp and provenance.
    """
    if not np.all(np.isfinite(coefficients)):
        return empty_fit(problem, model, method.key, Status.FAILED)
    if uncertainty is not None:
        covariance = uncertainty.covariance
    named = {label for group in aliased for label in group}
    aliased += tuple(group for group in problem.undetermined(model) if group[0] not in named)
    return Fit(
        damping=Damping(
            model, coefficients, covariance=covariance, vehicle=vehicle_stamp(problem.vehicle)
        ),
        method=method.key,
        status=status or (Status.RANK_DEFICIENT if aliased else Status.OK),
        rank=rank,
        aliased=aliased,
        n_samples=problem.n_samples if n_samples is None else n_samples,
        provenance={
            "log": problem.log.source or "in memory",
            "segments": " ".join(segment.name for segment in problem.log.segments),
            "samples": str(problem.n_samples),
            "vehicle": problem.vehicle.name,
            "settings": repr(method),
            "digest": digest(problem, model, method),
        },
        remarks=remarks,
        uncertainty=uncertainty,
        training_range=velocity_ranges(problem.inputs.velocity, problem.vehicle.axes),
    )


def empty_fit(
    problem: Problem,
    model: DampingModel,
    method: str,
    status: Status,
    remarks: tuple[str, ...] = (),
) -> Fit:
    """Return a fit with no number for any coefficient, and a status that says why."""
    nothing = np.full(model.n_coefficients, np.nan)
    return Fit(
        damping=Damping(model, nothing, vehicle=vehicle_stamp(problem.vehicle)),
        method=method,
        status=status,
        n_samples=problem.n_samples,
        remarks=remarks,
    )


def check_actuation(problem: Problem, model: DampingModel) -> None:
    """Refuse a log without motion, and a model that nothing drives though others may be driven."""
    if not problem.inputs.velocity.any():
        raise MethodError("all velocities of the log are zero: give a log of a vehicle that moves")
    free = model.restricted_to(problem.vehicle.axes)
    if told := missing_actuation(problem.vehicle, problem.log, (free,)):
        raise MethodError(told)


def identify_or_refuse(method: Method, problem: Problem, model: DampingModel) -> Fit:
    """Return a method's fit; where it raises, a fit whose status and remark say so."""
    try:
        check_actuation(problem, model)
        return method.identify(problem, model)
    except MethodError as error:
        free = model.restricted_to(problem.vehicle.axes)
        return empty_fit(problem, free, method.key, Status.REFUSED, (str(error),))
