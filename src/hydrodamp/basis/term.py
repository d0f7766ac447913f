"""Atoms and terms of regressors: symbols, and products of at most four, printed as typed."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from hydrodamp.errors import TermError, no_such

AXES = ("X", "Y", "Z", "K", "M", "N")
"""Rows of every wrench: force X Y Z [N] and moment K M N [N m], body frame."""

VELOCITIES = ("u", "v", "w", "p", "q", "r")
"""Surge, sway, heave [m/s] and roll, pitch, yaw rate [rad/s], body frame."""

VELOCITY_OF = dict(zip(AXES, VELOCITIES, strict=True))
"""The velocity of each axis: ``VELOCITY_OF["N"] == "r"``."""

MOTIONS = dict(zip(VELOCITIES, ("surge", "sway", "heave", "roll", "pitch", "yaw"), strict=True))
"""The motion of each velocity."""


#: ``|u| ... |r|``.
ABSOLUTES = tuple(f"|{velocity}|" for velocity in VELOCITIES)

#: ``U = |nu_1|``, ``V = sqrt(v^2 + w^2)``, ``V_v = sign(v) V``, ``V_w = sign(w) V`` [m/s].
SPEEDS = ("U", "V", "V_v", "V_w")

#: The propulsion ratio less one, ``u_c / max(U, 1e-6) - 1``.
PROPULSION = "(eta-1)"

#: The unit vector that points down, in the body frame: ``R^T e_3``.
DOWN = ("down_x", "down_y", "down_z")

#: Every reserved atom in the order of the kernels' table; ``ATOMS[0]`` is the constant one.
ATOMS = ("1", *VELOCITIES, *ABSOLUTES, *SPEEDS, PROPULSION, *DOWN)

#: The place of each reserved atom in :data:`ATOMS`.
ATOM_PLACE = {atom: index for index, atom in enumerate(ATOMS)}

#: The place of the first command channel; the absolute values follow the channels.
FIRST_CHANNEL = len(ATOMS)

#: The velocities each reserved atom is computed from.
CONTENT = {
    **dict.fromkeys(ATOMS, ""),
    **{atom: atom.strip("|") for atom in (*VELOCITIES, *ABSOLUTES)},
    **dict.fromkeys(("U", PROPULSION), "uvw"),
    **dict.fromkeys(("V", "V_v", "V_w"), "vw"),
}

#: The velocities whose absence together makes an atom zero; sign(0) = 0. Empty: never zero.
ZERO_WITHOUT = {**CONTENT, PROPULSION: "", "V_v": "v", "V_w": "w"}


def is_absolute(atom: str) -> bool:
    """Whether an atom is an absolute value, ``|r|`` or ``|rudder|``."""
    return atom.startswith("|")


def atom_index(atom: str, channels: Sequence[str] = ()) -> int:
    """Return the index of an atom in the table of the C core."""
    if atom in ATOM_PLACE:
        return ATOM_PLACE[atom]
    name = atom.strip("|")
    if name not in channels:
        raise TermError(no_such("channel", name, channels))
    index = FIRST_CHANNEL + list(channels).index(name)
    return index + len(channels) if is_absolute(atom) else index


#: Names with a meaning of their own, in logs or in terms.
RESERVED = (
    "time",
    *("roll", "pitch", "yaw", "qw", "qx", "qy", "qz"),
    *VELOCITIES,
    *(f"d{velocity}" for velocity in VELOCITIES),
    *("eta", "segment"),
    *AXES,
    *SPEEDS,
    *DOWN,
)

_SYMBOLS = sorted((*ABSOLUTES, *SPEEDS, PROPULSION, *DOWN, *VELOCITIES), key=len, reverse=True)
#: One reserved symbol with an optional power; the longest spelling wins.
SYMBOL = re.compile("(" + "|".join(map(re.escape, _SYMBOLS)) + r")(?:\^([1-9]))?")

#: Reserved symbols side by side.
PRODUCT = re.compile(f"(?:{SYMBOL.pattern})+")

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def check_command_name(name: str) -> None:
    """Refuse a command name that a term could not spell."""
    if not _IDENTIFIER.fullmatch(name):
        raise TermError(
            f"Command name `{name}` must be letters, digits and underscores and start with no "
            "digit, such as 'rudder' or 'ch_forward'. Rename it."
        )
    if name in RESERVED:
        raise TermError(f"Command name `{name}` is reserved. Rename it, to 'cmd_{name}' say.")
    if PRODUCT.fullmatch(name):
        product = "*".join(match.group(0) for match in SYMBOL.finditer(name))
        raise TermError(
            f"Command name `{name}` reads as the product {product}. Rename it, to 'cmd_{name}' say."
        )


#: A row of the kernels' table holds this many atoms.
MAX_FACTORS = 4


_COMMAND = re.compile(r"(\|?)([A-Za-z_][A-Za-z0-9_]*)\1(?:\^([1-9]))?")
_ADVICE = (
    "Write products of u v w p q r, |u| ... |r|, U V V_v V_w, (eta-1) and down_x down_y down_z, "
    "such as 'v|r|', and join commands by '*', such as 'u|u|*rudder'."
)


@dataclass(frozen=True, slots=True)
class Term:
    """A product of at most four atoms, equal to any other spelling of itself.

    Atoms are the velocities ``u v w p q r``, their absolute values, the speeds
    ``U V V_v V_w``, ``(eta-1)``, the down vector ``down_x down_y down_z`` and any
    command channel or its absolute value. Use :meth:`parse` to make one.

    Parameters
    ----------
    factors : tuple of str
        The atoms; put into canonical order, pairs of absolute values squared. The
        empty tuple is the constant ``1``.

    Raises
    ------
    TermError
        If there are more than four factors, or one is neither an atom nor a command.

    Examples
    --------
    >>> str(Term.parse("|r|v")), Term.parse("|r|v") == Term.parse("v|r|")
    ('v|r|', True)
    """

    factors: tuple[str, ...]

    def __post_init__(self) -> None:
        """Bring the factors into canonical order and count them."""
        for factor in self.factors:
            if factor not in ATOM_PLACE:
                barred = len(factor) > 1 and factor[0] == factor[-1] == "|"
                check_command_name(factor[1:-1] if barred else factor)
        object.__setattr__(self, "factors", canonical(self.factors))
        if len(self.factors) > MAX_FACTORS:
            raise TermError(
                f"`{self}` has {len(self.factors)} factors; a term has at most {MAX_FACTORS}. "
                "Drop a factor, or give the product as a command column of its own."
            )

    @classmethod
    def parse(cls, text: str) -> Term:
        """Read a term from its spelling.

        Parameters
        ----------
        text : str
            Reserved symbols are juxtaposed, commands are joined by ``*``:
            ``v|r|``, ``u^2(eta-1)``, ``u|u|*rudder``, ``rpm*|rpm|``, ``down_y``, ``1``.

        Returns
        -------
        term : Term
            Prints in the canonical spelling.

        Raises
        ------
        TermError
            If the spelling is wrong; the message gives the place.

        Examples
        --------
        >>> Term.parse("u|u|*rudder").factors
        ('u', '|u|', 'rudder')
        """
        return _parse(text)

    @property
    def commands(self) -> tuple[str, ...]:
        """The commands the term contains, each once, sorted by name."""
        names = (factor.strip("|") for factor in self.factors if factor not in ATOM_PLACE)
        return tuple(dict.fromkeys(names))

    @property
    def velocities(self) -> tuple[str, ...]:
        """The velocities the term depends on, in u to r order; U, V and (eta-1) count theirs."""
        content = "".join(CONTENT.get(factor, "") for factor in self.factors)
        return tuple(velocity for velocity in VELOCITIES if velocity in content)

    @property
    def needs_propulsion(self) -> bool:
        """Whether the term carries ``(eta-1)`` and so needs a propulsion ratio."""
        return PROPULSION in self.factors

    @property
    def needs_attitude(self) -> bool:
        """Whether the term carries a component of the down vector."""
        return any(factor.startswith("down_") for factor in self.factors)

    def vanishes_without(self, locked: Collection[str]) -> bool:
        """Whether the term is identically zero while some velocities are zero.

        Parameters
        ----------
        locked : collection of str
            Velocities that are zero throughout, of ``u v w p q r``.

        Returns
        -------
        vanishes : bool
            True where some factor is zero whatever the other velocities are.

        Examples
        --------
        >>> Term.parse("vV").vanishes_without({"w"}), Term.parse("wV").vanishes_without({"w"})
        (False, True)
        """
        needed = (ZERO_WITHOUT.get(factor, "") for factor in self.factors)
        return any(each and set(each) <= set(locked) for each in needed)

    def latex(self) -> str:
        r"""Return the term as LaTeX mathematics.

        Returns
        -------
        latex : str
            Without the dollar signs.

        Examples
        --------
        >>> Term.parse("v|r|").latex()
        'v\\lvert r\\rvert'
        """
        factors = [
            _latex_atom(atom) + (f"^{{{count}}}" if count > 1 else "")
            for atom, count in Counter(self.factors).items()
        ]
        if self.commands:
            return r"\,".join(factors)
        return re.sub(r"\\rvert(?=[A-Za-z])", r"\\rvert ", "".join(factors)) or "1"

    def __str__(self) -> str:
        """Return the canonical spelling."""
        counts = Counter(self.factors)
        powers = {atom: atom if n == 1 else f"{atom}^{n}" for atom, n in counts.items()}
        reserved = "".join(text for atom, text in powers.items() if atom in ATOM_PLACE)
        commands = [text for atom, text in powers.items() if atom not in ATOM_PLACE]
        return "*".join([reserved, *commands] if reserved else commands) or "1"


@lru_cache(maxsize=4096)
def _parse(text: str) -> Term:
    stripped = text.strip()
    if not stripped:
        raise TermError(f"A term must not be empty. {_ADVICE}")
    pieces = (_read_piece(piece.strip(), stripped) for piece in stripped.split("*"))
    return Term(tuple(atom for piece in pieces for atom in piece))


def _latex_atom(atom: str) -> str:
    if atom == PROPULSION:
        return r"(\bar\eta-1)"
    if atom.startswith("|"):
        return rf"\lvert {_latex_atom(atom.strip('|'))}\rvert"
    if atom.startswith("down_"):
        return rf"\mathrm{{down}}_{atom[-1]}"
    if atom in ATOM_PLACE:
        return atom
    escaped = atom.replace("_", r"\_")
    return rf"\mathrm{{{escaped}}}"


def atom_key(atom: str) -> tuple[int, str, bool]:
    """Return what atoms are sorted by: reserved ones in table order, then commands by name."""
    return ATOM_PLACE.get(atom, FIRST_CHANNEL), atom.strip("|"), is_absolute(atom)


def canonical(atoms: Iterable[str]) -> tuple[str, ...]:
    """Return atoms in canonical order: ones dropped, pairs of absolute values squared."""
    counts = Counter(atom for atom in atoms if atom != "1")
    for atom in [atom for atom in counts if is_absolute(atom)]:
        pairs, counts[atom] = divmod(counts[atom], 2)
        counts[atom.strip("|")] += 2 * pairs
    return tuple(sorted(counts.elements(), key=atom_key))


def _read_piece(piece: str, text: str) -> list[str]:
    """Parse the text between two '*': a product of reserved symbols, or one command."""
    if piece == "1":
        return ["1"]
    product = PRODUCT.match(piece)
    read = product.end() if product else 0
    if read == len(piece) > 0:
        return [atom for atom, power in SYMBOL.findall(piece) for _ in range(int(power or 1))]
    try:
        command = _COMMAND.fullmatch(piece)
        if command is None or (name := command[2]) == "eta":
            hint = "; the propulsion ratio enters as '(eta-1)'" if "eta" in piece else ""
            stuck = (
                f"stuck at '{piece[read:]}'{hint}."
                if piece
                else "a '*' needs a factor on either side."
            )
            raise TermError(f"{stuck} {_ADVICE}")
        check_command_name(name)
    except TermError as error:
        raise TermError(f"`{text}` is not a term: {error}") from error
    return [f"{command[1]}{name}{command[1]}"] * int(command[3] or 1)
