"""Ask the actuation: the gain that the motion gives the known wrench of each axis."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from hydrodamp.basis.atoms import AXES
from hydrodamp.conditioning.consistency import QualityIssue
from hydrodamp.errors import ProblemError
from hydrodamp.identification.fit import identify_or_refuse
from hydrodamp.identification.har_covariance import reference_model
from hydrodamp.identification.least_squares import WeakForm
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.actuation import CHANNELS, with_gains
from hydrodamp.simulation.problem import Problem

# A gain is doubted where its whole interval is farther from one than by this factor, and narrower
# than this, or than half this share of a large gain. By so quick a method, noise that an autopilot
# feeds back moves gains: in re-enacted campaigns those of sway come out at 1.3 to 1.6 where they
# are 1, with intervals that begin at up to 1.53, and in runs of 20 s more, with wide ones.
_DOUBTED, _WIDEST = 5.0 / 3.0, 0.5


@dataclass(frozen=True)
class Gain:
    """What the wrench of the actuators on an axis is to be multiplied by, and its 95 % interval."""

    axis: str
    value: float
    low: float
    high: float

    @property
    def is_inconsistent(self) -> bool:
        """Whether the known wrench is wrong, not merely uncertain."""
        far = self.low > _DOUBTED or self.high < 1.0 / _DOUBTED
        return far and self.high - self.low < _WIDEST * max(1.0, 0.5 * self.value)


def estimate_gains(problem: Problem, models: Sequence[DampingModel]) -> tuple[Gain, ...]:
    """Return the gains that are determined beside all terms of models and of the reference."""
    free = problem.vehicle.axes
    rich = reference_model(free)
    for model in models:
        rich = rich.with_terms(dict(zip(AXES, model.restricted_to(free).terms, strict=True)))
    try:
        freed = with_gains(problem.vehicle, problem.log, rich)
    except ProblemError:
        return ()
    fit = identify_or_refuse(WeakForm(), problem.extend_to(freed), freed)
    if fit.uncertainty is None:
        return ()
    unclear = {label for group in fit.aliased for label in group}
    spans = 1.0 + fit.uncertainty.interval(fit.damping.coefficients)
    labels = {axis: f"{axis}_{name}" for axis, (name, _) in CHANNELS.items()}
    return tuple(
        Gain(axis, 1.0 + fit.damping[label], *spans[fit.model.index(label)].tolist())
        for axis, label in labels.items()
        if label in fit.model.labels and label not in unclear
    )


def check_gains(problem: Problem, models: Sequence[DampingModel]) -> Iterator[QualityIssue]:
    """Say which known wrenches the motion contradicts."""
    freed = {name for channels in CHANNELS.values() for name in channels}
    if any(name in freed for model in models for name in model.commands):
        return  # the fits identify them
    recorded = problem.log.wrench is not None
    what = "recorded wrench" if recorded else f"wrench of the actuators of '{problem.vehicle.name}'"
    wrong = [one for one in estimate_gains(problem, models) if one.is_inconsistent]
    if wrong:
        spans = ", ".join(f"{one.value:.2f} ({one.low:.2f} to {one.high:.2f})" for one in wrong)
        yield QualityIssue(
            " ".join(one.axis for one in wrong),
            "is not what acts",
            f"the motion asks for {spans} times the {what}, with 95 %, where 1 is right, and the "
            "damping takes up the difference",
            remedy="check its units and signs and the thrust of the actuators, or let the gains be "
            "identified too with `--estimate-actuator-gains`",
        )
