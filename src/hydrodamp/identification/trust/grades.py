"""How well the data determine a coefficient, in one word, and by which rule."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray


class Grade(Enum):
    """How well a coefficient is determined; the value says what to do with it.

    Examples
    --------
    >>> Grade.NOT_DETERMINED.word
    'not determined'
    """

    DETERMINED = "determined: the number can be used."
    WEAK = "weak: sign and order of magnitude at best; use it with the whole model only."
    NOT_DETERMINED = "not determined: the data do not tell; take it from elsewhere or leave it out."

    @property
    def word(self) -> str:
        """The grade in one or two words."""
        return self.value.split(":", 1)[0]


#: A 95 % interval of at most this share of the coefficient to either side determines it: the least
#: accuracy at which damping coefficients are worth comparing with others.
RELATIVE = 0.25

#: So does an interval that is worth at most this share of the axis' response: a coefficient near
#: zero is determined when what it could contribute is too small to matter.
CONTRIBUTION = 0.05

#: An interval that is worth more than this share of the response to either side tells nothing: with
#: 95 % confidence, anything up to all of the response could be the term's.
UNKNOWN = 0.5

#: Least share of the leverage of a coefficient that must come from excited motion: below it, more
#: than half of what distinguishes its column from the others may be noise, which biases a
#: coefficient towards zero by that share (Fuller, "Measurement Error Models", 1987,
#: doi:10.1002/9780470316665, section 1.1).
SOUND = 0.5


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is known of the coefficients of one axis, one entry a coefficient."""

    coefficient: FloatArray
    half: FloatArray
    size: FloatArray
    sound: FloatArray
    aliased: BoolArray
    response: float
    excited: bool

    def grades(self) -> tuple[Grade, ...]:
        """Return the grade of each coefficient."""
        worth = self.half * self.size
        close = (self.half <= RELATIVE * np.abs(self.coefficient)) | (
            worth <= CONTRIBUTION * self.response
        )
        blind = self.aliased | (self.size == 0.0) | ~np.isfinite(self.half)
        blind |= (self.sound < SOUND) | (not self.excited)
        blind |= ~close & (worth > UNKNOWN * self.response)
        words = np.where(blind, 2, np.where(close, 0, 1))
        return tuple(tuple(Grade)[place] for place in words.tolist())
