"""Points kept on their side of a plane or in a box, axes in a cone: their rows, and what they hold."""

import numpy as np
import pytest
from tests.control.planner.test_soft_tasks import LIGHT, PANDA, Q, V, frame, still
from tests.going import closed_loop

import ftqp
from ftqp.control.planner.planner_view import row_labels
from ftqp.core.errors import InputError
from ftqp.kernel.rows.joint_intervals import braking, viability

DT = 1e-3
TIP, ELBOW = PANDA.tip, "panda_joint4"


def test_a_row_is_what_pinocchio_and_the_formula_of_a_joint_limit_say(level):
    n = np.array([0.6, -0.3, 0.74])
    keep = ftqp.Keep("panda_joint6", above=[0.2, 0.1, 0.3], normal=n, point=(0.0, 0.1, 0.05), braking=3.0)
    planner = ftqp.Planner(PANDA, DT, level=level, constraints=[keep])
    planner.reset(Q, V)
    planner.step(Q, V, still(PANDA, Q))
    K = planner.session().K
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


def planes(rng, robot, at, **more):
    n = rng.normal(size=3)
    n /= np.linalg.norm(n)
    above = robot.pose(robot.neutral, at)[:3, 3] - rng.uniform(0.02, 0.2) * n
    return ftqp.Keep(at, above=above, normal=n, braking=float(rng.choice([0.5, 1.0, 2.0])), **more)


def cones(rng, robot, at, **more):
    axis, lean = rng.normal(size=3), 0.1 * rng.normal(size=3)
    along = robot.pose(robot.neutral, at)[:3, :3] @ (axis / np.linalg.norm(axis)) + lean
    within, braking = float(rng.uniform(0.25, 0.5)), float(rng.choice([0.5, 1.0]))
    return ftqp.Keep(at, axis=axis, along=along, within=within, braking=braking, **more)


@pytest.mark.long
@pytest.mark.parametrize(("made", "most", "fastest"), [(planes, 3, 8.0), (cones, 2, 3.0)])
@pytest.mark.parametrize(
    "seed", [*range(4), *(pytest.param(k, marks=pytest.mark.slow) for k in range(4, 12))]
)
def test_nothing_crosses_its_boundary_whatever_fails_and_wherever_the_target_goes(seed, made, most, fastest):
    rng = np.random.default_rng(seed)
    robot = ftqp.robots.load(["panda", "iiwa14", "srs7", "xarm7"][seed % 4])
    keeps = []
    for k in range(int(rng.integers(1, most + 1))):
        at = str(rng.choice([robot.tip, robot.joints[3], robot.joints[5]]))
        keeps.append(made(rng, robot, at, name=f"k{k}"))
    task = ftqp.Task(rows="position", mode=["slack", "hard", "scaled", "lexicographic"][(seed // 2) % 4])
    level = "velocity" if seed % 2 else "acceleration"
    planner = ftqp.Planner(robot, DT, level=level, task=task, emergency=None, constraints=keeps)
    q, T = robot.neutral.copy(), robot.pose(robot.neutral)
    planner.reset(q)
    way, rate, least = 0.3 * rng.normal(size=3), rng.uniform(1.0, fastest), np.inf
    for k in range(2000):
        pose = T.copy()
        pose[:3, 3] += way * np.sin(rate * k * DT)
        if k == 700 and seed % 3:
            planner.report(ftqp.Locked(int(rng.integers(robot.nv))))
        if k == 1500 and seed % 4 == 1:
            planner.stop()
        q = planner.step(q, None, ftqp.Target(pose=pose)).q.copy()
        if k % 5 == 0:
            least = min(least, *(keep.distance(robot.pose(q, keep.frame)) for keep in keeps))
    assert least > -2e-5


def test_the_task_gives_way_and_what_holds_it_is_named():
    keep = ftqp.Keep(TIP, above=[0.0, 0.0, 0.45], name="tool")
    target = still(PANDA, PANDA.neutral)
    target.position[2] = 0.3
    for backend in ("active_set", "daqp", "dtrnn"):
        planner = ftqp.Planner(PANDA, DT, emergency=None, constraints=[keep], backend=backend)
        *_, step = closed_loop(planner, target, 3000)
        assert PANDA.pose(step.q)[2, 3] == pytest.approx(0.45, abs=2e-5)
        assert step.status is ftqp.StepStatus.RELAXED and "tool its boundary" in step.limits_active
        assert "in the way: tool at its boundary" in str(step.certificate)
        assert "tool its boundary" in step.copy().limits_active
    assert row_labels(planner)[-1] == "keep tool"


Z = PANDA.pose(PANDA.neutral, ELBOW)[2, 3]
UP = PANDA.pose(PANDA.neutral)[:3, :3].T


@pytest.mark.long
@pytest.mark.parametrize(("level", "keep", "begins"), [
    ("velocity", ftqp.Keep(ELBOW, above=[0.0, 0.0, Z + 0.03]), -0.029),
    ("acceleration", ftqp.Keep(TIP, axis=UP @ [0, 0.5, 1], along=(0, 0, 1), within=0.3), -0.1),
])  # fmt: skip
def test_what_begins_beyond_its_boundary_comes_back_and_stays(level, keep, begins):
    planner = ftqp.Planner(PANDA, DT, level=level, task=ftqp.Task(rows="position"), constraints=[keep])
    steps = closed_loop(planner, still(PANDA, PANDA.neutral), 6000)
    inside = [keep.distance(PANDA.pose(step.q, keep.frame)) for step in steps]
    assert inside[0] < begins and inside[-1] > -1e-6 and (np.diff(inside) > -1e-9).all()


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
        assert -2e-5 < keep.distance(robot.pose(q)) < 1e-3


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


INF = np.inf


def first(q, v, **settings):
    """A planner that has made one step at a state."""
    planner = ftqp.Planner(PANDA, DT, **settings)
    planner.reset(q, v)
    planner.step(q, v, still(PANDA, q))
    return planner


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.3, -0.5, 0.2)])
def test_a_row_of_a_cone_is_what_finite_differences_of_the_angle_say(level, axis):
    keep = ftqp.Keep("panda_joint6", axis=axis, along=(0.2, 0.9, -0.6), within=2.5, braking=3.0)
    qp = first(Q, V, level=level, constraints=[keep]).session().K
    q, v, C, l = qp.state.q[:7].copy(), qp.state.v[:7].copy(), qp.qp.C[7, :7], float(qp.qp.l[7])
    u = float(qp.qp.u[7])

    def angle(at):
        return 2.5 - keep.distance(PANDA.pose(at, "panda_joint6"))

    h, x = 1e-4, np.random.default_rng(3).normal(size=7)
    here, rate = angle(q), (angle(q + h * v) - angle(q - h * v)) / (2.0 * h)
    assert abs(rate) > 0.1
    away = [angle(q + t * v + 0.5 * t * t * x * (level == "acceleration")) for t in (-h, h)]
    change = (away[0] - 2.0 * here + away[1]) / (h * h)
    law = viability if level == "acceleration" else braking

    def most(v, d):
        least = -max(4.0 * 3.0, 0.5 * v * v / (d - v * DT))
        return max(law(v, d, INF, INF, 3.0, DT)[0], least if level == "acceleration" else v + DT * least)

    out, back = most(rate, 2.5 - here), most(-rate, 2.5 + here)
    if level == "velocity":  # the curvature of the way counts where it is for the worse
        out, back = out - DT * max(change, 0.0), back - DT * max(-change, 0.0)
        change = (angle(q + h * x) - angle(q - h * x)) / (2.0 * h)
    assert C @ x - l == pytest.approx(out - change, rel=1e-6, abs=1e-5)
    assert u - C @ x == pytest.approx(back + change, rel=1e-6, abs=1e-5)
    assert qp.keeps.distance[0] == pytest.approx(2.5 - here, abs=1e-12)


