"""A skeleton places the joints where the model does, and survives a file."""

import json

import numpy as np
import pytest

from ftqp.core.errors import InputError
from ftqp.model import catalog
from ftqp.model.chain import frame_id
from ftqp.model.posture import places
from ftqp.model.skeleton import Skeleton


@pytest.mark.parametrize("name", ["panda", "planar6", "puma560", "srs7", "zhang7", "xarm7"])
def test_joints_and_tip_are_where_the_model_has_them(name):
    robot = catalog.load(name)
    q = robot.neutral + np.random.default_rng(3).uniform(-0.5, 0.5, (4, robot.nv))
    frames = Skeleton.from_facts(json.loads(json.dumps(Skeleton.of(robot.chain).facts()))).frames(q)
    tip = frame_id(robot.model, robot.tip)
    for row, poses in zip(q, frames, strict=True):
        points, axes = places(robot.model, tip, robot.configuration(row))
        np.testing.assert_allclose(poses[:, :3, 3], points, atol=1e-12)
        np.testing.assert_allclose(poses[:-1, :3, 2], axes, atol=1e-12)
        np.testing.assert_allclose(poses[-1], robot.pose(row), atol=1e-12)


NOWHERE = np.full((4, 4), np.nan).tolist()


@pytest.mark.parametrize(
    "change", [{"tip": None}, {"placements": [[0.0]]}, {"prismatic": 3}, {"tip": NOWHERE}]
)
def test_facts_that_are_none_of_an_arm_are_one_clear_sentence(change):
    facts = Skeleton.of(catalog.load("panda").chain).facts() | change
    with pytest.raises(InputError, match="the arm's geometry"):
        Skeleton.from_facts(facts)


def test_facts_without_a_tip_are_refused():
    with pytest.raises(InputError, match="the arm's geometry"):
        Skeleton.from_facts({"prismatic": [], "placements": []})
