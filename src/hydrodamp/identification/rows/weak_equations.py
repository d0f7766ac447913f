"""The weak form of equation 3: integrals against test functions in place of derivatives."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.errors import MethodError
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.rows.local_quadratics import Smoothed, smoothed
from hydrodamp.identification.rows.steps import steps_between
from hydrodamp.identification.rows.support import Support, chosen_support
from hydrodamp.identification.rows.triangle import Triangle, merge
from hydrodamp.identification.rows.velocity_noise import median_step
from hydrodamp.identification.rows.weak_functions import bumps, covered
from hydrodamp.simulation.problem import Problem


@dataclass(frozen=True)
class WeakEquations:
    """One row a test function, segment by segment, on the log's own clock.

    Parameters
    ----------
    support : float, optional
        Length of a test function [s]; by default the shortest that hears more motion
        than noise, see :mod:`hydrodamp.identification.rows.support`. Segments shorter than
        that give no rows.
    overlap : int
        How many functions cover an instant. More than four tell nothing new.
    windows : tuple of int
        Odd lengths [samples] of local quadratics offered to each velocity before terms are
        evaluated, see :mod:`hydrodamp.identification.rows.local_quadratics`; ``()``
        evaluates them at velocities as measured. The momentum is always as measured.

    Raises
    ------
    MethodError
        If the support is not positive, the overlap less than one, a window even or under
        three, or (when it is used) no segment as long as the support asked for.

    Examples
    --------
    >>> WeakEquations(support=1.5)
    WeakEquations(support=1.5, overlap=4, windows=(5, 7, 9, 11, 15, 21, 31))
    """

    support: float | None = None
    overlap: int = 4
    windows: tuple[int, ...] = (5, 7, 9, 11, 15, 21, 31)

    def __post_init__(self) -> None:
        """Refuse what makes no test function."""
        if self.support is not None and not 0.0 < self.support < np.inf:
            raise MethodError(f"`support` must be positive [s]; got {self.support}")
        if self.overlap < 1:
            raise MethodError(f"`overlap` must be at least 1; got {self.overlap}")
        if any(window < 3 or window % 2 == 0 for window in self.windows):
            raise MethodError(f"`windows` must be odd, 3 or more; got {self.windows}")

    def rows(self, problem: Problem) -> Rows:
        """Return one row a test function.

        Parameters
        ----------
        problem : Problem
            Samples and terms.

        Returns
        -------
        rows : Rows
            Weighted means of equation 1 under each function, at the time of its middle.
        """
        parts = list(self.on(problem).parts())
        return Rows(
            basis=problem.columns.basis,
            design=np.concatenate([part.design for part in parts]),
            target=np.concatenate([part.target for part in parts]),
            segment=np.concatenate([part.segment for part in parts]),
            time=np.concatenate([part.time for part in parts]),
        )

    def triangle(self, problem: Problem) -> Triangle:
        """Return the triangle of :meth:`rows`, made block by block.

        Parameters
        ----------
        problem : Problem
            Samples and terms.

        Returns
        -------
        triangle : Triangle
            Takes 48 bytes a sample while it is made, for the smoothed velocities.
        """
        return self.on(problem).triangle()

    def on(self, problem: Problem) -> WeakProblem:
        """Settle on a log what was left open.

        Parameters
        ----------
        problem : Problem
            Samples and terms.

        Returns
        -------
        settled : WeakProblem
            The support and the velocities that the rows are made with.
        """
        asked = Support(self.support, "as asked") if self.support is not None else None
        support = asked or chosen_support(problem)
        if asked and not any(covered(time, asked.length) for time in _clocks(problem)):
            raise MethodError(
                f"no segment of the log is as long as the test functions, {asked.length:g} s: "
                "give a shorter `support`, or none to have it chosen"
            )
        return WeakProblem(problem, support, self.overlap, smoothed(problem, self.windows))


@dataclass(frozen=True, eq=False)
class WeakProblem:
    """A problem with its test functions settled."""

    problem: Problem
    support: Support
    overlap: int
    smoothed: Smoothed

    def parts(self) -> Iterator[Rows]:
        """Go through the rows block by block."""
        problem, basis = self.problem, self.problem.columns.basis
        none = np.zeros(0)
        yield Rows(basis, np.zeros((0, len(basis))), np.zeros((0, 6)), none.astype(int), none)
        for number, (start, time) in enumerate(
            zip(problem.segments[:, 0].tolist(), _clocks(problem), strict=True)
        ):
            for some in bumps(time, self.support.length, self.overlap):
                first, last = start + some.start, start + some.stop
                steps = steps_between(problem, first, last, self.smoothed.velocity)
                yield Rows(
                    basis,
                    some.weights @ steps.design,
                    some.weights @ steps.target,
                    np.full(len(some.centres), number),
                    some.centres,
                )

    def triangle(self) -> Triangle:
        """Return the triangle of all rows."""
        return merge(part.triangle() for part in self.parts())

    @property
    def n_samples(self) -> int:
        """Samples of the segments that test functions cover."""
        return sum(len(time) for time in self._used())

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was settled, in sentences."""
        length = self.support.length
        samples = round(length / median_step(self.problem))
        left_out = len(self.problem.segments) - len(self._used())
        return (
            f"Test functions span {length:.3g} s ({samples} samples): {self.support.reason}."
            + (f" {left_out} shorter segments are left out." if left_out else ""),
            *self._smoothing(),
        )

    def _used(self) -> list[FloatArray]:
        return [time for time in _clocks(self.problem) if covered(time, self.support.length)]

    def _smoothing(self) -> tuple[str, ...]:
        spans = [
            f"{name} {window}"
            for name, window in zip(VELOCITIES, self.smoothed.windows, strict=True)
            if window > 1
        ]
        if not spans:
            return ()
        return (f"Terms are taken at smoothed velocities, over samples: {', '.join(spans)}.",)


def _clocks(problem: Problem) -> list[FloatArray]:
    return [problem.inputs.time[start:stop] for start, stop in problem.segments.tolist()]