def test_the_task_gives_way_to_a_cone_and_to_a_side_of_a_box_and_they_are_named():
    T = PANDA.pose(PANDA.neutral)
    upright = ftqp.Keep(TIP, axis=T[:3, :3].T @ [0, 0, 1], along=(0, 0, 1), within=0.2, name="cup")
    lean = np.array([[1, 0, 0], [0, np.cos(0.5), -np.sin(0.5)], [0, np.sin(0.5), np.cos(0.5)]])
    goal = T.copy()
    goal[:3, :3], goal[0, 3] = lean @ T[:3, :3], T[0, 3] + 0.1
    box = ftqp.Keep(TIP, inside=((-INF, -INF, -INF), (T[0, 3] + 0.02, INF, INF)), name="cell")
    planner = ftqp.Planner(PANDA, DT, emergency=None, constraints=[upright, box])
    *_, step = closed_loop(planner, ftqp.Target(pose=goal), 3000)
    end = PANDA.pose(step.q)
    assert np.arccos((end @ np.linalg.inv(T))[2, 2]) == pytest.approx(0.2, abs=2e-5)
    assert end[0, 3] == pytest.approx(T[0, 3] + 0.02, abs=2e-5)
    assert step.status is ftqp.StepStatus.RELAXED
    assert {"cup its boundary", "cell x high its boundary"} <= set(step.limits_active)


def test_an_axis_that_comes_through_the_middle_is_braked_before_the_other_side():
    """It swings to and fro, in a cone that leaves it a sixth of its way."""
    T = PANDA.pose(PANDA.neutral)
    keep = ftqp.Keep(TIP, axis=T[:3, :3].T @ [0, 0, 1], along=(0, 0, 1), within=0.15, braking=2.0)
    planner = ftqp.Planner(PANDA, DT, emergency=None, constraints=[keep])
    least, sides = np.inf, set()

    def leaning(k):
        lean, goal = 0.9 * np.sin(4.0 * k * DT), T.copy()
        turn = [[1, 0, 0], [0, np.cos(lean), -np.sin(lean)], [0, np.sin(lean), np.cos(lean)]]
        goal[:3, :3] = turn @ T[:3, :3]
        return ftqp.Target(pose=goal)

    for step in closed_loop(planner, leaning, 3000):
        end = PANDA.pose(step.q)
        least = min(least, keep.distance(end))
        if keep.distance(end) < 1e-3:
            sides.add(np.sign((end @ np.linalg.inv(T))[2, 1]))
    assert sides == {-1.0, 1.0} and least > -2e-5
