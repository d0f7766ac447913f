"""What became of a fit or a replay: an outcome in words, never an exception."""

from __future__ import annotations

from enum import Enum


class TextEnum(Enum):
    """Values are sentences that begin with one or two words and a colon."""

    @property
    def word(self) -> str:
        """What comes before the colon."""
        return str(self.value).split(":", 1)[0]


class Status(TextEnum):
    """An outcome; its value is the sentence to read.

    Examples
    --------
    >>> Status.DIVERGED.word
    'diverged'
    """

    OK = "ok: the data distinguish all coefficients; grades say how well each is determined."
    RANK_DEFICIENT = (
        "rank deficient: the data cannot distinguish some coefficients; their smallest-norm "
        "split is given and `aliased` names them."
    )
    EMPTY = "empty: the model has no term on the vehicle's free axes; there is nothing to identify."
    TOO_FEW_SAMPLES = (
        "too few samples: an axis has more coefficients than the log has samples; "
        "nothing was identified."
    )
    CONVERGED = (
        "settled: less than a tenth of each axis's damping wrench is still missing; single "
        "coefficients may be further away."
    )
    NOT_CONVERGED = (
        "not settled: more than a tenth of an axis's damping wrench is still missing; give a "
        "longer or richer log, or more passes."
    )
    STOPPED = (
        "stopped: the search did not come to rest; the best replay met on its way is given. Try a "
        "longer log or a smaller model."
    )
    BY_PRIOR = (
        "by prior: the data cannot distinguish some coefficients; there the prior decides and "
        "`aliased` names them."
    )
    REFUSED = (
        "refused: the method cannot identify this model from this log; nothing was identified, "
        "and what follows says why."
    )
    FAILED = "failed: the estimate is not finite; look for absurd numbers in the log."
    DIVERGED = "diverged: the open-loop replay left every bound; there is no RMS error."

    @property
    def usable(self) -> bool:
        """Whether there are numbers to use."""
        return self not in (
            Status.EMPTY,
            Status.TOO_FEW_SAMPLES,
            Status.REFUSED,
            Status.FAILED,
            Status.DIVERGED,
        )
