"""A damping model: terms per axis as a table, without numbers, and their coefficients' names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from textwrap import TextWrapper

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import BoolArray, FloatArray, frozen
from hydrodamp.basis.basis import Basis, canonical_key
from hydrodamp.basis.term import AXES, SPEEDS, VELOCITY_OF, Term
from hydrodamp.errors import ModelError, TermError, did_you_mean

_UNITS = {**dict.fromkeys((*"uvw", *SPEEDS), "(m/s)"), **dict.fromkeys("pqr", "(rad/s)")}


def spell_label(axis: str, term: Term) -> str:
    """Return the name of a coefficient."""
    return f"{axis}_{term}"


def read_label(label: str) -> tuple[str, Term]:
    """Return the axis and the term of a coefficient's name."""
    axis, underscore, spelling = label.partition("_")
    if axis not in AXES or not underscore:
        raise ModelError(
            f"`{label}` is not a coefficient: it must be an axis of {' '.join(AXES)}, an "
            "underscore and a term, such as 'Y_v|v|'."
        )
    try:
        return axis, Term.parse(spelling)
    except TermError as error:
        raise ModelError(f"`{label}` is not a coefficient: {error}") from error


def table_of(labels: Iterable[str]) -> dict[str, list[Term]]:
    """Return the terms of coefficients by their axes."""
    rows: dict[str, list[Term]] = {}
    for axis, term in map(read_label, labels):
        rows.setdefault(axis, []).append(term)
    return rows


def coefficient_unit(axis: str, term: Term) -> str:
    """Return the unit of a coefficient."""
    wrench = "N" if axis in "XYZ" else "N m"
    units = _UNITS | {name: f"[{name}]" for name in term.commands}
    powers = Counter(units[name] for each in term.factors if (name := each.strip("|")) in units)
    factors = [unit if power == 1 else f"{unit}^{power}" for unit, power in powers.items()]
    if not factors:
        return wrench
    return f"{wrench}/{factors[0]}" if len(factors) == 1 else f"{wrench}/({' '.join(factors)})"


#: Axes, separated by blanks, to terms: one text separated by blanks, or a list.
Table = Mapping[str, str | Iterable[str | Term]]
Rows = tuple[tuple[Term, ...], ...]

_KEY = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]*")


