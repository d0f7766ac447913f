"""The plan of the next dive, from what is known and what it may do."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError, demand, no_such
from hydrodamp.identification.grades import Grade
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.planning.design import Criterion, Designer
from hydrodamp.planning.dive import DivePlan, Prediction, Reach, Rehearsal, Stretch, rehearsed
from hydrodamp.planning.envelope import Envelope
from hydrodamp.planning.prospect import Prospect, Sortie
from hydrodamp.planning.reaching import reached
from hydrodamp.planning.sailing import Voyage
from hydrodamp.progress import progress
from hydrodamp.vehicle.vehicle import Vehicle

#: Waters that a dive is searched in, and rehearsed in.
_SEARCHED, REHEARSED = 3, slice(4)

#: Dives of more stretches than this sail each manoeuvre twice.
_ONCE = 6

#: Least dive [s].
_LEAST = 60.0

_NO_BETTER = (
    "No manoeuvres were found that tell more than a campaign of steps, which is what is planned: "
    "more of what fits leave over is the form of the model than noise. Try a model with more terms."
)

CRITERIA = get_args(Criterion)
"""What a dive may make small."""

GOALS = tuple(grade.word for grade in list(Grade)[:3])
"""Grades that a dive may be planned for."""


def plan(
    vehicle: Vehicle,
    model: DampingModel,
    duration: float,
    *,
    damping: Damping | None = None,
    envelope: Envelope | None = None,
    goal: str | None = None,
    criterion: Criterion = "determinant",
    seed: int = 0,
) -> DivePlan:
    """Plan the dive that tells most of a model's coefficients.

    Parameters
    ----------
    vehicle : Vehicle
        With actuators, or a model and ``damping`` that have gains of commands.
    model : DampingModel
        What is to be identified.
    duration : float
        Length of the dive, 60 or more [s]; with a goal the longest that may be.
    damping : Damping, optional
        What is known, best with its covariance, such as an earlier fit. By default a published set
        of the vehicle, else what the size of its hull tells.
    envelope : Envelope, optional
        What the dive may do.
    goal : {"determined", "minor", "weak"}, optional
        Plan the shortest dive that brings every coefficient to this grade, if it can.
    criterion : {"determinant", "worst", "replay"}
        What is made small: the volume of the coefficients' errors, the worst of them against what
        their grade allows, or the expected error of a replay (eq. 24).
    seed : int, optional
        Of draws and noise.

    Returns
    -------
    plan : DivePlan
        The same for the same arguments.

    Raises
    ------
    ModelError
        If nothing in the envelope excites a term, or ``damping`` is of another mass matrix.
    ProblemError
        If nothing can be steered, or no dive keeps to the envelope.
    MethodError
        If an argument is out of range.

    Examples
    --------
    >>> import hydrodamp as hd
    >>> hd.plan(hd.fleet["vt690"], hd.catalog["fossen"], 10.0)
    Traceback (most recent call last):
        ...
    hydrodamp.errors.MethodError: `duration` must be 60 s or more; got 10.0
    """
    demand(_LEAST <= duration < np.inf, "duration", "60 s or more", duration)
    demand(seed >= 0, "seed", "0 or more", seed)
    if goal is not None and goal not in GOALS:
        raise MethodError(no_such("goal", goal, GOALS))
    demand(criterion in CRITERIA, "criterion", " or ".join(CRITERIA), criterion)
    prospect = Prospect.of(vehicle, model, duration, damping, envelope or Envelope(), seed)
    by_steps = prospect.kept(prospect.steps)
    steps = rehearsed(prospect.fleet, by_steps.voyage.part(REHEARSED), grading=False)
    sortie = searched(prospect, "worst" if goal else criterion, steps, by_steps)
    rehearsal = rehearsed(prospect.fleet, sortie.voyage.part(REHEARSED))
    notes: tuple[str, ...] = ()
    if np.mean(np.log(rehearsal.error)) > np.mean(np.log(steps.error)):
        sortie, notes = by_steps, (_NO_BETTER,)
        rehearsal = rehearsed(prospect.fleet, sortie.voyage.part(REHEARSED))
    some, reach = sortie.voyage.part(REHEARSED), None
    if goal is not None:
        n = len(sortie.manoeuvres)
        reach, n, rehearsal = reached(prospect, goal, n, some, rehearsal)
        sortie = sortie.until(n, prospect.samples)
    return replace(_told(prospect, sortie, rehearsal, steps, reach), notes=notes)


def searched(
    prospect: Prospect, criterion: Criterion, steps: Rehearsal, by_steps: Sortie
) -> Sortie:
    """Search manoeuvres; what is sailed twice is sailed to the other side the second time."""
    times = 2 if prospect.stretches > _ONCE else 1
    n = -(-prospect.stretches // times)
    few = prospect.fleet.in_waters([*range(_SEARCHED)])
    aim = prospect.aim(criterion, prospect.wider(steps, by_steps.voyage))
    with progress("searching manoeuvres", n) as step:
        found = Designer(few, prospect.seen, aim, prospect.samples).dive(n, prospect.seed, step)
    both = found + [one.mirrored for one in found] * (times - 1)
    return prospect.kept(both[: prospect.stretches])


def _told(
    prospect: Prospect, sortie: Sortie, rehearsal: Rehearsal, steps: Rehearsal, reach: Reach | None
) -> DivePlan:
    """Return the plan of what was found."""
    fleet, length = prospect.fleet, prospect.stretch
    pairs = zip(sortie.manoeuvres, sortie.courses.tolist(), strict=True)
    depths = np.quantile(sortie.voyage.states[:, :, 11], [0.05, 0.95], axis=1).T
    return DivePlan(
        vehicle=fleet.vehicle,
        model=prospect.model,
        envelope=fleet.envelope,
        known=prospect.known.source or "the damping given",
        time=np.asarray(fleet.envelope.period * np.arange(len(sortie.overlays)), dtype=np.float64),
        orders=_orders(prospect, sortie),
        stretches=tuple(
            Stretch(n * length, (n + 1) * length, course, one)
            for n, (one, course) in enumerate(pairs)
        ),
        track=sortie.voyage.part([0]).log(fleet.vehicle, fleet.helm.names),
        depths=depths,
        within=sortie.within,
        draws=len(fleet.matrices),
        predictions=_predictions(prospect, sortie.voyage, rehearsal, steps),
        reach=reach,
    )


def _orders(prospect: Prospect, sortie: Sortie) -> dict[str, FloatArray]:
    """Return what to tell by name: setpoints that a loop follows, the propeller, overlays."""
    wheel, told, orders = prospect.fleet.helm, sortie.voyage.told[:, 0], {}
    if wheel.propeller is not None:
        orders["speed"] = told[:, 0]
        driving = np.clip(wheel.driving(told[:, 0]), *wheel.band(wheel.propeller))
        orders[wheel.names[wheel.propeller]] = driving
    if wheel.heading is not None:
        orders["heading"] = np.angle(np.exp(1j * told[:, 1]))
    if wheel.depth is not None:
        orders["depth"] = told[:, 2]
    added = {f"{wheel.names[place]}_overlay": sortie.overlays[:, place] for place in wheel.overlays}
    return orders | added


def _predictions(
    prospect: Prospect, voyage: Voyage, rehearsal: Rehearsal, steps: Rehearsal
) -> tuple[Prediction, ...]:
    """Return what the dive will say of each coefficient."""
    labels, before = prospect.model.labels, prospect.before
    errors, bound, by_steps = rehearsal.error, prospect.bound(voyage), steps.error
    together = (errors**-2.0 + before**-2.0) ** -0.5
    values = prospect.expected(rehearsal)
    grades, causes = rehearsal.grades(labels), rehearsal.causes(labels)
    return tuple(
        Prediction(
            label=label,
            value=float(values[place]),
            before=float(before[place]) if np.isfinite(before[place]) else None,
            bound=float(bound[place]),
            after=float(errors[place]),
            together=float(together[place]),
            steps=float(by_steps[place]),
            grade=grades[place],
            cause=causes[place] if grades[place] is Grade.NOT_DETERMINED else None,
        )
        for place, label in enumerate(labels)
    )
