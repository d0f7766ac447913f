"""A regression rich enough that what it leaves over is noise rather than misfit.

The residuals of a model that is too simple are mostly what its form cannot follow. How
noisy the rows are is therefore asked of the model's terms together with those of Gertler
and Hagen.
"""

from __future__ import annotations

from hydrodamp.basis.axes import AXES
from hydrodamp.models.catalog import catalog
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, prepare


def with_reference(problem: Problem, model: DampingModel) -> Problem:
    """Return a problem for a model, and for the model with the reference's terms.

    Parameters
    ----------
    problem : Problem
        Vehicle and log.
    model : DampingModel
        Restricted to the free axes.

    Returns
    -------
    problem : Problem
        Its first model is the one given; its second has the terms of Gertler and Hagen
        beside, without those that need the propulsion ratio.

    Examples
    --------
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> campaign, fossen = reenact(duration=10.0), catalog["fossen"]
    >>> wide = with_reference(prepare(campaign.vehicle, campaign.train, fossen), fossen)
    >>> [one.n_coefficients for one in wide.models]
    [12, 82]
    """
    reference = catalog["gertler-hagen"].restricted_to(problem.vehicle.axes)
    table = {
        axis: " ".join(str(term) for term in terms if not term.needs_propulsion)
        for axis, terms in zip(AXES, reference.terms, strict=True)
        if terms
    }
    return prepare(problem.vehicle, problem.log, (model, model.with_terms(table)))
