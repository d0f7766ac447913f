"""The ninth model: a few terms, chosen for what they do to the replay."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.identification.candidates import candidates, distinct, drag, kept, moved, picked
from hydrodamp.identification.elimination import forward, frequencies, nested, sized, solved
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

# A log is cut into this many windows at least.
_LEAST = 16

# Terms that forward selection takes before elimination, and the share of the half samples on which
# one must be chosen.
_MOST, _OFTEN = 60, 0.5


class Round(NamedTuple):
    """One round: selection around a model, and the replay of what was selected."""

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

    Raises
    ------
    MethodError
        If a length is not positive.

    Examples
    --------
    >>> Sparse().windows
    (10.0, 30.0, 30.0)
    """

    windows: tuple[float, ...] = (10.0, 30.0, 30.0)

    def __post_init__(self) -> None:
        """Check the lengths."""
        if not self.windows or not all(0.0 < window < np.inf for window in self.windows):
            raise MethodError(f"`windows` must be positive lengths [s]; got {self.windows}")

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
            made, damping = select_around(problem, offered, damping, window)
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


def select_around(
    problem: Problem, offered: DampingModel, around: Damping, window: float
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
    order = forward(total, _MOST, held.tolist())
    stable = order[frequencies(blocks, held.tolist())[order] >= _OFTEN]
    pool = [*stable.tolist(), *held.tolist()]
    for group in groups:  # a term that brakes each axis
        if len(group) and not np.isin(group, pool).any():
            pool.append(int([*order[np.isin(order, group)], *group][0]))
    sets = nested(total, np.unique(np.array(pool, dtype=np.int64)), held, groups)
    place, words = sized(blocks, sets, PowerRows(offered).rows(spread(box)))
    model = picked(offered, sets[place])
    damping, rms = refit(problem, model, [solved(total, sets[place])], (_SHORT, window))
    return Round(model, words, rms, worst_power(damping, box).power), damping


def replay_blocks(
    problem: Problem, model: DampingModel, around: Damping, length: float
) -> tuple[FloatArray, int]:
    """Linearise the replay in the coefficients of a large model around a small one.

    Normal matrices of the blocks, shape (n, p + 1, p + 1), and how many blocks cannot be replayed.
    """
    search = searching(problem, model)
    windows = search.windows(min(length, problem.duration / _LEAST))
    guessed = around.onto(model)
    spread = np.sqrt(np.maximum(np.mean(windows.errors(guessed) ** 2, axis=0), search.noise**2))
    turn = np.eye(len(guessed) + 1)
    turn[:-1, -1] = guessed
    found = windows.normals(guessed, spread)
    whole = found[:, -1, -1] > 0.0
    return turn.T @ found[whole] @ turn, int(np.sum(~whole))


def _first(problem: Problem, offered: DampingModel) -> DampingModel:
    """Choose a few terms of each axis from the rows of the regression."""
    triangle = WeakEquations().rows(problem).triangle()
    fixed, brakes, start = kept(offered), drag(offered), 0
    chosen: list[int] = []
    for axis, terms in enumerate(offered.terms):
        part = np.column_stack([triangle.columns(terms), triangle.target(axis)])
        first = np.flatnonzero(fixed[start : start + len(terms)])
        order = forward(part.T @ part, len(terms), first.tolist()) + start
        braking = [*order[np.isin(order, brakes[axis])], *brakes[axis]]
        chosen += [*(first + start), *order[: len(first) + _FIRST], *braking[:1]]
        start += len(terms)
    return picked(offered, np.unique(np.array(chosen, dtype=np.int64)))


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
    finished = [(one.rms, one) for one in rounds if one.rms is not None]
    if not finished:
        return rounds[-1], "No selected model replays the training data; this is the last."
    braking = [(rms, one) for rms, one in finished if one.push <= 0.0]
    ranked = braking or finished
    least = min(rms for rms, _ in ranked)
    near = [(one.model.n_coefficients, rms, one) for rms, one in ranked if rms <= _NEAR * least]
    what = "takes power on the whole operating box" if braking else "replays the training data"
    return min(near, key=lambda each: each[:2])[-1], (
        f"{len(ranked)} of {len(rounds)} rounds gave a model that {what} when fitted to it; this "
        f"one has the fewest coefficients within {100.0 * (_NEAR - 1.0):.0f} % of their lowest "
        f"RMS on the training data, {least:.3g}."
    )
