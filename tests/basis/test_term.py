"""Spelling, equality and meaning of terms."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hydrodamp.basis.basis import UNION, Basis
from hydrodamp.basis.term import ATOMS, RESERVED, Term, atom_index, check_command_name
from hydrodamp.errors import TermError
from table_rows import rows

COMMANDED = (
    *("u|u|*rudder", "ch_forward", "rpm*|rpm|", "rudder^2", "u|u|*rudder^2", "down_y", "1"),
    *("u^2v", "v^2|v|", "|port|*starboard", "U^2", "Vdown_x*rudder"),
)

# The atom places of the kernels' table, written out independently.


def test_channels_follow_the_reserved_atoms_and_then_their_absolute_values():
    channels = ("rpm", "rudder", "elevator")
    names = ["rpm", "rudder", "elevator", "|rpm|", "|rudder|", "|elevator|"]
    assert [atom_index(name, channels) for name in names] == [21, 22, 23, 24, 25, 26]


def test_a_command_that_is_no_channel_is_named_with_the_nearest(refused):
    refused(TermError, atom_index, "ruder", ("rudder",))
    refused(TermError, atom_index, "rudder")


@pytest.mark.parametrize("spelling", [*map(str, UNION), *COMMANDED])
def test_every_spelling_prints_as_it_is_typed(spelling):
    assert str(Term.parse(spelling)) == spelling


@rows("one, other")
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


@rows("spelling")
def test_what_is_no_term_is_refused_with_where_it_is_stuck(spelling, refused):
    refused(TermError, Term.parse, spelling)


@rows("factor")
def test_what_is_no_factor_is_refused(factor, refused):
    refused(TermError, Term, (factor,))


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


@rows("spelling, latex")
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


@rows("name")
def test_what_is_no_name_of_a_command_is_refused(name, refused):
    refused(TermError, check_command_name, name)
