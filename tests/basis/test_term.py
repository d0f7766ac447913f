"""Spelling, equality and meaning of terms."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hydrodamp.basis.basis import UNION, Basis
from hydrodamp.basis.term import ATOMS, RESERVED, Term, atom_index, check_command_name
from hydrodamp.errors import TermError

COMMANDED = (
    *("u|u|*rudder", "ch_forward", "rpm*|rpm|", "rudder^2", "u|u|*rudder^2", "down_y", "1"),
    *("u^2v", "v^2|v|", "|port|*starboard", "U^2", "Vdown_x*rudder"),
)

# The atom places of the kernels' table, written out independently.


def test_channels_follow_the_reserved_atoms_and_then_their_absolute_values():
    channels = ("rpm", "rudder", "elevator")
    names = ["rpm", "rudder", "elevator", "|rpm|", "|rudder|", "|elevator|"]
    assert [atom_index(name, channels) for name in names] == [21, 22, 23, 24, 25, 26]


def test_a_command_that_is_no_channel_is_named_with_the_nearest():
    with pytest.raises(TermError, match=r"no channel 'ruder'. Did you mean 'rudder'"):
        atom_index("ruder", ("rudder",))
    with pytest.raises(TermError, match="There are: none"):
        atom_index("rudder")


@pytest.mark.parametrize("spelling", [*map(str, UNION), *COMMANDED])
def test_every_spelling_prints_as_it_is_typed(spelling):
    assert str(Term.parse(spelling)) == spelling


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("|u||u|", "u^2"),
        ("|u|^2", "u^2"),
        ("u*v", "uv"),
        ("|rpm|*|rpm|", "rpm^2"),
        ("1*u", "u"),
        ("|v||v||v|", "v^2|v|"),
    ],
)
def test_spellings_of_the_same_product_are_equal(one, other):
    assert Term.parse(one) == Term.parse(other)
    assert hash(Term.parse(one)) == hash(Term.parse(other))
    assert str(Term.parse(one)) == str(Term.parse(other))


atoms = st.one_of(st.sampled_from(ATOMS), st.sampled_from(["rudder", "|rudder|", "ch_4"]))


@pytest.mark.slow
@given(st.lists(atoms, max_size=4))
def test_parse_undoes_print_for_any_product(factors):
    term = Term(tuple(factors))
    assert Term.parse(str(term)) == term
    assert len(term.factors) <= 4
    assert str(Term.parse(str(term))) == str(term)


@pytest.mark.parametrize(
    ("spelling", "says"),
    [
        ("v|x|", r"stuck at '\|x\|'"),
        ("", "must not be empty"),
        ("eta", r"the propulsion ratio enters as '\(eta-1\)'"),
        ("|eta|", r"enters as '\(eta-1\)'"),
        ("u^2eta", r"stuck at 'eta'; the propulsion ratio enters as '\(eta-1\)'"),
        ("uv*", r"a '\*' needs a factor"),
        ("u v", "stuck at ' v'"),
        ("|u", r"stuck at '\|u'"),
        ("rpm|rpm|", r"join commands by '\*'"),
        ("time", "`time` is reserved"),
        ("u^5", "5 factors; a term has at most 4"),
        ("rpm^0", "stuck at"),
    ],
)
def test_what_is_no_term_is_refused_with_where_it_is_stuck(spelling, says):
    with pytest.raises(TermError, match=says):
        Term.parse(spelling)


def test_factors_must_be_atoms_or_commands():
    with pytest.raises(TermError, match="`x y` must be letters"):
        Term(("x y",))


def test_what_a_term_contains():
    term = Term.parse("V(eta-1)*rudder*|rpm|")
    assert term.factors == ("V", "(eta-1)", "|rpm|", "rudder")
    assert term.commands == ("rpm", "rudder")
    assert Term.parse("r|p|").velocities == ("p", "r")
    assert Term.parse("qV").velocities == ("v", "w", "q")
    assert Term.parse("rU").velocities == ("u", "v", "w", "r")
    assert Term.parse("rpm*|rpm|").commands == ("rpm",)
    assert Term.parse("1").factors == ()
    assert term.needs_propulsion
    assert not Term.parse("vV").needs_propulsion
    assert Term.parse("vdown_y").needs_attitude
    assert not Term.parse("v*rudder").needs_attitude


@pytest.mark.parametrize("locked", ["w", "vw", "uvw", "pqr", "uvwpqr"])
def test_a_term_vanishes_without_velocities_where_its_values_do(locked):
    moving = np.array([name not in locked for name in "uvwpqr"])
    velocity = np.random.default_rng(2).normal(size=(9, 6)) * moving
    more = {"down": [0.1, 0.2, 0.9], "commands": {"rudder": 0.3}, "propulsion_ratio": 1.3}
    for term in (*UNION, *map(Term.parse, ("U", "w(eta-1)", "down_y", "rudder", "1"))):
        values = Basis((term,)).evaluate(velocity, **more)
        assert term.vanishes_without(set(locked)) == (not values.any()), term


@pytest.mark.parametrize(
    ("spelling", "latex"),
    [
        ("1", "1"),
        ("v|r|", r"v\lvert r\rvert"),
        ("|r|V_v", r"\lvert r\rvert V_v"),
        ("wV(eta-1)", r"wV(\bar\eta-1)"),
        ("vdown_y", r"v\mathrm{down}_y"),
        ("u|u|*ch_4^2", r"u\,\lvert u\rvert\,\mathrm{ch\_4}^{2}"),
    ],
)
def test_latex(spelling, latex):
    assert Term.parse(spelling).latex() == latex


@pytest.mark.parametrize("name", ["rudder", "ch_forward", "rpm", "port_thrust", "n1", "_x", "u1"])
def test_command_names_that_may_be(name):
    check_command_name(name)
    assert Term.parse(name).commands == (name,)


@pytest.mark.parametrize("name", RESERVED)
def test_reserved_names_are_no_commands(name):
    with pytest.raises(TermError, match=f"`{name}` is reserved. Rename it, to 'cmd_{name}'"):
        check_command_name(name)


def test_names_that_read_as_products_are_no_commands():
    with pytest.raises(TermError, match=r"`pwr` reads as the product p\*w\*r"):
        check_command_name("pwr")
    with pytest.raises(TermError, match=r"reads as the product V_v\*r"):
        check_command_name("V_vr")


@pytest.mark.parametrize("name", ["", "2nd", "fin angle", "ch-forward", "rpm|", "délta"])
def test_names_that_are_no_identifiers_are_no_commands(name):
    with pytest.raises(TermError, match="must be letters, digits and underscores"):
        check_command_name(name)


@pytest.mark.parametrize("factor", ["|rudder", "rudder|", "|", "||"])
def test_half_a_bar_is_no_factor(factor):
    with pytest.raises(TermError):
        Term((factor,))
