"""Every arm of the catalog looks like an arm from its chain alone."""

import numpy as np
import pytest

import ftqp
from ftqp.faults.kinds import KINDS
from ftqp.model.catalog import CATALOG
from ftqp.sim.log.signals import CONDITIONS
from ftqp.viz.live import colours
from ftqp.viz.live.shapes import BASE, arm_parts, radii, size_of


def placed(robot, parts, q):
    """Corners of the parts in the base frame, by part, with the frames by a plain product of poses."""
    chain, poses, T = robot.chain, [], np.eye(4)
    for i in range(robot.nv):
        step, joint = np.eye(4), np.eye(4)
        step[:3, :3], step[:3, 3] = chain.rotation[i], chain.translation[i]
        if chain.prismatic[i]:
            joint[2, 3] = q[i]
        else:
            joint[:2, :2] = [[np.cos(q[i]), -np.sin(q[i])], [np.sin(q[i]), np.cos(q[i])]]
        T = T @ step @ joint
        poses.append(T)
    poses.append(np.eye(4))
    return {p.name: p.mesh.vertices @ poses[p.frame][:3, :3].T + poses[p.frame][:3, 3] for p in parts}


@pytest.mark.parametrize("name", CATALOG)
def test_every_joint_has_a_barrel_and_links_reach_from_joint_to_joint(name):
    robot = ftqp.robots.load(name)
    parts = arm_parts(robot.chain)
    assert [p.frame for p in parts if p.kind == "joint"] == list(range(robot.nv))
    assert [p.frame for p in parts if p.kind == "base"] == [BASE]
    assert len({p.name for p in parts}) == len(parts)
    for part in parts:
        assert np.isfinite(part.mesh.vertices).all()
        assert part.mesh.faces.min() >= 0
        assert part.mesh.faces.max() < len(part.mesh.vertices)
    corners = placed(robot, parts, robot.neutral)
    tip = robot.pose(robot.neutral)[:3, 3]
    assert np.linalg.norm(corners["tip"].mean(axis=0) - tip) < 0.2 * radii(robot.chain)[-1]
    ends = [*robot.chain.translation[1:], robot.chain.tip_translation]
    linked = {p.frame for p in parts if p.kind == "link"}
    far = {i for i, end in enumerate(ends) if np.linalg.norm(end) > 0.01 * size_of(robot.chain)}
    assert linked >= far
    for i in linked:
        mesh = next(p.mesh for p in parts if p.name == f"link{i}")
        assert np.linalg.norm(mesh.vertices - ends[i], axis=1).min() < 1.5 * radii(robot.chain)[i]


def test_every_condition_has_a_colour_of_its_own():
    assert set(colours.CONDITION) == set(CONDITIONS) == {0, *(kind.number for kind in KINDS.values())}
    shown = [*colours.CONDITION.values(), colours.BRAKING, colours.NEAR_LIMIT]
    assert len(set(shown)) == len(shown)