@dataclass(frozen=True)
class DampingModel:
    """Structure of a damping wrench: which terms act on which axis.

    The order of its coefficients is owned here: axis by axis from X to N, in
    each axis the terms in canonical order. Use :meth:`from_table` to make one.

    Parameters
    ----------
    key : str
        The name it is asked for by: letters, digits and ``._+-``.
    title : str
        The name it is printed with.
    terms : tuple of 6 tuples of Term
        The terms of X Y Z K M N; put into canonical order, each once. An axis may be empty.
    source : str, optional
        Where the model comes from.
    note : str, optional
        What a reader should know about it.

    Raises
    ------
    ModelError
        If the key is not usable or there are not six axes.

    Examples
    --------
    >>> model = DampingModel.from_table({"X": "u u|u|", "Y N": "v r"}, key="mine")
    >>> model.labels
    ('X_u', 'X_u|u|', 'Y_v', 'Y_r', 'N_v', 'N_r')
    """

    key: str
    title: str
    terms: tuple[tuple[Term, ...], ...]
    source: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        """Check the key and bring every axis into canonical order."""
        if not _KEY.fullmatch(self.key):
            raise ModelError(
                f"`key` must be letters, digits and ._+- and start with a letter or digit; "
                f"got '{self.key}'."
            )
        if len(self.terms) != len(AXES):
            raise ModelError(
                f"`terms` must have one entry for each of {' '.join(AXES)}; got {len(self.terms)}."
            )
        ordered = tuple(tuple(sorted(set(row), key=canonical_key)) for row in self.terms)
        object.__setattr__(self, "terms", ordered)

    @classmethod
    def from_table(
        cls, table: Table, *, key: str, title: str = "", source: str = "", note: str = ""
    ) -> DampingModel:
        """Return the model of a table.

        Parameters
        ----------
        table : mapping
            Keys are axes separated by blanks, values the terms of these axes:
            ``{"X": "u u|u|", "Y N": "v r"}``. An axis may come in several keys.
        key : str
            The name it is asked for by.
        title : str, optional
            The name it is printed with; the key by default.
        source, note : str, optional
            Where it comes from, what to know about it.

        Returns
        -------
        model : DampingModel
            In canonical order.

        Raises
        ------
        ModelError
            Naming every axis and term that cannot be, at once.

        Examples
        --------
        >>> DampingModel.from_table({"Y N": "u|u|*rudder"}, key="fin").labels
        ('Y_u|u|*rudder', 'N_u|u|*rudder')
        """
        return cls(key, title or key, read_table(table, f"Model '{key}'"), source, note)

    @cached_property
    def basis(self) -> Basis:
        """Every term of the model once, in canonical order."""
        return Basis.union(*self.terms)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Names of the coefficients, ``Y_v|v|``: axis by axis, then in canonical order."""
        return tuple(
            spell_label(axis, term)
            for axis, row in zip(AXES, self.terms, strict=True)
            for term in row
        )

    @property
    def units(self) -> tuple[str, ...]:
        """The unit of each coefficient."""
        return tuple(coefficient_unit(*read_label(label)) for label in self.labels)

    @property
    def n_coefficients(self) -> int:
        """The number of coefficients; in the paper n bar, the complexity of the model."""
        return sum(map(len, self.terms))

    @property
    def commands(self) -> tuple[str, ...]:
        """The commands its terms contain, each once, sorted by name."""
        return self.basis.commands

    @cached_property
    def mask(self) -> BoolArray:
        """Which entries of the coefficient matrix the model has, shape (6, n_terms)."""
        rows = [set(row) for row in self.terms]
        mask = np.array([[term in row for term in self.basis] for row in rows], dtype=np.bool_)
        mask.setflags(write=False)
        return mask

    def pack(self, matrix: npt.ArrayLike) -> FloatArray:
        """Return the coefficients that a matrix holds, in the order of :attr:`labels`.

        Parameters
        ----------
        matrix : array_like, shape (6, n_terms)
            Columns in the order of :attr:`basis`. In the paper K.

        Returns
        -------
        coefficients : ndarray, shape (n_coefficients,)
            In the paper kappa = M_m vec(K^T).

        Raises
        ------
        ModelError
            If the shape is wrong.
        """
        values = np.asarray(matrix, dtype=np.float64)
        if values.shape != self.mask.shape:
            raise ModelError(f"`matrix` must have shape {self.mask.shape}; got {values.shape}.")
        return frozen(values[self.mask])

    def unpack(self, coefficients: npt.ArrayLike) -> FloatArray:
        """Return the matrix that holds the coefficients, zero elsewhere.

        Parameters
        ----------
        coefficients : array_like, shape (n_coefficients,)
            In the order of :attr:`labels`.

        Returns
        -------
        matrix : ndarray, shape (6, n_terms)
            Columns in the order of :attr:`basis`. In the paper K of equation 14.

        Raises
        ------
        ModelError
            If the number of coefficients is wrong.

        Examples
        --------
        >>> DampingModel.from_table({"X": "u"}, key="mine").unpack([-2.0])[0]
        array([-2.])
        """
        values = np.asarray(coefficients, dtype=np.float64)
        if values.shape != (self.n_coefficients,):
            raise ModelError(
                f"`coefficients` must have shape ({self.n_coefficients},) for model "
                f"'{self.key}'; got {values.shape}."
            )
        matrix = np.zeros(self.mask.shape)
        matrix[self.mask] = values
        return frozen(matrix)

    def index(self, label: str) -> int:
        """Return the place of a coefficient in :attr:`labels`.

        Parameters
        ----------
        label : str
            Axis, underscore, term; any spelling of the term.

        Returns
        -------
        place : int
            Its place in the coefficients.

        Raises
        ------
        ModelError
            If the model has no such coefficient, with the nearest that it has.

        Examples
        --------
        >>> DampingModel.from_table({"X": "u u|u|"}, key="mine").index("X_u|u|")
        1
        """
        known = {name: index for index, name in enumerate(self.labels)}
        name = label if label in known else spell_label(*read_label(label))
        if name not in known:
            near = did_you_mean(name, self.labels)
            raise ModelError(f"Model '{self.key}' has no coefficient `{name}`.{near}")
        return known[name]

    def check_labels(self, given: Collection[str]) -> None:
        """Refuse values whose labels are not those of the model."""
        unknown = [label for label in given if label not in self.labels]
        missing = [label for label in self.labels if label not in given]
        if unknown:
            near = did_you_mean(unknown[0], self.labels)
            raise ModelError(f"Model '{self.key}' has no coefficient {', '.join(unknown)}.{near}")
        if missing:
            raise ModelError(f"Model '{self.key}' also needs {', '.join(missing)}.")

    def with_terms(self, table: Table, key: str | None = None) -> DampingModel:
        """Return the model with further terms; terms it has already stay single.

        Parameters
        ----------
        table : mapping
            As in :meth:`from_table`, such as ``{"Y N": "u|u|*rudder"}``.
        key : str, optional
            Key of the new model; by default the old one and ``-extended``.

        Returns
        -------
        model : DampingModel
            Source kept; note and title say what was added.

        Raises
        ------
        ModelError
            Naming every axis and term that cannot be, at once.

        Examples
        --------
        >>> DampingModel.from_table({"X": "u"}, key="mine").with_terms({"X": "1"}).labels
        ('X_u', 'X_1')
        """
        more = read_table(table, f"Terms added to model '{self.key}'")
        rows = tuple((*old, *new) for old, new in zip(self.terms, more, strict=True))
        return replace(
            self,
            key=key or f"{self.key}-extended",
            title=f"{self.title} + {Basis.union(*more)}",
            terms=rows,
        )

    def restricted_to(self, axes: Iterable[str]) -> DampingModel:
        """Return the model for a vehicle with fewer degrees of freedom.

        Parameters
        ----------
        axes : iterable of str
            The free axes, of X Y Z K M N.

        Returns
        -------
        model : DampingModel
            Without the rows of locked axes and without the terms that are zero
            while the locked velocities are zero. Key and title stay.

        Raises
        ------
        ModelError
            If an axis is unknown.

        Examples
        --------
        >>> model = DampingModel.from_table({"X Y Z": "u vV wV"}, key="mine")
        >>> model.restricted_to("XY").labels
        ('X_u', 'X_vV', 'Y_u', 'Y_vV')
        """
        free = set(axes)
        unknown = sorted(free - set(AXES))
        if unknown:
            raise ModelError(f"`axes` must be of {' '.join(AXES)}; got {' '.join(unknown)}.")
        locked = {VELOCITY_OF[axis] for axis in AXES if axis not in free}
        rows = tuple(
            tuple(term for term in row if axis in free and not term.vanishes_without(locked))
            for axis, row in zip(AXES, self.terms, strict=True)
        )
        return replace(self, terms=rows)

    def __str__(self) -> str:
        """Return the model in one screen."""
        head = f"{self.title} ({self.key}): {self.n_coefficients} coefficients"
        rows = [
            f"{' '.join(axes)}: {' '.join(map(str, row)) or 'no terms'}"
            for row, axes in group_axes(self).items()
        ]
        return one_screen(head, *rows, source=self.source, note=self.note)


def group_axes(model: DampingModel) -> dict[tuple[Term, ...], list[str]]:
    """Return the axes that share the same terms, in order; the terms are the key."""
    groups: dict[tuple[Term, ...], list[str]] = {}
    for axis, row in zip(AXES, model.terms, strict=True):
        groups.setdefault(row, []).append(axis)
    return groups


_WRAPPER = TextWrapper(88, "  ", " " * 6, break_long_words=False, break_on_hyphens=False)


def one_screen(head: str, *lines: str, **remarks: str) -> str:
    """Return a head with lines and non-empty remarks below it, wrapped and indented."""
    below = [*lines, *(f"{name}: {text}" for name, text in remarks.items() if text)]
    return "\n".join([head, *map(_WRAPPER.fill, below)])


def read_table(table: Table, what: str) -> Rows:
    """Return the six rows of a table; all faults are reported together."""
    rows: dict[str, list[Term]] = {axis: [] for axis in AXES}
    faults: list[str] = []
    for axes, spellings in table.items():
        terms = _read_terms(axes, spellings, faults)
        for axis in axes.split():
            if axis in rows:
                rows[axis] += terms
            else:
                faults.append(f"`{axis}` is not an axis; the axes are {' '.join(AXES)}.")
    if faults:
        raise ModelError(f"{what}: {' '.join(faults)}")
    return tuple(tuple(row) for row in rows.values())


def _read_terms(axes: str, spellings: str | Iterable[str | Term], faults: list[str]) -> list[Term]:
    terms: list[Term] = []
    for spelling in spellings.split() if isinstance(spellings, str) else spellings:
        try:
            terms.append(spelling if isinstance(spelling, Term) else Term.parse(spelling))
        except TermError as error:
            faults.append(f"At {axes}: {error}")
    return terms
