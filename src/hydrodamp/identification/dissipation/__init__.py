"""Least squares under the constraint that damping takes power out of the vehicle.

``dissipative`` is the estimator; ``dissipative_set`` the constraint, on an
``operating_box``: in closed form with a ``certificate`` where ``power_form`` finds one, else
by ``cutting_planes``; both solve a ``cone_program``. ``price`` says what the constraint costs.
"""
