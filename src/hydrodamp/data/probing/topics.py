"""Topics in numbers: how many messages, how often, with what gaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.data.probing.clocks import Ticking, ticking
from hydrodamp.data.recording import Recording, Topic


@dataclass(frozen=True)
class TopicFacts:
    """One topic of a recording.

    Attributes
    ----------
    name : str
        As the file calls it; empty for a table.
    n : int
        Messages.
    n_fields : int
        Fields of numbers.
    rate : float or None
        Median [Hz]; None where there is no clock or one message.
    jitter : float or None
        Half the width of the middle 90 % of all steps, over the median step [1].
    longest_gap : float or None
        Longest step [s].
    start, end : float or None
        First and last time [s].
    backward : int
        Steps that go back or stand still.
    units : tuple of (str, str)
        Fields and the units the file states.
    faults : tuple of str
        Fields that cannot be read.
    """

    name: str
    n: int
    n_fields: int
    rate: float | None
    jitter: float | None
    longest_gap: float | None
    start: float | None
    end: float | None
    backward: int
    units: tuple[tuple[str, str], ...]
    faults: tuple[str, ...]


def topics_of(recording: Recording) -> tuple[TopicFacts, ...]:
    """Return the facts about every topic.

    Parameters
    ----------
    recording : Recording
        As read.

    Returns
    -------
    facts : tuple of TopicFacts
        In the order of the recording.

    Examples
    --------
    >>> imu = Topic("imu", [0.0, 0.1, 0.2, 1.2], {"gyro": [0.0, 0.0, 0.1, 0.2]})
    >>> facts = topics_of(Recording((imu,), "dive", "bag"))[0]
    >>> round(facts.rate, 3), round(facts.longest_gap, 3)
    (10.0, 1.0)
    """
    return tuple(_facts(topic, ticking(topic)) for topic in recording.topics)


def _facts(topic: Topic, clock: Ticking | None) -> TopicFacts:
    times = np.empty(0) if clock is None else clock.seconds[np.isfinite(clock.seconds)]
    steps = np.diff(times)
    ahead = steps[steps > 0.0]
    known = len(ahead) > 0
    step = float(np.median(ahead)) if known else 0.0
    low, high = np.quantile(ahead, (0.05, 0.95)) if known else (0.0, 0.0)
    return TopicFacts(
        name=topic.name,
        n=topic.n,
        n_fields=len(topic.fields),
        rate=1 / step if known else None,
        jitter=float(high - low) / 2 / step if known else None,
        longest_gap=float(ahead.max()) if known else None,
        start=float(times[0]) if len(times) else None,
        end=float(times[-1]) if len(times) else None,
        backward=int(np.count_nonzero(steps <= 0.0)),
        units=tuple((name, unit) for name, unit in topic.units.items() if unit),
        faults=tuple(topic.faults.values()),
    )
