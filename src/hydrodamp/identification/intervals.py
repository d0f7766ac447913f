"""How far to trust some coefficients: their covariance, and intervals from it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import MethodError

# From here on a median ratio of standard errors is worth a sentence.
_WIDER = 1.5


def reach(level: float = 0.95, degrees_of_freedom: float = np.inf) -> float:
    """Return how many standard errors an interval reaches to either side."""
    if not 0.0 < level < 1.0:
        raise MethodError(f"`level` must lie between 0 and 1; got {level}")
    if not degrees_of_freedom > 0.0:
        raise MethodError(f"`degrees_of_freedom` must be positive; got {degrees_of_freedom}")
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
    allowance: str = ""

    def __post_init__(self) -> None:
        """Copy the arrays and check them."""
        n = len(np.atleast_1d(self.covariance))
        for name in ("covariance", "noise"):
            if getattr(self, name) is not None:
                try:
                    values = frozen(getattr(self, name), (n, n), name)
                except ValueError as error:
                    raise MethodError(f"{error}; give one row and column a coefficient") from error
                object.__setattr__(self, name, values)
        if not self.degrees_of_freedom > 0.0:
            raise MethodError(
                f"`degrees_of_freedom` must be positive; got {self.degrees_of_freedom}"
            )

    @property
    def standard_errors(self) -> FloatArray:
        """Standard error of each coefficient, shape (n,)."""
        return np.sqrt(np.diag(self.covariance))

    def widened(self, shift: FloatArray, allowance: str) -> Uncertainty:
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
        >>> found.widened(np.array([4.0, 1.0]), "a bias").standard_errors.tolist()
        [4.0, 1.0]
        """
        return replace(
            self,
            covariance=_with_room(self.covariance, shift),
            noise=None if self.noise is None else _with_room(self.noise, shift),
            allowance=allowance,
        )

    @property
    def of_noise(self) -> Uncertainty:
        """What noise alone makes of the same manoeuvres; itself where that is not known apart."""
        if self.noise is None:
            return self
        return replace(self, covariance=self.noise, noise=None)

    def reach(self, level: float = 0.95) -> float:
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
        return reach(level, self.degrees_of_freedom)

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
        half = self.reach(level) * self.standard_errors
        centre = np.asarray(coefficients, dtype=np.float64)
        return np.column_stack([centre - half, centre + half])

    def __str__(self) -> str:
        """Return one sentence, or two."""
        if self.block is None:
            return f"Standard errors are from {self.method}."
        return (
            f"Standard errors are from {self.method}, in {self.n_blocks} blocks of "
            f"{self.block:.3g} s; intervals have {self.degrees_of_freedom:.0f} degrees of freedom."
            + (f" They allow for {self.allowance}." if self.allowance else "")
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


#: Correlation from which two coefficients are known better together than each alone.
CORRELATED = 0.9


class Pair(NamedTuple):
    """Two coefficients, by their places in the model, and the correlation of their errors."""

    first: int
    second: int
    correlation: float


def correlation(covariance: FloatArray) -> FloatArray:
    """Return the correlation of estimates."""
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = np.where((deviation > 0.0) & np.isfinite(deviation), deviation, np.nan)
    found: FloatArray = np.clip(covariance / np.outer(known, known), -1.0, 1.0)
    return found


def correlated_pairs(covariance: FloatArray) -> list[Pair]:
    """Return the pairs of coefficients whose errors are correlated, the most correlated first."""
    found = np.nan_to_num(np.triu(correlation(covariance), 1))
    first, second = np.nonzero(found)
    values = found[first, second]
    order = np.argsort(-np.abs(values), kind="stable")
    places = zip(first[order].tolist(), second[order].tolist(), strict=True)
    return [Pair(i, j, value) for (i, j), value in zip(places, values[order].tolist(), strict=True)]
