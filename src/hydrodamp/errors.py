"""Exceptions, warnings, outcomes of fits and replays, and the wording of faults."""

from __future__ import annotations

import difflib
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from enum import Enum

# C0 and C1 controls, line separators, and marks that turn the direction of text.
_CONTROLS = dict.fromkeys(
    [*range(0x20), *range(0x7F, 0xA0), *range(0x2028, 0x202F), *range(0x2066, 0x206A)], " "
)


class HydrodampError(Exception):
    """Any mistake that hydrodamp can name."""


class TermError(HydrodampError, ValueError):
    """A spelling that is not a term."""


class ModelError(HydrodampError, ValueError):
    """An unknown model or label, or a wrong number of coefficients."""


class VehicleError(HydrodampError, ValueError):
    """A vehicle that is physically impossible."""


class ProblemError(HydrodampError, ValueError):
    """A vehicle, a log and terms that do not match."""


class MethodError(HydrodampError, ValueError):
    """An unknown method or a setting it cannot take."""


class FileError(HydrodampError, OSError):
    """A file or folder that cannot be read or written."""


class LogError(HydrodampError, ValueError):
    """Faults of one recorded log, collected and raised once.

    Attributes
    ----------
    faults : tuple of str
        One message per fault.
    """

    def __init__(self, faults: str | Iterable[str], *, source: str = "") -> None:
        self.faults = (faults,) if isinstance(faults, str) else tuple(faults)
        super().__init__(list_faults(source, self.faults))


class HydrodampWarning(UserWarning):
    """Something the reader of the result should know."""


class GapWarning(HydrodampWarning):
    """A log was split at a gap or at missing samples."""


class ClockWarning(HydrodampWarning):
    """A recorded clock repeats, runs backwards or jumps."""


class ForeignVehicleWarning(HydrodampWarning):
    """Damping coefficients are used with another vehicle."""


class PropulsionWarning(HydrodampWarning):
    """The propulsion ratio is unknown and assumed to be one."""


_suppressed: ContextVar[bool] = ContextVar("suppressed", default=False)


@contextmanager
def suppress_warnings() -> Iterator[None]:
    """Issue no warning by :func:`warn` inside, in this thread or task alone."""
    token = _suppressed.set(True)
    try:
        yield
    finally:
        _suppressed.reset(token)


def warn(message: str, category: type[HydrodampWarning], stacklevel: int) -> None:
    """Issue a warning as :func:`warnings.warn` does, unless it is suppressed here."""
    if not _suppressed.get():
        warnings.warn(message, category, stacklevel=stacklevel + 1)


def list_faults(source: str, faults: Sequence[str]) -> str:
    """Return one message that lists all faults of a file."""
    head = f"{source}: " if source else ""
    if len(faults) == 1:
        return head + faults[0]
    return f"{head}{len(faults)} faults" + "".join(f"\n  - {fault}" for fault in faults)


def printable(text: str) -> str:
    """Return a text with a blank for each control character, such as ESC or the end of a line."""
    return text.translate(_CONTROLS)


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a clause naming the known word nearest to ``name``."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f" Did you mean '{near[0]}'?" if near else ""


def no_such(what: str, name: str, known: Iterable[str]) -> str:
    """Return the message for an unknown name, with the nearest known name."""
    names = list(known)
    there = ", ".join(names) or "none"
    return f"there is no {what} '{name}'.{did_you_mean(name, names)} There are: {there}"


def demand(holds: bool, name: str, wanted: str, got: object) -> None:
    """Raise MethodError if a setting is invalid."""
    if not holds:
        raise MethodError(f"`{name}` must be {wanted}; got {got}")


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
        "stopped: the optimiser stopped before it converged; the best iterate is returned. Try a "
        "longer log or a smaller model."
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
