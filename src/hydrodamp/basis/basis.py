"""A basis: an ordered set of terms, evaluated at velocities."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, IndexArray
from hydrodamp.basis.term import MAX_FACTORS, VELOCITIES, Term, atom_index, atom_key
from hydrodamp.errors import TermError, did_you_mean

#: Speed [m/s] below which the propulsion ratio is taken at this speed.
SLOWEST = 1e-6


@dataclass(frozen=True, slots=True)
class Basis:
    """An ordered set of terms; in the paper the vector of basis functions xi.

    Parameters
    ----------
    terms : tuple of Term
        Each at most once; the order is kept.

    Raises
    ------
    TermError
        If a term comes twice.

    Examples
    --------
    >>> basis = Basis.of("u", "v|r|")
    >>> len(basis), str(basis)
    (2, 'u v|r|')
    """

    terms: tuple[Term, ...]

    def __post_init__(self) -> None:
        """Refuse a term that comes twice."""
        object.__setattr__(self, "terms", tuple(self.terms))
        twice = {str(term) for term in self.terms if self.terms.count(term) > 1}
        if twice:
            raise TermError(f"`terms` must be unique; {', '.join(sorted(twice))} comes twice.")

    @classmethod
    def of(cls, *spellings: str) -> Basis:
        """Return the basis of these spellings, in the order given.

        Parameters
        ----------
        *spellings : str
            Such as ``"u"``, ``"v|r|"``.

        Returns
        -------
        basis : Basis
            Prints as it was typed, in canonical spelling.

        Raises
        ------
        TermError
            If a spelling is no term or a term comes twice.

        Examples
        --------
        >>> Basis.of("u", "|r|v").index("v|r|")
        1
        """
        return cls(tuple(Term.parse(spelling) for spelling in spellings))

    @classmethod
    def union(cls, *groups: Iterable[Term]) -> Basis:
        """Return the basis of all terms of some groups, each once, in canonical order.

        Parameters
        ----------
        *groups : iterable of Term
            Bases or any collections of terms.

        Returns
        -------
        basis : Basis
            In canonical order.

        Examples
        --------
        >>> str(Basis.union(Basis.of("r|r|"), Basis.of("v", "u")))
        'u v r|r|'
        """
        return cls(tuple(sorted({term for group in groups for term in group}, key=canonical_key)))

    @property
    def commands(self) -> tuple[str, ...]:
        """The commands the terms contain, each once, sorted by name."""
        return tuple(sorted({name for term in self.terms for name in term.commands}))

    def index(self, term: Term | str) -> int:
        """Return the place of a term.

        Parameters
        ----------
        term : Term or str
            A term or its spelling.

        Returns
        -------
        place : int
            Column of the regressor.

        Raises
        ------
        TermError
            If the basis does not hold the term.

        Examples
        --------
        >>> Basis.of("u", "v").index("v")
        1
        """
        wanted = Term.parse(term) if isinstance(term, str) else term
        if wanted not in self.terms:
            near = did_you_mean(str(wanted), map(str, self.terms))
            raise TermError(f"`{wanted}` is not in the basis.{near}")
        return self.terms.index(wanted)

    def atom_table(self, channels: tuple[str, ...] = ()) -> IndexArray:
        """Return the table of atom indices the kernels work from.

        Parameters
        ----------
        channels : tuple of str, optional
            The command channels, in the order of the kernels' array.

        Returns
        -------
        table : ndarray of int32, shape (n_terms, 4)
            Unused places hold 0, the constant one.

        Raises
        ------
        TermError
            If a term contains a command that is not among the channels.

        Examples
        --------
        >>> Basis.of("v|r|").atom_table().tolist()
        [[2, 12, 0, 0]]
        """
        table = np.zeros((len(self.terms), MAX_FACTORS), dtype=np.int32)
        for row, term in enumerate(self.terms):
            for column, factor in enumerate(term.factors):
                table[row, column] = atom_index(factor, channels)
        table.setflags(write=False)
        return table

    def evaluate(
        self,
        velocity: npt.ArrayLike,
        *,
        down: npt.ArrayLike | None = None,
        commands: Mapping[str, npt.ArrayLike] | None = None,
        propulsion_ratio: npt.ArrayLike = 1.0,
    ) -> FloatArray:
        """Return the regressor: every term at every sample.

        Parameters
        ----------
        velocity : array_like, shape (n, 6) or (6,)
            Body velocity u v w [m/s] p q r [rad/s].
        down : array_like, shape (n, 3) or (3,), optional
            Unit vector that points down, in the body frame; level by default.
        commands : mapping of str to array_like, shape (n,) or scalar, optional
            The command channels by name.
        propulsion_ratio : array_like, shape (n,) or scalar, optional
            In the paper eta bar = u_c / U; one by default.

        Returns
        -------
        regressor : ndarray, shape (n, n_terms) or (n_terms,)
            One column a term. In the paper xi.

        Raises
        ------
        TermError
            If a command is missing or an array does not have the length of ``velocity``.

        Examples
        --------
        >>> Basis.of("u|u|", "u^2").evaluate([-2.0, 0, 0, 0, 0, 0]).tolist()
        [-4.0, 4.0]
        """
        from hydrodamp.kernels.core import regressor

        nu = np.ascontiguousarray(np.atleast_2d(np.asarray(velocity, dtype=np.float64)))
        if nu.ndim != 2 or nu.shape[1] != 6:
            raise TermError(
                f"`velocity` must have shape (n, 6) or (6,); got {np.shape(velocity)}. "
                "Rows are samples: did you pass it transposed?"
            )
        n = len(nu)
        command_values = commands or {}
        channels = self.commands
        missing = [name for name in channels if name not in command_values]
        if missing:
            raise TermError(
                f"`commands` must hold {', '.join(missing)}, which the terms contain; "
                f"got {', '.join(command_values) or 'none'}."
            )
        columns = [_spread(command_values[name], (n,), f"commands[{name!r}]") for name in channels]
        ratio = _spread(propulsion_ratio, (n,), "propulsion_ratio")
        values = regressor(
            self.atom_table(channels),
            nu,
            _spread((0.0, 0.0, 1.0) if down is None else down, (n, 3), "down"),
            np.column_stack([*columns, np.empty((n, 0))]),
            ratio * guarded_speed(nu),
        )
        return np.asarray(values if np.ndim(velocity) == 2 else values[0], dtype=np.float64)

    def __len__(self) -> int:
        """Return the number of terms."""
        return len(self.terms)

    def __iter__(self) -> Iterator[Term]:
        """Iterate over the terms in order."""
        return iter(self.terms)

    def __contains__(self, term: object) -> bool:
        """Whether the basis contains a term, given as a term or as its spelling."""
        return (Term.parse(term) if isinstance(term, str) else term) in self.terms

    def __str__(self) -> str:
        """Return the spellings, separated by blanks."""
        return " ".join(map(str, self.terms))


_GRID = " ".join(f"{first}|{second}|" for first in VELOCITIES for second in VELOCITIES)
_PAPER_SPELLINGS = f"""
u v w p q r u^2 v^2 w^2 p^2 q^2 r^2 |u| |v| |w| |p| |q| |r| {_GRID}
uv uw up uq ur vp vq vr vw wp wq wr pq pr qr vV wV qV rV |w|V |r|V_v |q|V_w
u^2(eta-1) v^2(eta-1) w^2(eta-1) uv(eta-1) uw(eta-1) uq(eta-1) ur(eta-1) vV(eta-1) wV(eta-1)
"""

#: The 85 terms of the paper's eight models together, in canonical order.
UNION = Basis.of(*_PAPER_SPELLINGS.split())

_UNION_INDEX = {term: index for index, term in enumerate(UNION.terms)}


def canonical_key(term: Term) -> tuple[object, ...]:
    """Return what terms are sorted by."""
    index = _UNION_INDEX.get(term, len(_UNION_INDEX))
    return index, len(term.factors), tuple(atom_key(factor) for factor in term.factors)


def _spread(values: npt.ArrayLike, shape: tuple[int, ...], name: str) -> FloatArray:
    """Return one value, or one a sample, for every sample."""
    array = np.asarray(values, dtype=np.float64)
    try:
        return np.broadcast_to(array, shape)
    except ValueError as error:
        raise TermError(
            f"`{name}` must have shape {shape} or {shape[1:]}; got {array.shape}."
        ) from error


def guarded_speed(velocity: npt.ArrayLike) -> FloatArray:
    """Return U, or ``SLOWEST`` where the vehicle is slower: the propulsion ratio divides by it."""
    speed = np.linalg.norm(np.asarray(velocity, dtype=np.float64)[..., :3], axis=-1)
    return np.asarray(np.maximum(speed, SLOWEST))
