"""Block bootstrap: the same estimate from stretches of the log drawn with replacement."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.basis.basis import Basis
from hydrodamp.data.log import Log, Segment
from hydrodamp.data.stretches import take
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Method
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.rows.rank import solve_axis
from hydrodamp.identification.rows.triangle import Triangle
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, prepare


@dataclass(frozen=True, eq=False)
class Draws:
    """Estimates from logs drawn from a log.

    Attributes
    ----------
    model : DampingModel
        Restricted to the free axes.
    coefficients : ndarray, shape (n, n_coefficients)
        One row a draw.
    n_failed : int
        Draws that gave no numbers; they are not among the rows.
    block : float
        Length of the stretches asked for [s].
    n_blocks : int
        Stretches there were to draw from.

    Raises
    ------
    MethodError
        If there are fewer than two rows.
    """

    model: DampingModel
    coefficients: FloatArray
    n_failed: int
    block: float
    n_blocks: int

    def __post_init__(self) -> None:
        """Freeze the draws and refuse too few."""
        object.__setattr__(self, "coefficients", frozen(self.coefficients))
        if len(self.coefficients) < 2:
            raise MethodError(
                f"a bootstrap needs at least 2 draws that give numbers; got "
                f"{len(self.coefficients)}, and {self.n_failed} failed. Give longer blocks, a "
                "smaller model or more draws."
            )

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the draws, shape (n_coefficients, n_coefficients)."""
        size = self.model.n_coefficients
        covariance: FloatArray = np.cov(self.coefficients.T).reshape(size, size)
        return covariance

    def interval(self, level: float = 0.95) -> FloatArray:
        """Return the percentile interval of each coefficient.

        Parameters
        ----------
        level : float
            Share of the draws inside.

        Returns
        -------
        interval : ndarray, shape (n_coefficients, 2)
            Lower and upper end.

        Raises
        ------
        MethodError
            If the level is not between 0 and 1.
        """
        if not 0.0 < level < 1.0:
            raise MethodError(f"`level` must lie between 0 and 1; got {level}")
        ends = [0.5 - level / 2.0, 0.5 + level / 2.0]
        interval: FloatArray = np.quantile(self.coefficients, ends, axis=0).T
        return interval


def bootstrap_rows(
    rows: Rows, model: DampingModel, block: float, n: int = 200, seed: int = 0
) -> Draws:
    """Repeat ordinary least squares on blocks of rows drawn with replacement."""
    pieces = _pieces(rows.segment, rows.time, block, least=1)
    _check(pieces, n, block)
    small = _only(rows, model)
    triangles = [small.taken(np.arange(*piece)).triangle().r for piece in pieces]
    drawn = []
    for chosen in _chosen(len(pieces), n, seed):
        count = np.bincount(chosen, minlength=len(pieces))
        stack = np.vstack([np.sqrt(count[i]) * triangles[i] for i in np.flatnonzero(count)])
        n_rows = int(sum(count[i] * (stop - start) for i, (start, stop) in enumerate(pieces)))
        drawn.append(_solved(Triangle(small.basis, np.linalg.qr(stack)[1], n_rows), model))
    return Draws(model, np.array(drawn), 0, block, len(pieces))


def bootstrap(
    problem: Problem,
    model: DampingModel,
    method: Method,
    block: float,
    n: int = 200,
    seed: int = 0,
) -> Draws:
    """Repeat any method on logs put together from stretches drawn with replacement.

    Parameters
    ----------
    problem : Problem
        Vehicle and log.
    model : DampingModel
        Which terms.
    method : Method
        What to repeat; n times its cost.
    block : float
        Length of a stretch [s]. Longer than the correlation, and long enough for the
        method: every stretch is a segment of its own.
    n : int
        How many draws.
    seed : int
        Of the draws.

    Returns
    -------
    draws : Draws
        Without the draws whose status is not usable; these are counted.

    Raises
    ------
    MethodError
        If there are fewer than two stretches or draws, the block is not positive, or all
        draws but one fail.

    Examples
    --------
    >>> from hydrodamp.identification.regression.least_squares import LeastSquares
    >>> from hydrodamp.models.catalog import catalog
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> campaign, fossen = reenact(duration=20.0), catalog["fossen"]
    >>> problem = prepare(campaign.vehicle, campaign.train, fossen)
    >>> bootstrap(problem, fossen, LeastSquares(), block=5.0, n=3).coefficients.shape
    (3, 12)
    """
    free = model.restricted_to(problem.vehicle.axes)
    log = problem.log
    number = np.repeat(np.arange(len(log.segments)), [len(part) for part in log.segments])
    pieces = _pieces(number, log.time, block, least=2)
    _check(pieces, n, block)
    found, failed = [], 0
    for chosen in _chosen(len(pieces), n, seed):
        drawn = prepare(problem.vehicle, _put_together(log, [pieces[i] for i in chosen]), free)
        fit = method.identify(drawn, free)
        if fit.status.usable:
            found.append(fit.damping.coefficients)
        failed += not fit.status.usable
    return Draws(free, np.array(found), failed, block, len(pieces))


def _pieces(segment: IntArray, time: FloatArray, block: float, least: int) -> list[tuple[int, int]]:
    """Cut every segment into stretches of equal time, about as long as the block."""
    if not block > 0.0:
        raise MethodError(f"`block` must be positive [s]; got {block}")
    edges = [0, *(np.flatnonzero(np.diff(segment)) + 1).tolist(), len(time)]
    found: list[tuple[int, int]] = []
    for start, stop in itertools.pairwise(edges):
        span = float(time[stop - 1] - time[start])
        count = max(round(span / block), 1)
        marks = time[start] + span * np.arange(1, count) / count
        cuts = [start]
        for cut in (start + np.searchsorted(time[start:stop], marks)).tolist():
            if cut - cuts[-1] >= least and stop - cut >= least:
                cuts.append(cut)
        found += itertools.pairwise([*cuts, stop])
    return found


def _check(pieces: list[tuple[int, int]], n: int, block: float) -> None:
    if n < 2:
        raise MethodError(f"a bootstrap needs at least 2 draws; got n = {n}")
    if len(pieces) < 2:
        raise MethodError(
            f"the log has a single block of {block:g} s: there is nothing to draw from. Give a "
            "longer log or a shorter block."
        )


def _chosen(n_pieces: int, n: int, seed: int) -> Iterable[IntArray]:
    return np.random.default_rng(seed).integers(n_pieces, size=(n, n_pieces))


def _only(rows: Rows, model: DampingModel) -> Rows:
    """Return rows without the columns of other models: triangles cost the cube of those."""
    columns = [rows.basis.index(term) for term in model.basis]
    basis = Basis(model.basis.terms)
    return Rows(basis, rows.design[:, columns], rows.target, rows.segment, rows.time)


def _solved(triangle: Triangle, model: DampingModel) -> FloatArray:
    return np.concatenate(
        [solve_axis(triangle, terms, axis).coefficients for axis, terms in enumerate(model.terms)]
    )


def _put_together(log: Log, pieces: list[tuple[int, int]]) -> Log:
    names = (f"draw {place}" for place in range(len(pieces)))
    return take(log, [Segment(name, *piece) for name, piece in zip(names, pieces, strict=True)])
