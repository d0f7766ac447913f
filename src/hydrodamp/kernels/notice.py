"""The one warning that the compiled core is missing, given when a kernel is first used."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from hydrodamp.errors import FallbackWarning

P = ParamSpec("P")
R = TypeVar("R")

MESSAGE = (
    "hydrodamp runs without its compiled core, some hundred times slower: no C compiler was "
    "at hand when it was installed. Install a C and C++ compiler, then reinstall hydrodamp."
)


class Notice:
    """A warning that is given once.

    Attributes
    ----------
    given : bool
        Whether it was given already.

    Examples
    --------
    >>> Notice().given
    False
    """

    def __init__(self) -> None:
        self.given = False

    def give(self) -> None:
        """Warn, the first time only."""
        if not self.given:
            self.given = True
            warnings.warn(MESSAGE, FallbackWarning, stacklevel=3)

    def before(self, function: Callable[P, R]) -> Callable[P, R]:
        """Return ``function`` so that its first call gives the warning.

        Parameters
        ----------
        function : callable
            A kernel of the NumPy reference.

        Returns
        -------
        function : callable
            The same kernel with the warning in front.
        """

        @functools.wraps(function)
        def noticed(*args: P.args, **kwargs: P.kwargs) -> R:
            self.give()
            return function(*args, **kwargs)

        return noticed
