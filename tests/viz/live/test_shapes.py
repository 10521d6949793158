"""Every arm of the catalog looks like an arm from its chain alone."""

import numpy as np
import pytest

import ftqp
from ftqp.faults.kinds import KINDS
from ftqp.model.catalog import CATALOG
from ftqp.model.chain import ends_of
from ftqp.sim.log.signals import CONDITIONS
from ftqp.viz.live import colours
from ftqp.viz.live.meshes import BASE, arm_parts, radii, size_of


def placed(robot, parts, q):
    """Corners of the parts in the base frame, by part, with the frames by a plain product of poses."""
    chain, poses = robot.chain, []
    for i in range(robot.nv):
        step, joint = np.eye(4), np.eye(4)
        step[:3, :3], step[:3, 3] = chain.rotation[i], chain.translation[i]
        if chain.prismatic[i]:
            joint[2, 3] = q[i]
        else:
            joint[:2, :2] = [[np.cos(q[i]), -np.sin(q[i])], [np.sin(q[i]), np.cos(q[i])]]
        above = poses[chain.parent[i]] if chain.parent[i] >= 0 else np.eye(4)
        poses.append(above @ step @ joint)
    poses.append(np.eye(4))
    return {p.name: p.mesh.vertices @ poses[p.frame][:3, :3].T + poses[p.frame][:3, 3] for p in parts}


@pytest.mark.parametrize("name", CATALOG)
def test_every_joint_has_a_barrel_and_links_reach_from_joint_to_joint(name):
    robot = ftqp.robots.load(name)
    parts = arm_parts(robot)
    assert [p.frame for p in parts if p.kind == "joint"] == list(range(robot.nv))
    assert [p.frame for p in parts if p.kind == "base"] == [BASE]
    assert len({p.name for p in parts}) == len(parts)
    for part in parts:
        assert np.isfinite(part.mesh.vertices).all()
        assert part.mesh.faces.min() >= 0
        assert part.mesh.faces.max() < len(part.mesh.vertices)
    corners = placed(robot, parts, robot.neutral)
    for name, tip in zip(("tip", "tip1"), robot.tips, strict=False):
        at = robot.pose(robot.neutral, tip)[:3, 3]
        assert np.linalg.norm(corners[name].mean(axis=0) - at) < 0.2 * radii(robot.chain)[-1]
    assert len([p for p in parts if p.kind == "tip"]) == len(robot.tips)
    chain = robot.chain
    ends = [*zip(chain.parent, chain.translation, strict=True)]
    ends += [(body, at) for body, _, at in ends_of(robot.model, robot.tips)]
    linked = {p.frame for p in parts if p.kind == "link"}
    far = {i for i, end in ends if i >= 0 and np.linalg.norm(end) > 0.01 * size_of(chain)}
    assert linked >= far
    for i, end in ends:
        if i in far:
            mesh = next(p.mesh for p in parts if p.name == f"link{i}")
            assert np.linalg.norm(mesh.vertices - end, axis=1).min() < 1.5 * radii(chain)[i]


def test_every_condition_has_a_colour_of_its_own():
    assert set(colours.CONDITION) == set(CONDITIONS) == {0, *(kind.number for kind in KINDS.values())}
    shown = [*colours.CONDITION.values(), colours.BRAKING, colours.NEAR_LIMIT]
    assert len(set(shown)) == len(shown)
