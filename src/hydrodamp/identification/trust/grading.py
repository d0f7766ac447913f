"""The grades of a fit: what the log has to say of its coefficients, and what the fit has."""

from __future__ import annotations

from dataclasses import replace

from hydrodamp.identification.fit import Fit
from hydrodamp.identification.trust.grades import Grade
from hydrodamp.identification.trust.identifiability import (
    AxisIdentifiability,
    Identifiability,
    identifiability,
)
from hydrodamp.simulation.problem import Problem

#: From the best to the worst.
_ORDER = tuple(Grade)


def graded(problem: Problem, fit: Fit) -> Identifiability:
    """Grade each coefficient of a fit by the log and by the fit's own interval; the worse holds.

    The noise and the manoeuvres of a log may determine a coefficient that a method, or a model
    of the wrong form, still gives with a wide interval. And an interval may be narrow where the
    log cannot tell one column from another, or hardly moved the axis.

    Parameters
    ----------
    problem : Problem
        Vehicle and log it was identified from.
    fit : Fit
        With numbers.

    Returns
    -------
    identifiability : Identifiability
        As of :func:`~hydrodamp.identification.trust.identifiability.identifiability`; by the
        log alone where the fit has no standard errors.

    Raises
    ------
    MethodError
        If the log is too short.

    Examples
    --------
    >>> from hydrodamp.identification.regression.weak import WeakForm
    >>> from hydrodamp.models.catalog import catalog
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> from hydrodamp.simulation.problem import prepare
    >>> campaign, fossen = reenact(duration=60.0), catalog["fossen"]
    >>> problem = prepare(campaign.vehicle, campaign.train, fossen)
    >>> len(graded(problem, WeakForm().identify(problem, fossen)).grades)
    12
    """
    by_log = identifiability(problem, fit.model)
    damping = fit.damping
    if damping.covariance is None:
        return by_log
    known = fit.uncertainty or damping.covariance
    by_fit = identifiability(problem, fit.model, known, damping.coefficients)
    pairs = zip(by_log.axes, by_fit.axes, strict=True)
    return replace(by_log, axes=tuple(_worse(*pair) for pair in pairs))


def _worse(one: AxisIdentifiability, other: AxisIdentifiability) -> AxisIdentifiability:
    pairs = zip(one.grades, other.grades, strict=True)
    return replace(one, grades=tuple(max(pair, key=_ORDER.index) for pair in pairs))
