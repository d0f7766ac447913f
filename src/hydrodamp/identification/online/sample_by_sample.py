"""The adaptive identifier live: one pure step a sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.speed import guarded_speed
from hydrodamp.data.attitude import down, quaternion_from_euler
from hydrodamp.errors import ProblemError, did_you_mean
from hydrodamp.identification.online.adaptation import Adaptation
from hydrodamp.kernels.inputs import Sample
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.columns import Columns, held_channels
from hydrodamp.simulation.stamp import stamp


@dataclass(frozen=True)
class State:
    """Where an online identifier stands.

    Attributes
    ----------
    adaptation : Adaptation
        Plant, model and gains.
    matrix : ndarray, shape (n_columns, 6)
        All coefficients of equation 1; in the paper K-hat, transposed.
    velocity_error : ndarray, shape (6,)
        Estimated minus measured velocity, [m/s] and [rad/s]; in the paper
        Delta v.
    last : Sample
        The sample it was made with.
    """

    adaptation: Adaptation
    matrix: FloatArray
    velocity_error: FloatArray
    last: Sample

    @property
    def damping(self) -> Damping:
        """The present estimate, with the vehicle it belongs to."""
        bound = self.adaptation
        coefficients = self.matrix[bound.entries]
        return Damping(bound.model, coefficients, vehicle=stamp(bound.columns.vehicle))

    def advanced(self, sample: Sample) -> State:
        """Return the state one sample later.

        Parameters
        ----------
        sample : Sample
            Later than the last one.

        Returns
        -------
        state : State
            A new one.

        Raises
        ------
        ProblemError
            If time does not advance.
        """
        require_later(self.last, sample)
        bound = self.adaptation
        matrix, error = kernels.adapt_step(
            bound.columns.plant,
            bound.a,
            bound.gamma,
            self.matrix,
            self.velocity_error,
            self.last,
            sample,
        )
        for array in (matrix, error):
            array.setflags(write=False)
        return State(bound, matrix, error, sample)

    def restarted(self, sample: Sample) -> State:
        """Return the state at the first sample after a gap: no error, same coefficients.

        Parameters
        ----------
        sample : Sample
            The first one after the gap.

        Returns
        -------
        state : State
            A new one.
        """
        return replace(self, velocity_error=frozen(np.zeros(6)), last=sample)


def require_later(last: Sample, sample: Sample) -> None:
    """Refuse a sample that is not later than the last one."""
    if not sample.time > last.time:
        raise ProblemError(
            f"time must advance from {last.time} s, got {sample.time} s; after a gap or "
            "a new clock use `state.restarted(sample)`."
        )


def observe(
    columns: Columns,
    *,
    time: float,
    velocity: npt.ArrayLike,
    attitude: npt.ArrayLike = (0.0, 0.0, 0.0),
    commands: Mapping[str, float] | None = None,
    wrench: npt.ArrayLike | None = None,
    propulsion_ratio: float | None = None,
    previous: Sample | None = None,
) -> Sample:
    """Turn what a vehicle reports at one instant into a sample.

    Parameters
    ----------
    columns : Columns
        Equation 1 as one table: says which commands count.
    time : float
        Clock [s].
    velocity : array_like, shape (6,)
        u v w [m/s], p q r [rad/s], body frame.
    attitude : array_like, shape (3,) or (4,)
        Roll, pitch, yaw [rad], or a unit quaternion w x y z, body to
        north-east-down; level by default.
    commands : mapping of str to float, optional
        Held until the next sample.
    wrench : array_like, shape (6,), optional
        Wrench of the actuators where it is known itself, force [N] and moment
        [N m], body frame, on the right-hand side.
    propulsion_ratio : float, optional
        Where it is known itself; else the vehicle's propeller gives it.
    previous : Sample, optional
        The sample before: its propeller speed was held until now.

    Returns
    -------
    sample : Sample
        What :meth:`AdaptiveIdentifier.step` takes.

    Raises
    ------
    ProblemError
        If a command is missing, a wrench would be counted twice, a shape is wrong,
        or a number is not finite.
    """
    recorded = {name: np.array([value]) for name, value in (commands or {}).items()}
    needed = {name for term in columns.basis for name in term.commands}
    needed |= set(columns.vehicle.commands) if columns.actuators else set()
    for name in sorted(needed - set(recorded)):
        raise ProblemError(f"command '{name}' is missing.{did_you_mean(name, recorded)}")
    if columns.actuators and wrench is not None:
        raise ProblemError(
            "a wrench would count the vehicle's actuators twice: leave it out, or make the "
            "columns from a log that has the wrench itself."
        )
    free, turned = columns.vehicle.free, np.asarray(attitude, dtype=np.float64)
    nu = np.asarray(velocity, dtype=np.float64)
    force = np.zeros(6) if wrench is None else np.asarray(wrench, dtype=np.float64)
    for name, given in (("velocity", nu), ("wrench", force)):
        if given.shape != (6,):
            raise ProblemError(f"`{name}` must have shape (6,); got {given.shape}")
    if turned.shape not in ((3,), (4,)):
        raise ProblemError(f"`attitude` must have shape (3,) or (4,); got {turned.shape}")
    quaternion = turned if len(turned) == 4 else quaternion_from_euler(turned)
    held = columns.vehicle.propulsion_speed(recorded)
    if propulsion_ratio is not None or held is None:
        ratio = 1.0 if propulsion_ratio is None else propulsion_ratio
        opening = closing = ratio * float(guarded_speed(nu * free))
    else:
        opening = float(held[0])
        closing = opening if previous is None else float(previous.propulsion[0])
    return _finite(
        Sample.of(
            time=time,
            velocity=nu * free,
            down=down(quaternion),
            wrench=force * free,
            channels=held_channels(columns, recorded, 1)[0],
            propulsion=(opening, closing),
        )
    )


def _finite(sample: Sample) -> Sample:
    """Refuse a number that would spoil every later estimate."""
    if not np.isfinite(sample.values).all():
        raise ProblemError(
            f"every number of a sample must be finite; at {sample.time} s one is not. Leave the "
            "sample out, and after a longer gap use `state.restarted(sample)`."
        )
    return sample
