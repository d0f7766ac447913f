"""The plant of equation 1, its recorded inputs, and one packed sample, as arrays for the C core."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import BoolArray, FloatArray, IndexArray, IntArray, freeze
from hydrodamp.errors import ProblemError

FIXED_ATOMS = 21  # atoms that every plant has; channels and their absolute values follow
PACKED = 18  # numbers of a packed sample before its channels


@dataclass(frozen=True, eq=False)
class Plant:
    """Mass matrix, free axes and terms of the equation of motion, without its coefficients.

    The order of atoms that ``factors`` (n_terms, 4) points into, for m channels, is: 0 the
    constant 1, 1-6 u v w p q r, 7-12 their absolute values, 13 U, 14 V, 15 V_v, 16 V_w,
    17 (eta-1), 18-20 the down vector in the body frame, then m channels, then their m absolute
    values. The mass matrix is rigid body plus added mass, symmetric and
    positive definite on the ``free`` axes; the velocity of a locked one stays zero.
    """

    mass_matrix: FloatArray
    free: BoolArray
    factors: IndexArray
    n_channels: int

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        freeze(self, mass_matrix=(6, 6))
        freeze(self, dtype=np.bool_, free=(6,))
        freeze(self, ProblemError, np.int32, factors=(None, 4))

    @property
    def n_terms(self) -> int:
        """Return the number of terms, the rows of a coefficient matrix."""
        return len(self.factors)


@dataclass(frozen=True, eq=False)
class Inputs:
    """Recorded motion and actuation, arrays of one row a sample.

    Time [s] increases strictly within a segment; the wrench is on the right-hand side;
    channels are held until the next sample. The two columns of ``propulsion`` are the
    propeller's surge speed u_c [m/s]: held over the step that begins at the sample, and the value
    at the end of a step that ends there.
    """

    time: FloatArray  # (n,)
    velocity: FloatArray  # (n, 6)
    down: FloatArray  # (n, 3), the world's down direction in the body frame
    wrench: FloatArray  # (n, 6)
    channels: FloatArray  # (n, m)
    propulsion: FloatArray  # (n, 2)
    down_slope: FloatArray  # (n, 3) [1/s], of the cubic between samples of ``down``

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        freeze(self, time=(None,))
        n, m = len(self.time), None
        freeze(self, velocity=(n, 6), down=(n, 3), down_slope=(n, 3), wrench=(n, 6))
        freeze(self, channels=(n, m), propulsion=(n, 2))

    @property
    def n(self) -> int:
        """Return the number of samples."""
        return len(self.time)

    @property
    def n_channels(self) -> int:
        """Return the number of command channels."""
        return int(self.channels.shape[1])

    def select(self, index: slice | IntArray, velocity: FloatArray | None = None) -> Inputs:
        """Return some of the samples, optionally with another velocity."""
        arrays = {each.name: getattr(self, each.name)[index] for each in fields(self)}
        return Inputs(**(arrays if velocity is None else arrays | {"velocity": velocity}))

    def sample(self, k: int) -> Sample:
        """Return sample ``k``, packed for the online step."""
        names = {each.name for each in fields(self)} - {"down_slope"}
        return Sample.of(**{name: getattr(self, name)[k] for name in names})


@dataclass(frozen=True, eq=False)
class PlantSlopes:
    """Derivatives of a plant and its inputs on k parameters, the first axis of each array."""

    mass_matrix: FloatArray  # (k, 6, 6)
    known: FloatArray  # (k, n_known, 6), of the first rows of a coefficient matrix
    wrench: FloatArray  # (k, n, 6)
    channels: FloatArray  # (k, n, m)

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        k, n = self.wrench.shape[:2]
        freeze(self, mass_matrix=(k, 6, 6), known=(k, None, 6))
        freeze(self, wrench=(k, n, 6), channels=(k, n, None))

    @property
    def n(self) -> int:
        """Return the number of parameters."""
        return len(self.mass_matrix)

    def select(self, samples: IntArray) -> PlantSlopes:
        """Return the slopes at some of the samples."""
        return replace(self, wrench=self.wrench[:, samples], channels=self.channels[:, samples])


@dataclass(frozen=True, eq=False, slots=True)
class Sample:
    """One sample, packed into a single array for fast calls.

    Parameters
    ----------
    values : ndarray, shape (18 + m,)
        Time [s], velocity (6), down (3), wrench (6), propulsion (2) and the m
        channels; see :class:`Inputs`. Built by :meth:`of`; not copied or checked.
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
        """Return u_c over the step that begins here, and at the end of one that ends here [m/s]."""
        return self.values[16:PACKED]

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
        channel_values = np.asarray(channels, dtype=np.float64)
        values = np.empty(PACKED + channel_values.size)
        values[0] = time
        try:
            values[1:7] = velocity
            values[7:10] = down
            values[10:16] = wrench
            values[16:PACKED] = propulsion
            values[PACKED:] = channel_values
        except ValueError as error:
            raise ProblemError(f"a sample does not have the shapes required: {error}") from error
        values.setflags(write=False)
        return cls(values)
