"""What drives a plant, sample by sample, and one such sample alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.errors import ProblemError

PACKED = 18
"""Numbers of a packed sample before its channels."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """Recorded motion and actuation, arrays only.

    Parameters
    ----------
    time : array_like, shape (n,)
        Strictly increasing within a segment [s].
    velocity : array_like, shape (n, 6)
        u v w [m/s], p q r [rad/s], body frame.
    down : array_like, shape (n, 3)
        The world's down direction in the body frame.
    wrench : array_like, shape (n, 6)
        Recorded force [N] and moment [N m], body frame, on the right-hand side.
    channels : array_like, shape (n, m)
        Command channels, each held until the next sample.
    propulsion : array_like, shape (n, 2)
        The propeller's surge speed u_c [m/s]: held over the step that begins
        at the sample, and the one to use where the sample ends a step.

    Raises
    ------
    ProblemError
        If a shape does not agree with the others, or a time is not finite.

    Examples
    --------
    >>> n = 3
    >>> rest = [np.zeros((n, width)) for width in (6, 3, 6, 0, 2)]
    >>> Inputs(np.arange(n), *rest).n
    3
    """

    time: FloatArray
    velocity: FloatArray
    down: FloatArray
    wrench: FloatArray
    channels: FloatArray
    propulsion: FloatArray

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        widths = {"velocity": 6, "down": 3, "wrench": 6, "channels": None, "propulsion": 2}
        try:
            time = frozen(self.time, (None,), "time")
            object.__setattr__(self, "time", time)
            for name, width in widths.items():
                array = frozen(getattr(self, name), (len(time), width), name)
                object.__setattr__(self, name, array)
        except ValueError as error:
            raise ProblemError(str(error)) from error
        if not np.isfinite(time).all():
            raise ProblemError(f"`time` must be finite; it is not at sample {_first_lost(time)}")

    @property
    def n(self) -> int:
        """Return the number of samples."""
        return len(self.time)

    def part(self, part: slice | IntArray, velocity: FloatArray | None = None) -> Inputs:
        """Return some of the samples.

        Parameters
        ----------
        part : slice or ndarray of int, shape (m,)
            Which samples.
        velocity : ndarray, shape (m, 6), optional
            What takes the place of theirs [m/s, rad/s], body frame.

        Returns
        -------
        inputs : Inputs
            In the order of ``part``.

        Raises
        ------
        ProblemError
            If there is not one velocity a sample.

        Examples
        --------
        >>> inputs = Inputs(np.arange(3), *[np.zeros((3, width)) for width in (6, 3, 6, 0, 2)])
        >>> inputs.part(slice(1, 3)).time.tolist(), inputs.part(np.array([0, 2])).time.tolist()
        ([1.0, 2.0], [0.0, 2.0])
        """
        return Inputs(
            time=self.time[part],
            velocity=self.velocity[part] if velocity is None else velocity,
            down=self.down[part],
            wrench=self.wrench[part],
            channels=self.channels[part],
            propulsion=self.propulsion[part],
        )

    @property
    def n_channels(self) -> int:
        """Return the number of command channels."""
        return int(self.channels.shape[1])

    def sample(self, k: int) -> Sample:
        """Return sample ``k`` alone, as the online step takes it.

        Parameters
        ----------
        k : int
            Which sample.

        Returns
        -------
        sample : Sample
            Its time, motion, wrench, propulsion and channels.
        """
        return Sample.of(
            time=float(self.time[k]),
            velocity=self.velocity[k],
            down=self.down[k],
            wrench=self.wrench[k],
            channels=self.channels[k],
            propulsion=self.propulsion[k],
        )


@dataclass(frozen=True, eq=False, slots=True)
class Sample:
    """One sample, packed into a single array for a quick call.

    Parameters
    ----------
    values : ndarray, shape (18 + m,)
        Time [s], velocity (6), down (3), wrench (6), propulsion (2) and the m
        channels, one behind the other; see :class:`Inputs`. Made by
        :meth:`of`, taken as it is.
    """

    values: FloatArray

    @property
    def time(self) -> float:
        """Return its time [s]."""
        return float(self.values[0])

    @property
    def velocity(self) -> FloatArray:
        """Return its velocity, shape (6,) [m/s, rad/s]."""
        return self.values[1:7]

    @property
    def propulsion(self) -> FloatArray:
        """Return u_c over the step that begins here and where one ends here [m/s]."""
        return self.values[16:18]

    @classmethod
    def of(
        cls,
        *,
        time: float,
        velocity: npt.ArrayLike,
        down: npt.ArrayLike = (0.0, 0.0, 1.0),
        wrench: npt.ArrayLike = (0.0,) * 6,
        channels: npt.ArrayLike = (),
        propulsion: npt.ArrayLike = (0.0, 0.0),
    ) -> Sample:
        """Pack one sample.

        Parameters
        ----------
        time : float
            [s].
        velocity : array_like, shape (6,)
            u v w [m/s], p q r [rad/s], body frame.
        down : array_like, shape (3,), optional
            The world's down direction in the body frame; level by default.
        wrench : array_like, shape (6,), optional
            Recorded force [N] and moment [N m], body frame.
        channels : array_like, shape (m,), optional
            Command channels.
        propulsion : array_like, shape (2,), optional
            u_c [m/s] over the step that begins here, and where a step ends here.

        Returns
        -------
        sample : Sample
            The packed sample.

        Raises
        ------
        ProblemError
            If a shape is wrong.

        Examples
        --------
        >>> Sample.of(time=0.0, velocity=[1, 0, 0, 0, 0, 0]).values.shape
        (18,)
        """
        held = np.asarray(channels, dtype=np.float64)
        values = np.empty(PACKED + held.size)
        values[0] = time
        try:
            values[1:7] = velocity
            values[7:10] = down
            values[10:16] = wrench
            values[16:18] = propulsion
            values[18:] = held
        except ValueError as error:
            raise ProblemError(f"a sample does not have the shapes required: {error}") from error
        values.setflags(write=False)
        return cls(values)


def _first_lost(time: FloatArray) -> int:
    return int(np.flatnonzero(~np.isfinite(time))[0])
