"""The search of output error: stages on windows that grow, and the choice on its way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.replays.refine import (
    LIKE_NOISE,
    Path,
    Place,
    Search,
    refine,
    searching,
)
from hydrodamp.identification.replays.runaway import runaways
from hydrodamp.identification.replays.shooting import Guess, Shooting
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

_SHORTEST = 1.0
"""Windows shrink down to this where the guess diverges on longer ones [s]."""

_FIRST = 1e-2
"""Strength of the prior before the data have set it."""


@dataclass(frozen=True, eq=False)
class Climb:
    """Where a search ended."""

    search: Search
    place: Place
    short: FloatArray | None
    settled: bool
    words: str

    @property
    def coefficients(self) -> FloatArray:
        """Of the place chosen, shape (p,)."""
        return self.place.coefficients

    def slopes(self) -> FloatArray:
        """Return the weighted Jacobian's triangle there, on whole segments, shape (p, p)."""
        whole = self.search.shooting(np.inf)
        guess = Guess(self.coefficients, whole.measured_starts())
        errors = whole.errors(guess)
        finite = bool(np.all(np.isfinite(errors)))
        around = whole.linearised(guess, self.search.spread(errors)) if finite else None
        size = len(self.coefficients)
        return np.zeros((size, size)) if around is None else around.triangle[:-1, :-1]


def climb(
    problem: Problem,
    model: DampingModel,
    starts: Sequence[FloatArray],
    lengths: tuple[float, ...],
    rounds: int,
) -> Climb:
    """Search from the best of several starts, through windows of growing length."""
    search = searching(problem, model)
    whole = search.shooting(np.inf)
    ladder = [whole, search.shooting(lengths[0]), search.shooting(_SHORTEST)]
    first = min(starts, key=lambda start: [_replayed(windows, start)[1] for windows in ladder])
    paths, words = _stages(search, Place(first, np.full(6, _FIRST)), lengths, rounds)
    places = [place for path in paths for place in path.places]
    places += [Place(start, np.full(6, _FIRST)) for start in starts]
    end = paths[-1].places[-1] if paths else None
    chosen, why = _chosen(whole, places, end)
    at_rest = chosen is end and paths[-1].settled
    return Climb(
        search=search,
        place=chosen,
        short=paths[0].places[-1].coefficients if paths else None,
        settled=at_rest,
        words=words + why,
    )


def _chosen(whole: Shooting, places: list[Place], end: Place | None) -> tuple[Place, str]:
    """Return the end, or the nearest place where it runs away, and why not the end."""

    def rank(place: Place) -> tuple[bool, int, float]:
        lost, misfit = _replayed(whole, place.coefficients)
        return place is not end or lost > 0, lost, misfit

    columns, entries = whole.problem.columns, whole.entries
    ranked = sorted(places, key=rank)
    for place in ranked:
        if not runaways(whole.problem, columns.with_unknown(entries, place.coefficients)):
            return place, _why(place, end, ranked)
    return ranked[0], " Every place on the way runs away when driven a little softer."


def _why(chosen: Place, end: Place | None, ranked: list[Place]) -> str:
    if chosen is end:
        return ""
    if end is None:
        return " The start is given as it is."
    if any(place is end for place in ranked[: ranked.index(chosen)]):
        return " An earlier place is given: the end runs away when driven a little softer."
    return " An earlier place is given: the end runs away on whole runs."


def _replayed(shooting: Shooting, coefficients: FloatArray) -> tuple[int, float]:
    """Return the samples lost after a divergence, and the errors' log-likelihood per sample."""
    errors = shooting.errors(Guess(coefficients, shooting.measured_starts()))
    lost = int(np.count_nonzero(~np.isfinite(errors).all(axis=1)))
    square = np.mean(errors**2, axis=0) + (LIKE_NOISE * shooting.noise) ** 2
    return lost, float(np.sum(np.log(square))) if np.all(np.isfinite(square)) else np.inf


def _stages(
    search: Search, start: Place, lengths: tuple[float, ...], rounds: int
) -> tuple[list[Path], str]:
    """Climb from the shortest windows to the longest; say how far it went."""
    paths: list[Path] = []
    stuck = ""
    for length in lengths:
        last = paths[-1].places[-1] if paths else start
        reached = _reach(search, last, length, rounds)
        if reached is None and paths:  # the shorter windows led astray: from the start again
            reached = _reach(search, start, length, rounds)
        if reached is None:
            stuck = f" replays of {_seconds(length)} run away from every place."
        else:
            paths.append(reached)
    if stuck:
        return paths, "it got stuck:" + stuck
    rest = "came to rest" if paths[-1].settled else "had not come to rest"
    return paths, f"on windows of {_seconds(lengths[-1])} it {rest}."


def _seconds(length: float) -> str:
    return f"{length:g} s" if np.isfinite(length) else "whole runs"


def _reach(search: Search, start: Place, length: float, rounds: int) -> Path | None:
    """Run a stage; where its start diverges, mend it on shorter windows first."""
    shooting = search.shooting(length)
    path = refine(search, shooting, start, rounds)
    if path is not None:
        return path
    shorter = float(np.diff(search.problem.inputs.time[shooting.windows - [0, 1]]).max()) / 3.0
    if shorter < _SHORTEST:
        return None
    mended = _reach(search, start, shorter, rounds)
    return None if mended is None else refine(search, shooting, mended.places[-1], rounds)
