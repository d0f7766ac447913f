import numpy as np
from hypothesis import given, strategies as st

from hydrodamp.data.attitude import (
    euler_from_quaternion,
    quaternion_from_euler,
    rotation_matrices,
    rotation_vectors,
)

angle = st.floats(-3.0, 3.0)
pitch = st.floats(-1.5, 1.5)


def elementary(roll, pitch, yaw):
    """Fossen (2021), eq. 2.31: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


@given(angle, pitch, angle)
def test_rotation_is_the_product_of_elementary_ones(r, p, y):
    q = quaternion_from_euler(np.array([[r, p, y]]))
    np.testing.assert_allclose(rotation_matrices(q)[0], elementary(r, p, y), atol=1e-14)


@given(angle, pitch, angle)
def test_euler_angles_come_back(r, p, y):
    q = quaternion_from_euler(np.array([[r, p, y]]))
    np.testing.assert_allclose(euler_from_quaternion(q), [[r, p, y]], atol=1e-7)


@given(st.lists(st.floats(-1.7, 1.7), min_size=3, max_size=3), angle, pitch, angle)
def test_turn_is_the_constant_rate_that_leads_there(vector, r, p, y):
    first = quaternion_from_euler(np.array([[r, p, y]]))
    angle_of = float(np.linalg.norm(vector))
    axis = np.array(vector) / (angle_of or 1.0)
    w1, v1 = first[0, 0], first[0, 1:]
    w2, v2 = np.cos(angle_of / 2), np.sin(angle_of / 2) * axis
    second = np.array([[w1 * w2 - v1 @ v2, *(w1 * v2 + w2 * v1 + np.cross(v1, v2))]])
    np.testing.assert_allclose(rotation_vectors(first, second), [vector], atol=1e-12)
    np.testing.assert_allclose(rotation_vectors(first, -second), [vector], atol=1e-12)
