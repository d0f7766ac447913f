"""From the spelling of a term to its atoms, and back."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence

from hydrodamp.basis.atoms import ATOM_PLACE, FIRST_CHANNEL, is_absolute
from hydrodamp.basis.command_names import SYMBOL, check_command_name
from hydrodamp.errors import TermError

AtomKey = tuple[int, str, bool]

_COMMAND = re.compile(r"(\|?)([A-Za-z_][A-Za-z0-9_]*)(\|?)(?:\^([1-9]))?")
_ADVICE = (
    "Write products of u v w p q r, |u| ... |r|, U V V_v V_w, (eta-1) and down_x down_y down_z, "
    "such as 'v|r|', and join commands by '*', such as 'u|u|*rudder'."
)


def atom_key(atom: str) -> AtomKey:
    """Return what atoms are sorted by: reserved ones in table order, then commands by name."""
    return ATOM_PLACE.get(atom, FIRST_CHANNEL), atom.strip("|"), is_absolute(atom)


def read_atoms(text: str) -> list[str]:
    """Return the atoms a spelling names, as many times as it names them."""
    if not text.strip():
        raise TermError(f"A term must not be empty. {_ADVICE}")
    atoms: list[str] = []
    for piece in text.strip().split("*"):
        atoms.extend(_read_piece(piece.strip(), text.strip()))
    return atoms


def canonical(atoms: Iterable[str]) -> tuple[str, ...]:
    """Return atoms in canonical order: ones dropped, pairs of absolute values squared."""
    counts = Counter(atom for atom in atoms if atom != "1")
    for atom in [atom for atom in counts if is_absolute(atom)]:
        pairs, counts[atom] = divmod(counts[atom], 2)
        counts[atom.strip("|")] += 2 * pairs
    return tuple(sorted(counts.elements(), key=atom_key))


def spell(factors: Sequence[str]) -> str:
    """Return the spelling of factors in canonical order."""
    powers = [
        (atom, atom if count == 1 else f"{atom}^{count}")
        for atom, count in Counter(factors).items()
    ]
    reserved = "".join(text for atom, text in powers if atom in ATOM_PLACE)
    commands = [text for atom, text in powers if atom not in ATOM_PLACE]
    return "*".join([reserved, *commands] if reserved else commands) or "1"


def _read_piece(piece: str, text: str) -> list[str]:
    """Read what stands between two '*': reserved symbols side by side, or one command."""
    if piece == "1":
        return ["1"]
    atoms: list[str] = []
    place = 0
    while found := SYMBOL.match(piece, place):
        atoms += [found.group(1)] * int(found.group(2) or 1)
        place = found.end()
    if place == len(piece) > 0:
        return atoms
    command = _COMMAND.fullmatch(piece)
    if command is None or command.group(1) != command.group(3):
        raise TermError(f"`{text}` is not a term: {_stuck(piece, place)} {_ADVICE}")
    return _read_command(command, text)


def _stuck(piece: str, place: int) -> str:
    if not piece:
        return "nothing stands beside a '*'."
    if "eta" in piece:
        return f"stuck at '{piece[place:]}'; the propulsion ratio enters as '(eta-1)'."
    return f"stuck at '{piece[place:]}'."


def _read_command(found: re.Match[str], text: str) -> list[str]:
    bar, name, _, power = found.groups()
    if name == "eta":
        raise TermError(
            f"`{text}` is not a term: bare 'eta' is not an atom. Write '(eta-1)', the propulsion "
            "ratio less one."
        )
    try:
        check_command_name(name)
    except TermError as error:
        raise TermError(f"`{text}` is not a term: {error}") from error
    return [f"{bar}{name}{bar}"] * int(power or 1)
