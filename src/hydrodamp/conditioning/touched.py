"""What a cleaning step did: the log after it, and how many samples it touched."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeAlias

from hydrodamp.data.log import Log


@dataclass(frozen=True)
class Touched:
    """How many samples of one channel a step touched, and what became of them.

    Attributes
    ----------
    step : str
        What was looked for, such as ``"spikes"``.
    channel : str
        The channel, such as ``"u"`` or ``"attitude"``.
    samples : int
        How many samples were touched.
    of : int
        How many the channel has.
    done : str
        What became of them.

    Examples
    --------
    >>> print(Touched("spikes", "u", 3, 200, "interpolated"))
    spikes: 3 of 200 samples of `u` (1.5 %) interpolated
    """

    step: str
    channel: str
    samples: int
    of: int
    done: str

    def __str__(self) -> str:
        """Return one sentence."""
        share = f"{100 * self.samples / self.of:.2g} %"
        return (
            f"{self.step}: {self.samples} of {self.of} samples of `{self.channel}` ({share})"
            f" {self.done}"
        )


@dataclass(frozen=True)
class Cleaned:
    """A log after one or several steps.

    Attributes
    ----------
    log : Log
        Its notes tell what was done.
    touched : tuple of Touched
        One for each step and channel that had something to touch.

    Examples
    --------
    >>> log = Log(time=[0.0, 0.1], velocity=[[1.0] * 6] * 2)
    >>> Cleaned(log).count
    0
    """

    log: Log
    touched: tuple[Touched, ...] = ()

    @property
    def count(self) -> int:
        """How many samples were touched, summed over steps and channels."""
        return sum(one.samples for one in self.touched)

    def counts(self, step: str) -> dict[str, int]:
        """Return the samples that one step touched, by channel.

        Parameters
        ----------
        step : str
            As in :class:`Touched`.

        Returns
        -------
        counts : dict of str to int
            Without the channels that were left alone.
        """
        found: dict[str, int] = {}
        for one in self.touched:
            if one.step == step:
                found[one.channel] = found.get(one.channel, 0) + one.samples
        return found

    def __str__(self) -> str:
        """Return a line for each step and channel, then what the log tells of itself."""
        lines = [str(one) for one in self.touched] or ["nothing was touched"]
        told = [note for note in self.log.notes if note not in lines]
        return "\n".join([*lines, *told])


Step: TypeAlias = Callable[[Log], Cleaned]
"""A cleaning step; give one settings with :func:`functools.partial`."""


def cleaned(log: Log, touched: Iterable[Touched]) -> Cleaned:
    """Return the outcome of a step, told in the notes of the log."""
    found = tuple(one for one in touched if one.samples)
    return Cleaned(log.noted(*map(str, found)) if found else log, found)
