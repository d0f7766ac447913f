"""Draft of the gains of commands by their names, and commands that others determine."""

import numpy as np

import hydrodamp as hd
from hydrodamp.simulation.draft_gains import (
    draft_gains,
    find_dependent,
    gain_term,
    propose_commands,
)
from table_rows import rows

TIME = np.arange(0.0, 60.0, 0.1)
RNG = np.random.default_rng(3)


def planar_log(**commands):
    motion = {name: RNG.standard_normal(len(TIME)) for name in "uvr"}
    return hd.Log.from_arrays(TIME, motion, commands=commands)


def noise():
    return RNG.standard_normal(len(TIME))


def noisy_log(*names):
    return planar_log(**{name: noise() for name in names})


def test_a_ship_has_its_propeller_on_x_and_its_rudder_on_y_and_n():
    names = ("n_prop", "rudder_angle", "wind_speed", "windDirection")
    rudder = ("rudder_angle",)
    assert draft_gains(noisy_log(*names), ()) == {"X": ("n_prop",), "Y": rudder, "N": rudder}
    assert gain_term("n_prop") == "n_prop*|n_prop|"
    assert gain_term("rudder_angle") == "u|u|*rudder_angle"
    assert gain_term("thrust_left") == "thrust_left"


def test_thrusters_at_the_sides_of_a_boat_push_and_turn():
    both = ("left_thrust", "right_thrust")
    assert draft_gains(noisy_log(*both), ()) == {"X": both, "N": both}


def test_a_command_that_others_determine_has_no_gain_of_its_own():
    top, bottom = noise(), noise()
    log = planar_log(top=top, bottom=bottom, rudder=0.5 * (bottom - top), still=0.0 * top)
    ((name, reason),) = find_dependent(log, ("top", "bottom", "rudder"))
    assert name == "rudder"
    assert "top and bottom" in reason


@rows("names, expected")
def test_commands_are_proposed_for_actuators_that_the_log_lacks(names, expected):
    proposed = propose_commands(hd.find_vehicle("vt690"), noisy_log(*names))
    assert [*proposed["rudder"]] == expected
    assert set(proposed) == {"rudder", "elevator", "rpm"}
