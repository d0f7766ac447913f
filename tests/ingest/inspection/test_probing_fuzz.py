import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.ingest.inspection.probe import probe

LISTED = (
    "time t_ms u v w p q r vx vy vz roll pitch_deg yaw heading qw qx qy qz x y z depth north east "
    "gyro_x acc_z ch_yaw rpm data_good twist.linear.x pose.position.y xyz[0] q[0] q[1] q[2] q[3] "
    "header.stamp column.1 a:b #c y's"
)
NAMES = LISTED.split()
ODD = [0.0, 1.0, -1.0, 0.5, 3.2, 359.0, 1e308, -1e308, np.inf, np.nan, 1e-300]


@st.composite
def recordings(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**16)))
    topics = []
    for name in draw(
        st.lists(st.sampled_from(["", "a", "/b/c", "imu.0"]), max_size=3, unique=True)
    ):
        n = draw(st.sampled_from([0, 1, 2, 40, 300]))
        fields = draw(st.lists(st.sampled_from(NAMES), max_size=12, unique=True))
        kinds = (
            lambda n: 0.1 * np.arange(n),
            lambda n: np.sin(0.1 * np.arange(n)),
            lambda n: rng.choice(ODD, n),
            lambda n: np.repeat(rng.choice([0.0, 1.0]), n),
            lambda n: np.full(n, np.nan),
            lambda n: rng.standard_normal(n),
        )
        columns = {field: draw(st.sampled_from(kinds))(n) for field in fields}
        time = draw(st.sampled_from([None, 0.1 * np.arange(n), rng.choice(ODD, n)]))
        topics.append(Topic(name, time, columns))
    return Recording(tuple(topics), "odd.csv", draw(st.sampled_from(["ROS 1 bag", "PX4 ULog", ""])))


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(recordings())
def test_no_recording_is_too_odd(recording):
    """Whatever stands in a recording, it is looked through; its draft reads, or says why not."""
    found = probe(recording)
    assert 0 <= found.draft.confidence <= 99
    if found.draft.confidence:
        found.mapping()  # a draft is never refused by the rules of mappings
