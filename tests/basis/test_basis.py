"""Order, table and values of a basis."""

import numpy as np
import pytest

from hydrodamp.basis.basis import UNION, Basis, canonical_key
from hydrodamp.basis.term import Term
from hydrodamp.errors import TermError
from table_rows import rows


@pytest.fixture
def velocity():
    rng = np.random.default_rng(85)
    return rng.normal(size=(40, 6))


def test_the_union_has_the_85_terms_of_the_paper_in_the_order_of_its_spelling_list():
    names = [str(term) for term in UNION]
    assert len(UNION) == len(set(names)) == 85
    assert names[:6] == ["u", "v", "w", "p", "q", "r"]
    assert names[6:12] == ["u^2", "v^2", "w^2", "p^2", "q^2", "r^2"]
    assert names[12:18] == ["|u|", "|v|", "|w|", "|p|", "|q|", "|r|"]
    assert (names[18], names[19], names[24], names[53]) == ("u|u|", "u|v|", "v|u|", "r|r|")
    assert " ".join(names[54:69]) == "uv uw up uq ur vp vq vr vw wp wq wr pq pr qr"
    assert " ".join(names[69:76]) == "vV wV qV rV |w|V |r|V_v |q|V_w"
    assert names[76:80] == ["u^2(eta-1)", "v^2(eta-1)", "w^2(eta-1)", "uv(eta-1)"]
    assert names[80:] == ["uw(eta-1)", "uq(eta-1)", "ur(eta-1)", "vV(eta-1)", "wV(eta-1)"]


def test_other_terms_follow_by_degree_then_factors():
    terms = [Term.parse(s) for s in ("u|u|*rudder", "rudder^2", "rudder", "down_y", "1", "r")]
    ordered = " ".join(map(str, sorted(terms, key=canonical_key)))
    assert ordered == "r 1 down_y rudder rudder^2 u|u|*rudder"


def test_a_basis_keeps_the_order_given_and_a_union_brings_the_canonical_one():
    one, other = Basis.of("r", "u"), Basis.of("rudder", "v", "u")
    assert str(one) == "r u"
    assert str(Basis.union(one, other)) == "u v r rudder"
    assert Basis.union(one, other) == Basis.union(other, one)
    assert Basis.union(one, other).commands == ("rudder",)


def test_membership_and_index_take_terms_and_spellings(refused):
    basis = Basis.of("u", "v|r|")
    assert "|r|v" in basis
    assert Term.parse("u") in basis
    assert "w" not in basis
    assert basis.index("|r|v") == basis.index(Term.parse("v|r|")) == 1
    refused(TermError, basis.index, "v|v|")


def test_a_term_may_come_once(refused):
    refused(TermError, Basis.of, "v|r|", "|r|v")


def test_the_table_holds_atom_indices_and_zeros(refused):
    basis = Basis.of("1", "|r|V_v", "u|u|*rudder", "rpm*|rpm|")
    table = basis.atom_table(("rpm", "rudder"))
    assert table.dtype == np.int32
    assert table.tolist() == [[0, 0, 0, 0], [12, 15, 0, 0], [1, 7, 22, 0], [21, 23, 0, 0]]
    assert not table.flags.writeable
    assert Basis(()).atom_table().shape == (0, 4)
    refused(TermError, basis.atom_table, ("rpm",))


def test_values_equal_hand_written_formulas(velocity):
    u, v, w, p, q, r = velocity.T
    crossflow, speed = np.hypot(v, w), np.sqrt(u**2 + v**2 + w**2)
    ratio = np.linspace(0.5, 1.5, len(velocity))
    rudder, rpm = np.sin(u), np.cos(v) - 0.5
    down = np.stack([np.sin(p), np.cos(p), 0 * p], axis=1)
    expected = {
        "1": np.ones(len(velocity)),
        "u^2": u**2,
        "|p|": np.abs(p),
        "r|q|": r * np.abs(q),
        "|r|V_v": np.abs(r) * np.sign(v) * crossflow,
        "|q|V_w": np.abs(q) * np.sign(w) * crossflow,
        "|w|V": np.abs(w) * crossflow,
        "vV(eta-1)": v * crossflow * (ratio - 1.0),
        "rU": r * speed,
        "down_y": down[:, 1],
        "u|u|*rudder^2": u * np.abs(u) * rudder**2,
        "rpm*|rpm|": rpm * np.abs(rpm),
    }
    basis = Basis.of(*expected)
    values = basis.evaluate(
        velocity,
        down=down,
        commands={"rpm": rpm, "rudder": rudder, "unused": 0.0},
        propulsion_ratio=ratio,
    )
    for column, (name, formula) in enumerate(expected.items()):
        np.testing.assert_allclose(values[:, column], formula, rtol=1e-13, atol=1e-14, err_msg=name)


def test_one_sample_gives_one_row(velocity):
    whole = UNION.evaluate(velocity)
    assert whole.shape == (40, 85)
    np.testing.assert_array_equal(UNION.evaluate(velocity[3]), whole[3])


def test_the_propulsion_ratio_is_one_by_default_and_its_terms_vanish(velocity):
    values = UNION.evaluate(velocity)
    assert np.abs(values[:, 76:]).max() < 1e-13
    assert np.all(np.abs(values[:, :76]).max(axis=0) > 0.0)


def test_the_vehicle_is_level_by_default():
    basis = Basis.of("down_x", "down_y", "down_z")
    assert basis.evaluate(np.zeros(6)).tolist() == [0.0, 0.0, 1.0]
    assert basis.evaluate(np.zeros((2, 6)), down=[0, 1, 0]).tolist() == [[0, 1, 0]] * 2


def test_at_rest_signs_and_speeds_are_zero():
    basis = Basis.of("V_v", "V_w", "U", "u(eta-1)")
    assert basis.evaluate(np.zeros(6)).tolist() == [0.0] * 4


@rows("name, shape")
def test_wrong_arrays_are_refused(name, shape, refused):
    given = {"velocity": np.zeros((4, 6)), "commands": {"rudder": 0.1}, name: np.zeros(shape)}
    refused(TermError, Basis.of("u*rudder").evaluate, **given)


@pytest.mark.parametrize("commands", [None, {"ruder": 1.0}, {"rudder": np.zeros(3)}])
def test_wrong_commands_are_refused(commands, refused):
    refused(TermError, Basis.of("u*rudder").evaluate, np.zeros((4, 6)), commands=commands)
