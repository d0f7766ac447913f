"""Outcomes of fits and replays as sentences."""

from __future__ import annotations

from enum import Enum


class TextEnum(Enum):
    """Enumeration whose values are sentences, each beginning with a keyword and a colon."""

    @property
    def word(self) -> str:
        """The keyword before the colon."""
        return str(self.value).split(":", 1)[0]


class Status(TextEnum):
    """An outcome; its value is the message.

    Examples
    --------
    >>> Status.DIVERGED.word
    'diverged'
    """

    OK = "ok: the regression has full rank; grades give the precision of each coefficient."
    RANK_DEFICIENT = (
        "rank deficient: some regressors are linearly dependent; the minimum-norm solution is "
        "returned and `aliased` lists these coefficients."
    )
    EMPTY = "empty: the model has no term on the vehicle's free axes; nothing was identified."
    TOO_FEW_SAMPLES = (
        "too few samples: an axis has more coefficients than the log has samples; "
        "nothing was identified."
    )
    CONVERGED = (
        "converged: on each axis the damping wrench is within 10 % of its limit; single "
        "coefficients may be further away."
    )
    NOT_CONVERGED = (
        "not converged: on an axis the damping wrench is more than 10 % from its limit; use a "
        "longer log, more excitation, or more passes."
    )
    STOPPED = (
        "stopped: the optimiser stopped before it converged; the best iterate is returned. Try "
        "more iterations, a longer log or a smaller model."
    )
    BY_PRIOR = (
        "by prior: the data do not determine some coefficients; these follow the prior and "
        "`aliased` lists them."
    )
    REFUSED = (
        "refused: the method cannot identify this model from this log, for the reason given; "
        "nothing was identified."
    )
    FAILED = "failed: the estimate is not finite; check the log for outliers."
    DIVERGED = "diverged: the open-loop replay exceeded the velocity limit; there is no RMS error."

    @property
    def usable(self) -> bool:
        """Whether the fit has coefficients."""
        return self not in (
            Status.EMPTY,
            Status.TOO_FEW_SAMPLES,
            Status.REFUSED,
            Status.FAILED,
            Status.DIVERGED,
        )
