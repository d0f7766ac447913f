"""What a user gets who names no method: convex starts, then the replay itself."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from hydrodamp.identification.dissipation.dissipative import Dissipative
from hydrodamp.identification.fit import Fit, Method, attempted
from hydrodamp.identification.regression.ridge import Ridge
from hydrodamp.identification.regression.weak import WeakForm
from hydrodamp.identification.replays.output_error import OutputError
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem


@dataclass(frozen=True)
class Recommended:
    """Output error from the best of several starts.

    The weak form is best where a model is small, ridge where columns are alike, and
    the dissipative solution where the others run away. A start that this log does not allow
    is left out; which of the others serves, the replay of the log decides. Output error then
    fits the replay itself; the place it returns does not run away when driven a little softer
    than the log, if there is such a place on its way.

    Parameters
    ----------
    starts : tuple of Method
        Tried in turn.
    search : OutputError
        What follows; its own start is not used.

    Examples
    --------
    >>> Recommended().key
    'recommended'
    """

    starts: tuple[Method, ...] = (WeakForm(), Ridge(), Dissipative())
    search: OutputError = field(default_factory=OutputError)

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "recommended"

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify one model.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.

        Returns
        -------
        fit : Fit
            ``STOPPED`` where the search ended before it came to rest; the remarks say
            what it started from.
        """
        starts = [attempted(start, problem, model) for start in self.starts]
        fit = self.search.refined(problem, *starts)
        provenance = {**fit.provenance, "settings": repr(self)}
        return replace(fit, method=self.key, provenance=provenance)
