"""A recording plays the frames of a run, and holds all that it needs."""

import re

import numpy as np
import pytest
from tests.viz.live.stepped_source import SteppedSource
from tests.viz.live.tape import messages_of, turns_of

from ftqp.core.pose import skew, transform
from ftqp.sim.session.session_commands import Break
from ftqp.viz.live.scene import frame_names
from ftqp.viz.live.server import picture_ticks, recording

LOCK = 20
"""The frame before which the third joint locks."""


@pytest.fixture(scope="module")
def frames():
    source = SteppedSource(seconds=0.05, overrides=["faults=[]", "path.duration=3"])
    made = []
    for k in range(40):
        if k == LOCK:
            source.put(Break("panda_joint3", "locked", {"mode": "instant"}))
        made.append(source.frame())
    return source, made


@pytest.fixture(scope="module")
def page(frames):
    source, made = frames
    return recording(made, source.stage().robot, path=source.stage().path, title="<script>alert(1)</script>")


def pose(page, node):
    """The last pose of a node in its parent."""
    _, messages = messages_of(page)
    told = {m["type"]: m for _, m in messages if m.get("name") == node}
    x, y, z = (
        told["SetOrientationMessage"]["wxyz"][1:] if "SetOrientationMessage" in told else (0.0, 0.0, 0.0)
    )
    w = np.sqrt(max(1.0 - x * x - y * y - z * z, 0.0))
    T = np.eye(4)
    T[:3, :3] = np.eye(3) + 2.0 * (
        w * skew(np.array([x, y, z])) + skew(np.array([x, y, z])) @ skew(np.array([x, y, z]))
    )
    T[:3, 3] = told["SetPositionMessage"]["position"] if "SetPositionMessage" in told else 0.0
    return T


def test_the_locked_joint_stands_after_its_lock_and_its_neighbours_do_not(frames, page):
    _, made = frames
    lock = made[LOCK].t - made[0].t
    for joint, stands in ((1, False), (2, True), (3, False)):
        times, turned = turns_of(page, frame_names("/arm-1", range(-1, 6))[joint])
        assert len(np.unique(turned[times < lock - 1e-9], axis=0)) > 10
        after = len(np.unique(turned[times > lock + 1e-9], axis=0))
        assert after == 0 if stands else after > 10


def test_the_last_tip_pose_is_that_of_the_last_frame(frames, page):
    source, made = frames
    chain, T = source.stage().robot.chain, np.eye(4)
    for node in frame_names("/arm-1", range(-1, 6)):
        T = T @ pose(page, node)
    T = T @ transform(chain.tip_rotation, chain.tip_translation)
    assert np.allclose(T, made[-1].tip, atol=2e-5)
    assert not np.allclose(T, made[-2].tip, atol=2e-5)


def test_no_address_is_fetched_and_the_title_is_escaped(page):
    assert not re.findall(r"""(?:src|href)\s*=\s*["']?\s*(?:https?:)?//""", page)
    assert "<script>alert(1)" not in page
    assert "<title>&lt;script&gt;alert(1)&lt;/script&gt;</title>" in page
    assert "viser 1." in page


def test_a_long_run_is_thinned_to_a_minute_of_pictures_unless_all_are_asked_for():
    t = 0.001 * np.arange(600_001)
    thinned = picture_ticks(t, fps=30.0)
    assert len(thinned) == 1800
    assert thinned[0] == 0
    assert thinned[-1] == 600_000
    assert len(picture_ticks(t, fps=30.0, longest=None)) == 18_001
    assert np.allclose(np.diff(t[picture_ticks(t[:5001], fps=30.0)])[:-1], 1.0 / 30.0, atol=1.1e-3)
    assert list(picture_ticks(t[:1])) == [0]
