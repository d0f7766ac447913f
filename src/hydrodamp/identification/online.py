"""What identifiers share that take one sample after the other: samples, start, bound to a log."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.atoms import AXES, VELOCITY_OF
from hydrodamp.basis.basis import guarded_speed
from hydrodamp.data.attitude import down_vectors, quaternion_from_euler
from hydrodamp.errors import MethodError, ProblemError, did_you_mean
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, Problem, held_channels


def observe(
    columns: EquationTable,
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
    vehicle, free = columns.vehicle, columns.vehicle.free
    recorded = {name: np.array([value]) for name, value in (commands or {}).items()}
    for name in columns.required_commands:
        if name not in recorded:
            raise ProblemError(f"command '{name}' is missing.{did_you_mean(name, recorded)}")
    if columns.actuators and wrench is not None:
        raise ProblemError(
            "a wrench would count the vehicle's actuators twice: leave it out, or make the "
            "columns from a log that has the wrench itself."
        )
    turned = np.asarray(attitude, dtype=np.float64)
    moving = frozen(velocity, (6,), "velocity", ProblemError)
    force = frozen(np.zeros(6) if wrench is None else wrench, (6,), "wrench", ProblemError)
    if turned.shape not in ((3,), (4,)):
        raise ProblemError(f"`attitude` must have shape (3,) or (4,); got {turned.shape}")
    held = vehicle.propulsion_speed(recorded)
    if propulsion_ratio is not None or held is None:
        ratio = 1.0 if propulsion_ratio is None else propulsion_ratio
        opening = closing = ratio * float(guarded_speed(moving * free))
    else:
        opening = float(held[0])
        closing = opening if previous is None else float(previous.propulsion[0])
    sample = Sample.of(
        time=time,
        velocity=moving * free,
        down=down_vectors(turned if len(turned) == 4 else quaternion_from_euler(turned)),
        wrench=force * free,
        channels=held_channels(columns, recorded, 1)[0],
        propulsion=(opening, closing),
    )
    if not np.isfinite(sample.values).all():
        raise ProblemError(
            f"every number of a sample must be finite; at {sample.time} s one is not. Leave the "
            "sample out, and after a longer gap use `state.restart(sample)`."
        )
    return sample


def initial_coefficients(model: DampingModel, known: Damping | None = None) -> FloatArray:
    """Return the paper's start: −1 on the diagonal linear terms, 0 elsewhere."""
    if known is not None:
        return known.onto(model)
    return np.array(
        [
            -1.0 if str(term) == VELOCITY_OF[AXES[axis]] else 0.0
            for axis, terms in enumerate(model.terms)
            for term in terms
        ]
    )


def require_problem(source: Problem | EquationTable, what: str) -> Problem:
    """Return the problem that settings by data need."""
    if isinstance(source, Problem):
        return source
    raise MethodError(
        f"these settings take the {what} from a log: bind the method to a problem prepared "
        "from one, such as last week's dive."
    )
