"""The ninth model: a few terms, chosen for what they do to the replay."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.identification.candidates import candidates, distinct, drag, kept, moved, picked
from hydrodamp.identification.elimination import (
    forward,
    frequencies,
    nested,
    replay_blocks,
    sized,
    solved,
)
from hydrodamp.identification.power import PowerRows, operating_box, spread, worst_power
from hydrodamp.identification.search import ladder, searching, starts, within
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, prepare
from hydrodamp.simulation.replay import replay
from hydrodamp.simulation.score import score
from hydrodamp.vehicle.vehicle import Vehicle

# Terms an axis has in the first model, and the windows that it is fitted on [s].
_FIRST, _SHORT = 4, 5.0

# A round with fewer coefficients may be this much worse on the training data.
_NEAR = 1.1

# Blocks below which nothing can be left out.
_FEWEST = 4

# Terms chosen on each half sample.
_DRAWN = 40


@dataclass(frozen=True)
class Round:
    """One round: selection around a model, and the replay of what was selected."""

    window: float
    model: DampingModel
    words: str
    rms: float | None
    push: float


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
            Commands that neither they nor the vehicle's actuators take are offered on
            the axes where they explain what a plain damping leaves over, and kept there.
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
        given = tuple(models)
        driven = moved(vehicle, log, given)
        given = given if driven is None else (*given, driven)
        everything = candidates(vehicle, log, given)
        offered = distinct(prepare(vehicle, log, everything), everything)
        problem = prepare(vehicle, log, offered)
        first = _first(problem, offered)
        damping, _ = refit(problem, first, (), (_SHORT,))
        rounds: list[Round] = []
        for window in self.windows:
            made, damping = self.round(problem, offered, damping, window)
            rounds.append(made)
            if done is not None:
                done(made)
        best, why = best_round(rounds)
        source = f"selected by hydrodamp from {log.source or 'a log in memory'}"
        note = f"{why} {best.words}"
        idle = set(log.command_names) - {*vehicle.commands, *best.model.commands}
        if idle and log.wrench is None:
            note += f" No axis follows the command {' '.join(sorted(idle))}."
        return replace(best.model, source=source, note=note)

    def round(
        self, problem: Problem, offered: DampingModel, around: Damping, window: float
    ) -> tuple[Round, Damping]:
        """Select around a small model, and fit what was selected."""
        blocks, lost = replay_blocks(problem, offered, around, window)
        if len(blocks) < _FEWEST:
            raise MethodError(
                f"only {len(blocks)} of {len(blocks) + lost} blocks of the log can be replayed, "
                f"and a selection needs {_FEWEST}: give a longer log, or check its signs and the "
                "vehicle's mass and actuators."
            )
        held, groups, box = np.flatnonzero(kept(offered)), drag(offered), operating_box(problem)
        total = blocks.sum(axis=0)
        order = forward(total, self.most, held.tolist())
        often = frequencies(blocks, _DRAWN, self.pairs, self.seed, held.tolist())
        pool = _pool(order, often >= self.frequency, held, groups)
        sets = nested(total, pool, held, groups)
        place, words = sized(blocks, sets, PowerRows(offered).rows(spread(box)))
        model = picked(offered, sets[place])
        damping, rms = refit(problem, model, [solved(total, sets[place])], (_SHORT, window))
        return Round(window, model, words, rms, worst_power(damping, box).power), damping


def _first(problem: Problem, offered: DampingModel) -> DampingModel:
    """Choose a few terms of each axis from the rows of the regression."""
    triangle = WeakEquations().rows(problem).triangle()
    fixed, brakes = kept(offered), drag(offered)
    chosen: list[int] = []
    start = 0
    for axis, terms in enumerate(offered.terms):
        columns = [triangle.basis.index(term) for term in terms]
        part = triangle.r[:, [*columns, len(triangle.basis) + axis]]
        first = np.flatnonzero(fixed[start : start + len(terms)])
        order = forward(part.T @ part, len(terms), first.tolist()) + start
        braking = [*order[np.isin(order, brakes[axis])], *brakes[axis]]
        chosen += [*(first + start), *order[: len(first) + _FIRST], *braking[:1]]
        start += len(terms)
    return picked(offered, np.unique(np.array(chosen, dtype=np.int64)))


def _pool(
    order: IntArray, stable: BoolArray, held: IntArray, groups: Sequence[IntArray]
) -> IntArray:
    """Return what is chosen stably, what is held, and a term that brakes each axis."""
    pool = [*order[stable[order]].tolist(), *held.tolist()]
    for group in groups:
        if len(group) and not np.isin(group, pool).any():
            met = order[np.isin(order, group)]
            pool.append(int((met if len(met) else group)[0]))
    return np.unique(np.array(pool, dtype=np.int64))


def refit(
    problem: Problem, model: DampingModel, first: Sequence[FloatArray], lengths: Sequence[float]
) -> tuple[Damping, float | None]:
    """Fit the replay on windows of some lengths, and score that of the whole log."""
    search = searching(problem, model)
    places = ladder(search, [*first, *starts(problem, model)], within(problem, lengths))
    damping = Damping(model, places[-1].coefficients)
    return damping, score(replay(problem, damping)).rms


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
