"""The ninth model: a few terms, chosen for what they do to the replay."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.identification.regression.ridge import Ridge
from hydrodamp.identification.rows.equations import Equations
from hydrodamp.identification.rows.weak_equations import WeakEquations
from hydrodamp.identification.selection.candidates import (
    KEY,
    candidates,
    distinct,
    drag,
    kept,
    picked,
)
from hydrodamp.identification.selection.error_reduction import forward
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.validation.rounds import Stability, next_round, refit
from hydrodamp.validation.selection import Round, Selection
from hydrodamp.vehicle.vehicle import Vehicle

#: Terms an axis has in the first model.
_FIRST = 4

#: Windows that the first model is fitted on [s].
_SHORT = 5.0

#: A round with fewer coefficients may be this much worse on the training data.
_NEAR = 1.1


@dataclass(frozen=True)
class Sparse:
    """Select a model with few terms from a log.

    Parameters
    ----------
    windows : tuple of float
        Length of the windows that are replayed, round by round [s].
    most : int
        How many terms forward selection takes before elimination.
    frequency : float
        A term must be chosen on this share of the half samples, above 0 and at most 1.
    pairs : int
        Pairs of complementary half samples that are drawn.
    seed : int
        Of the draw.
    degrees : tuple of int, optional
        How many velocities a candidate is a product of; by default two for a vehicle
        under way, one and two for one that hovers, see
        :func:`hydrodamp.identification.selection.candidates.candidates`.
    equations : Equations
        Rows that the first model is chosen from.

    Raises
    ------
    MethodError
        If a setting is out of range.

    Examples
    --------
    >>> Sparse(frequency=0.6).frequency
    0.6
    """

    windows: tuple[float, ...] = (10.0, 30.0, 30.0)
    most: int = 60
    frequency: float = 0.5
    pairs: int = 25
    seed: int = 0
    degrees: tuple[int, ...] | None = None
    equations: Equations = field(default_factory=WeakEquations)

    def __post_init__(self) -> None:
        """Check the settings."""
        if not self.windows or not all(0.0 < window < np.inf for window in self.windows):
            raise MethodError(f"`windows` must be positive lengths [s]; got {self.windows}")
        if self.most < 1 or self.pairs < 1:
            raise MethodError(
                f"`most` and `pairs` must be at least 1; got {self.most} and {self.pairs}"
            )
        if not 0.0 < self.frequency <= 1.0:
            raise MethodError(f"`frequency` must be above 0 and at most 1; got {self.frequency:g}")

    @property
    def key(self) -> str:
        """The key of the model it makes."""
        return KEY

    def select(
        self,
        vehicle: Vehicle,
        log: Log,
        models: Iterable[DampingModel] = (),
        done: Callable[[Round], None] | None = None,
    ) -> DampingModel:
        """Return the selected model.

        Parameters
        ----------
        vehicle : Vehicle
            Everything known.
        log : Log
            What the model is to be identified from; never what it is tested on.
        models : iterable of DampingModel
            Their damping terms are further candidates. Their terms with commands,
            weight and constants are no damping: they are kept, whatever is selected.
        done : callable, optional
            Called with each round as it comes, one for each of the windows.

        Returns
        -------
        model : DampingModel
            Key ``sparse``; its note says how it was selected.

        Raises
        ------
        MethodError
            If the log is too short to select from.
        """
        return self.selection(vehicle, log, models, done).model

    def selection(
        self,
        vehicle: Vehicle,
        log: Log,
        models: Iterable[DampingModel] = (),
        done: Callable[[Round], None] | None = None,
    ) -> Selection:
        """Return the selected model and how it was come by.

        Parameters
        ----------
        vehicle, log, models, done
            As in :meth:`select`.

        Returns
        -------
        selection : Selection
            Prints itself in words.

        Raises
        ------
        MethodError
            If the log is too short to select from.
        """
        everything = candidates(vehicle, log, models, self.degrees)
        problem = prepare(vehicle, log, everything)
        offered = distinct(problem, everything)
        problem = prepare(vehicle, log, offered)
        asked = Stability(self.most, self.frequency, self.pairs, self.seed)
        first = self._first(problem, offered)
        start = Ridge(self.equations).identify(problem, first).damping.coefficients
        damping, _ = refit(problem, first, [start], (_SHORT,))
        rounds: list[Round] = []
        for window in self.windows:
            made, damping = next_round(problem, offered, damping, window, asked)
            rounds.append(made)
            if done is not None:
                done(made)
        return _chosen(rounds, log)

    def _first(self, problem: Problem, offered: DampingModel) -> DampingModel:
        """Choose a few terms of each axis from the rows of the regression."""
        triangle = self.equations.triangle(problem)
        fixed, brakes = kept(offered), drag(offered)
        chosen: list[int] = []
        start = 0
        for axis, terms in enumerate(offered.terms):
            columns = [triangle.basis.index(term) for term in terms]
            part = triangle.r[:, [*columns, len(triangle.basis) + axis]]
            first = np.flatnonzero(fixed[start : start + len(terms)])
            order = forward(part.T @ part, len(terms), first.tolist()).order + start
            braking = [*order[np.isin(order, brakes[axis])], *brakes[axis]]
            chosen += [*(first + start), *order[: len(first) + _FIRST], *braking[:1]]
            start += len(terms)
        return picked(offered, np.unique(np.array(chosen, dtype=np.int64)))


def _chosen(rounds: list[Round], log: Log) -> Selection:
    """Take the round with the fewest coefficients among those that replay nearly best."""
    best, why = best_round(rounds)
    model = replace(
        best.model,
        source=f"selected by hydrodamp from {log.source or 'a log in memory'}",
        note=f"{why} {best.words}",
    )
    return Selection(model, tuple(rounds), rounds.index(best), why)


def best_round(rounds: Sequence[Round]) -> tuple[Round, str]:
    """Choose among rounds: dissipation first, then the replay, then the size."""
    finished = [(made.rms, made) for made in rounds if made.rms is not None]
    if not finished:
        return rounds[-1], "No selected model replays the training data; this is the last."
    braking = [(rms, made) for rms, made in finished if made.push <= 0.0]
    ranked = braking or finished
    least = min(rms for rms, _ in ranked)
    near = [(rms, made) for rms, made in ranked if rms <= _NEAR * least]
    best = min(near, key=lambda each: (each[1].model.n_coefficients, each[0]))[1]
    what = "takes power on the whole operating box" if braking else "replays the training data"
    return best, (
        f"{len(ranked)} of {len(rounds)} rounds gave a model that {what} when fitted to it; this "
        f"one has the fewest coefficients within {100.0 * (_NEAR - 1.0):.0f} % of their lowest "
        f"RMS on the training data, {least:.3g}."
    )
