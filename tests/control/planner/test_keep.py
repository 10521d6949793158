"""Points kept on their side of a plane: their rows, what they hold, and what is said of wrong ones."""

import numpy as np
import pytest
from tests.control.planner.test_soft_tasks import LEVELS, LIGHT, PANDA, Q, V, frame, still

import ftqp
from ftqp.control.planner.labels import row_labels
from ftqp.core.errors import InputError
from ftqp.kernel.rows.joint_intervals import braking, viability

DT = 1e-3
TIP, ELBOW = PANDA.tip, "panda_joint4"


def distance(robot, q, keep):
    return float(keep.normal @ (robot.pose(q, keep.frame)[:3, 3] - keep.above))


@pytest.mark.parametrize("level", LEVELS)
def test_a_row_is_what_pinocchio_and_the_formula_of_a_joint_limit_say(level):
    n = np.array([0.6, -0.3, 0.74])
    keep = ftqp.Keep("panda_joint6", above=[0.2, 0.1, 0.3], normal=n, point=(0.0, 0.1, 0.05), braking=3.0)
    planner = ftqp.Planner(PANDA, DT, level=level, constraints=[keep])
    planner.reset(Q, V)
    planner.step(Q, V, still(PANDA, Q))
    K = planner._session.K
    q, v = K.state.q[:7].copy(), K.state.v[:7].copy()
    T, J, drift = frame(q, v, "panda_joint6", (0.0, 0.1, 0.05))
    n = n / np.linalg.norm(n)
    h, speed = n @ (T.translation - np.array([0.2, 0.1, 0.3])), n @ J[:3] @ v
    law, own = (viability, n @ drift[:3]) if level == "acceleration" else (braking, 0.0)
    assert h > 0.0 and int(K.qp.nc) == 8
    np.testing.assert_allclose(K.qp.C[7, :7], n @ J[:3], atol=1e-12)
    assert K.qp.l[7] == pytest.approx(-law(-speed, h, np.inf, np.inf, 3.0, DT)[0] - own, rel=1e-9)
    assert K.qp.u[7] == np.inf
    assert planner.constraints["panda_joint6"].distance == pytest.approx(h, abs=1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_no_point_crosses_its_plane_whatever_fails_and_wherever_the_target_goes(seed):
    rng = np.random.default_rng(seed)
    robot = ftqp.robots.load(["panda", "iiwa14", "srs7", "xarm7"][seed % 4])
    keeps = []
    for k in range(int(rng.integers(1, 4))):
        at = str(rng.choice([robot.tip, robot.joints[3], robot.joints[5]]))
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        above = robot.pose(robot.neutral, at)[:3, 3] - rng.uniform(0.02, 0.2) * n
        keeps.append(
            ftqp.Keep(at, above=above, normal=n, name=f"k{k}", braking=float(rng.choice([0.5, 1.0, 2.0])))
        )
    task = ftqp.Task(rows="position", mode=["slack", "hard", "scaled", "lexicographic"][(seed // 2) % 4])
    planner = ftqp.Planner(robot, DT, level=LEVELS[seed % 2], task=task, emergency=None, constraints=keeps)
    q, T = robot.neutral.copy(), robot.pose(robot.neutral)
    planner.reset(q)
    way, rate, least = 0.3 * rng.normal(size=3), rng.uniform(1.0, 8.0), np.inf
    for k in range(2000):
        pose = T.copy()
        pose[:3, 3] += way * np.sin(rate * k * DT)
        if k == 700 and seed % 3:
            planner.report(ftqp.Locked(int(rng.integers(robot.nv))))
        if k == 1500 and seed % 4 == 1:
            planner.stop()
        step = planner.step(q, None, ftqp.Target(pose=pose))
        q = step.q.copy()
        if k % 5 == 0:
            least = min(least, *(distance(robot, q, keep) for keep in keeps))
    assert least > -2e-5


def test_the_task_gives_way_and_what_holds_it_is_named():
    keep = ftqp.Keep(TIP, above=[0.0, 0.0, 0.45], name="tool")
    target = still(PANDA, PANDA.neutral)
    target.position[2] = 0.3
    for backend in ("active_set", "daqp", "dtrnn"):
        planner = ftqp.Planner(PANDA, DT, emergency=None, constraints=[keep], backend=backend)
        q = PANDA.neutral.copy()
        planner.reset(q)
        for _ in range(3000):
            step = planner.step(q, None, target)
            q = step.q.copy()
        assert PANDA.pose(q)[2, 3] == pytest.approx(0.45, abs=2e-5)
        assert step.status is ftqp.StepStatus.RELAXED and "tool its boundary" in step.limits_active
        assert "in the way: tool at its boundary" in str(step.certificate)
        assert "tool its boundary" in step.copy().limits_active
    assert row_labels(planner)[-1] == "keep tool"


@pytest.mark.long
@pytest.mark.parametrize("level", LEVELS)
def test_a_point_that_begins_beyond_its_plane_comes_back_and_stays(level):
    z = PANDA.pose(PANDA.neutral, ELBOW)[2, 3]
    keep = ftqp.Keep(ELBOW, above=[0.0, 0.0, z + 0.03])
    planner = ftqp.Planner(PANDA, DT, level=level, task=ftqp.Task(rows="position"), constraints=[keep])
    q = PANDA.neutral.copy()
    planner.reset(q)
    heights = []
    for _ in range(6000):
        q = planner.step(q, None, still(PANDA, PANDA.neutral)).q.copy()
        heights.append(PANDA.pose(q, ELBOW)[2, 3] - z)
    assert heights[0] == pytest.approx(0.0, abs=1e-3) and heights[-1] > 0.03 - 1e-6
    assert (np.diff(heights) > -1e-9).all()


def test_an_arm_without_masses_is_kept_too_and_a_batch_keeps_its_arms():
    robot = LIGHT
    assert not robot.has_inertia
    keep = ftqp.Keep(robot.tip, above=robot.pose(robot.neutral)[:3, 3] - [0.0, 0.05, 0.0], normal=(0, 1, 0))
    task = ftqp.Task(rows="position")
    planner = ftqp.Planner(robot, DT, level="velocity", task=task, emergency=None, constraints=[keep])
    target = still(robot, robot.neutral)
    target.position[1] -= 0.3
    planner.reset(robot.neutral)
    targets = ftqp.Targets(np.tile(target.pose, (2000, 1, 1)))
    ends = ftqp.batch.rollout(planner, robot.neutral, targets=targets, faults=[None, ftqp.Locked(1)]).q
    for q in ends:
        assert -2e-5 < distance(robot, q, keep) < 1e-3


@pytest.mark.parametrize(("constraints", "sentence"), [
    (ftqp.Keep(TIP, above=[0, 0, 0]), "constraints is Keep, expected a list"),
    (["table"], "constraints has str, expected ftqp.Keep"),
    ([ftqp.Keep(TIP, above=[0, 0, 0], name=str(k)) for k in range(9)], "has 9 sides of planes"),
    ([ftqp.Keep(TIP, above=[0, 0, 0])] * 2, "two things are called 'panda_hand_tcp'"),
    ([ftqp.Keep("panda_hand", above=[0, 0, 0])], "frame is 'panda_hand'"),
    ([ftqp.Keep("universe", above=[0, 0, 0])], "does not move with any joint"),
])  # fmt: skip
def test_wrong_lists_are_one_sentence(constraints, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Planner(PANDA, DT, constraints=constraints)


@pytest.mark.parametrize(("wrong", "sentence"), [
    ({"above": [0, 0]}, "above has shape"),
    ({"above": [0, 0, np.nan]}, "above"),
    ({"normal": [0, 0, 0]}, "normal is .*expected a direction"),
    ({"braking": 0.0}, "braking is 0"),
    ({"braking": -1.0}, "braking is -1"),
    ({"name": ""}, "name is ''"),
])  # fmt: skip
def test_wrong_numbers_are_one_sentence(wrong, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Keep(TIP, **{"above": [0, 0, 0], **wrong})


def test_what_is_kept_can_be_read_and_not_set():
    planner = ftqp.Planner(PANDA, DT, constraints=[ftqp.Keep(TIP, above=[0, 0, 0], name="tool")])
    assert "tool" in planner.constraints and "tol" not in planner.constraints
    assert list(planner.constraints) == ["tool"] and planner.constraints["tool"].given.braking == 1.0
    with pytest.raises(InputError, match=r"no constraint 'tol' \(did you mean 'tool'\?\)"):
        planner.constraints["tol"]
    with pytest.raises(AttributeError, match=r"planner\.constraints cannot be set"):
        planner.constraints = []
    with pytest.raises(InputError, match="solves no QP"):
        ftqp.Planner(PANDA, DT, level="velocity", scheme="pseudoinverse",
                     constraints=[ftqp.Keep(TIP, above=[0, 0, 0])])  # fmt: skip
