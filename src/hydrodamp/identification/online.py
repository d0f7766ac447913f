"""Common functions of the online estimators: samples, initial coefficients, scales from a log."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.basis import guarded_speed
from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.data.attitude import down_vectors, quaternion_from_euler
from hydrodamp.errors import MethodError, ProblemError, did_you_mean
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, Problem, held_channels


def observe(
    equations: EquationTable,
    *,
    time: float,
    velocity: npt.ArrayLike,
    attitude: npt.ArrayLike = (0.0, 0.0, 0.0),
    commands: Mapping[str, float] | None = None,
    wrench: npt.ArrayLike | None = None,
    propulsion_ratio: float | None = None,
    previous: Sample | None = None,
) -> Sample:
    """Build a sample from the measurements at one instant.

    Parameters
    ----------
    equations : EquationTable
        Equation 1; gives the required commands.
    time : float
        Clock [s].
    velocity : array_like, shape (6,)
        u v w [m/s], p q r [rad/s], body frame.
    attitude : array_like, shape (3,) or (4,)
        Roll, pitch, yaw [rad], or a unit quaternion w x y z, body to
        north-east-down; level by default.
    commands : mapping of str to float, optional
        Commands, held until the next sample.
    wrench : array_like, shape (6,), optional
        Recorded wrench of the actuators, force [N] and moment
        [N m], body frame, on the right-hand side.
    propulsion_ratio : float, optional
        Recorded ratio; by default from the speed of the propeller.
    previous : Sample, optional
        The sample before, whose propeller speed was held until now.

    Returns
    -------
    sample : Sample
        Argument of :meth:`AdaptiveIdentifier.step`.

    Raises
    ------
    ProblemError
        If a command is missing, both wrench and actuators are given, a shape is wrong,
        or a number is not finite.
    """
    vehicle, free = equations.vehicle, equations.vehicle.free
    recorded = {name: np.array([value]) for name, value in (commands or {}).items()}
    for name in equations.required_commands:
        if name not in recorded:
            raise ProblemError(f"command '{name}' is missing.{did_you_mean(name, recorded)}")
    if equations.actuators and wrench is not None:
        raise ProblemError(
            "`wrench` would count the vehicle's actuators twice: omit it, or build the equation "
            "table from a log with a recorded wrench."
        )
    orientation = np.asarray(attitude, dtype=np.float64)
    nu = frozen(velocity, (6,), "velocity", ProblemError)
    force = frozen(np.zeros(6) if wrench is None else wrench, (6,), "wrench", ProblemError)
    if orientation.shape not in ((3,), (4,)):
        raise ProblemError(f"`attitude` must have shape (3,) or (4,); got {orientation.shape}")
    speed = vehicle.propulsion_speed(recorded)
    if propulsion_ratio is not None or speed is None:
        ratio = 1.0 if propulsion_ratio is None else propulsion_ratio
        opening = closing = ratio * float(guarded_speed(nu * free))
    else:
        opening = float(speed[0])
        closing = opening if previous is None else float(previous.propulsion[0])
    sample = Sample.of(
        time=time,
        velocity=nu * free,
        down=down_vectors(
            orientation if len(orientation) == 4 else quaternion_from_euler(orientation)
        ),
        wrench=force * free,
        channels=held_channels(equations, recorded, 1)[0],
        propulsion=(opening, closing),
    )
    if not np.isfinite(sample.values).all():
        raise ProblemError(
            f"every number of a sample must be finite; at {sample.time} s one is not. Omit the "
            "sample, and after a longer gap use `state.restart(sample)`."
        )
    return sample


def initial_coefficients(model: DampingModel, known: Damping | None = None) -> FloatArray:
    """Return known coefficients, else those of the paper: −1 on the linear diagonal, else 0."""
    if known is not None:
        return known.onto(model)
    return np.array(
        [
            -1.0 if str(term) == VELOCITY_OF[AXES[axis]] else 0.0
            for axis, terms in enumerate(model.terms)
            for term in terms
        ]
    )


def require_problem(source: Problem | EquationTable, quantity: str) -> Problem:
    """Return a source that is a problem; raise for settings that need a log."""
    if isinstance(source, Problem):
        return source
    raise MethodError(
        f"these settings take the {quantity} from a log: bind the method to a problem prepared "
        "from an earlier log."
    )
