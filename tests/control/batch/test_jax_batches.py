"""Batches on JAX: what the compiled rollout gives, most of it by array code, whatever befalls an arm."""

import logging
import re
import subprocess
import sys
import threading
from importlib.util import find_spec

import numpy as np
import pytest
from batch_cases import DT, STATUSES, circle, faults_of, starts

import ftqp
from ftqp.core.errors import InputError
from ftqp.core.extras import remedy_for_extra
from ftqp.kernel.entry.session import ArmSession, Session
from ftqp.kernel.layout.record import load_chain

pytestmark = [
    pytest.mark.gpu,
    pytest.mark.skipif(find_spec("jax") is None, reason='needs pip install -e ".[gpu]"'),
]
OFF = 1e-9
"""What two ways of rounding may grow to over the ticks."""
WITHOUT_CALM = {"task": ftqp.Task(calm=False), "emergency": None, "scheme": "rmp", "posture": np.zeros(7)}
"""Drawn to a posture far away: near its own, one with a locked joint lets rounding grow without calm."""


def sliding():
    """An arm whose third and fifth joints slide."""
    table = [
        (0.0, 0.3, 0.0, 1.2), (0.3, 0.1, 0.3, -0.9), (0.2, 0.2, 0.0, 1.5), (0.5, 0.1, 0.2, -1.1),
        (-0.4, 0.15, 0.1, 0.8), (0.3, 0.1, 0.05, 0.3), (0.2, 0.1, 0.1, -1.0),
    ]  # fmt: skip
    limits = {"q_min": -3.0, "q_max": 3.0, "v_max": 2.0}
    return ftqp.Robot.from_dh(table, limits=limits, acceleration=8.0, prismatic=(2, 4))


def robot_of(name):
    return sliding() if name == "sliding" else ftqp.robots.load(name)


def share_by_arrays(caplog):
    """Of the last rollout, from what it says."""
    done, ticks = re.findall(r"(\d+) of (\d+) ticks were array code", caplog.text)[-1]
    return int(done) / int(ticks)


def assert_same(one, other):
    for name in ("q", "v", "position_error", "rotation_error", "trace"):
        off = OFF / DT if name == "v" else OFF
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0.0, atol=off, err_msg=name)
    np.testing.assert_array_equal(one.counts, other.counts)
    np.testing.assert_array_equal(one.first_bad, other.first_bad)


def both(planner, q, targets, **given):
    """The rollout of both engines, which must agree; that of JAX."""
    compiled = ftqp.batch.rollout(planner, q, targets=targets, **given)
    done = ftqp.batch.rollout(planner, q, targets=targets, engine="jax", **given)
    assert_same(done, compiled)
    return done


def part_of(targets, ticks):
    """The first targets of many."""
    part = ftqp.Targets(targets.packed[:ticks, :16].reshape(-1, 4, 4))
    part.packed[:] = targets.packed[:ticks]
    return part


@pytest.fixture(autouse=True)
def debugging(caplog):
    caplog.set_level(logging.DEBUG, "ftqp")


@pytest.fixture(scope="module")
def study():
    """A Panda's planner, targets and starts."""
    robot = ftqp.robots.load("panda")
    return ftqp.Planner(robot, DT, level="velocity"), circle(robot), starts(robot)


@pytest.mark.parametrize(
    ("name", "level", "settings"),
    [
        ("panda", "velocity", {}),
        ("panda", "acceleration", {}),
        ("iiwa14", "velocity", {"task": ftqp.Task(mode="hard")}),
        ("planar6", "velocity", {}),
        ("puma560", "acceleration", {"task": ftqp.Task(rows="position"), "torque_limits": False}),
        ("panda", "velocity", {"task": ftqp.Task(rows="position_axis")}),
        ("panda", "velocity", WITHOUT_CALM),
        ("sliding", "acceleration", {}),
    ],
)
def test_every_arm_moves_as_compiled_code_moves_it_and_mostly_by_array_code(caplog, name, level, settings):
    robot = robot_of(name)
    planner = ftqp.Planner(robot, DT, level=level, **({"posture": robot.neutral} | settings))
    done = both(planner, starts(robot), circle(robot), faults=faults_of(robot), every=7)
    assert share_by_arrays(caplog) > 0.6
    assert done.share(ftqp.StepStatus.OK)[0] > 0.9, "an arm without a fault keeps its task"


def test_single_steps_give_the_same(study):
    planner, targets, q = study
    done = ftqp.batch.rollout(planner, q[0], targets=targets, faults=[(ftqp.Locked(2), 40)], engine="jax")
    own, at, v = ftqp.Planner(planner.robot, DT, level="velocity"), q[0], np.zeros(7)
    own.reset(at)
    for k in range(len(targets)):
        if k == 40:
            own.report(ftqp.Locked(2))
        step = own.step(at, v, targets.at(k))
        at, v = step.q.copy(), step.v.copy()
    np.testing.assert_allclose(done.q[0], at, rtol=0.0, atol=OFF)


def test_fault_in_a_stretch_of_ticks_finds_the_arm_that_the_array_code_left(study, caplog):
    planner, targets, q = study
    faults = [(ftqp.Locked(k % 7, mode=("instant", "ramp")[k % 2]), 60 + k) for k in range(len(q))]
    both(planner, q, targets, faults=faults)
    assert 0.5 < share_by_arrays(caplog) < 0.8, "a stretch of each is done alone"


def test_target_that_stands_lets_arms_rest_as_in_compiled_code(study):
    planner, _, q = study
    poses = np.repeat(planner.robot.pose(planner.robot.neutral)[None], 900, axis=0)
    poses[600:, 0, 3] += 5.0  # out of reach
    free = ftqp.Planner(planner.robot, DT, level="velocity", emergency=None)
    done = both(free, q, ftqp.Targets(poses), faults=[None, (ftqp.Locked(1), 400)] + [None] * (len(q) - 2))
    assert (done.counts[:, STATUSES.index(ftqp.StepStatus.RELAXED)] > 200).all()


def test_groups_and_their_padding_change_nothing(study, monkeypatch, caplog):
    from ftqp.control.batch.jax import array_batch

    planner, targets, q = study
    monkeypatch.setattr(array_batch, "MOST", {"cpu": 64, "gpu": 64})
    many = np.repeat(q, 12, axis=0)  # 132 arms: two whole groups and a part of one
    short = part_of(targets, 90)
    done = both(planner, many, short, every=30)
    single = ftqp.batch.rollout(planner, q[4], targets=short, engine="jax")
    assert share_by_arrays(caplog) > 0.9
    np.testing.assert_array_equal(done.q[4 * 12], single.q[0])


@pytest.mark.parametrize("count", [0, 1])
def test_batch_of_none_and_of_one(study, count):
    planner, targets, q = study
    seen = []
    done = both(planner, q[:count], targets, faults=[None] * count)
    ftqp.batch.rollout(
        planner, q[:count], targets=targets, engine="jax", progress=lambda *pair: seen.append(pair)
    )
    assert done.q.shape == (count, 7)
    assert seen == sorted(seen) and seen[-1:] == [(1, 1)] * count


@pytest.mark.parametrize("ticks", [1, 2, 65, 66])
def test_stretches_may_end_anywhere(study, ticks):
    planner, targets, q = study
    both(planner, q[:3], part_of(targets, ticks), faults=[(ftqp.Locked(1), ticks - 1), None, None], every=1)


def test_nan_in_one_place_harms_no_other(study):
    planner, targets, q = study
    good = ftqp.batch.rollout(planner, q, targets=targets, engine="jax")
    broken, v = q.copy(), np.zeros_like(q)
    broken[3, 2], v[6, 0] = np.nan, np.inf
    done = ftqp.batch.rollout(planner, broken, v, targets, engine="jax")
    others = [arm for arm in range(len(q)) if arm not in (3, 6)]
    np.testing.assert_array_equal(done.q[others], good.q[others])
    assert np.isnan(done.q[[3, 6]]).all()
    assert (done.counts[[3, 6], STATUSES.index(ftqp.StepStatus.INVALID_INPUT)] == len(targets)).all()


def test_target_that_cannot_be_used_stops_all_arms(study):
    planner, targets, q = study
    broken = part_of(targets, len(targets))
    broken.packed[150:155, 0] += 1e-4  # no rotation any more
    broken.packed[200:202, 3] = np.nan
    broken.packed[270:, 0] = np.inf
    done = both(planner, q[:3], broken)
    assert (done.counts[:, STATUSES.index(ftqp.StepStatus.INVALID_INPUT)] >= 7).all()


def test_arm_whose_error_is_spoken_of_leaves_the_array_code(study):
    planner, _, q = study
    poses = np.repeat(planner.robot.pose(planner.robot.neutral)[None], 300, axis=0)
    poses[100:, 2, 3] -= 0.01
    done = both(ftqp.Planner(planner.robot, DT, level="acceleration"), q[:4], ftqp.Targets(poses))
    assert (done.counts[:, STATUSES.index(ftqp.StepStatus.OK)] < 250).any()


def test_arm_at_a_torque_limit_leaves_the_array_code(study, caplog):
    planner, _, q = study
    strong = ftqp.Planner(planner.robot, DT, level="acceleration")
    targets = circle(planner.robot, 0.08)
    limits = planner.robot.limits.tau_max
    strong.reset(q[0])
    at, v, most = q[0], np.zeros(7), 0.0
    for k in range(len(targets)):
        step = strong.step(at, v, targets.at(k))
        at, v, most = step.q.copy(), step.v.copy(), max(most, abs(step.tau[1]) / limits[1])
    planner = ftqp.Planner(planner.robot, DT, level="acceleration")
    free, weak = (
        both(planner, q[:2], targets, faults=[(ftqp.Degraded(1, torque=share), 10)] * 2)
        for share in (1.1 * most, 0.96 * most)
    )
    assert np.abs(weak.q - free.q).max() > 1e-4, "the limit is met"
    assert share_by_arrays(caplog) > 0.3


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
def test_seats_after_a_stretch_of_array_code_are_those_of_the_kernel(study, level):
    from ftqp.control.batch.jax.array_batch import CHUNK, _Stretches
    from ftqp.control.batch.own_faults import OwnFaults
    from ftqp.kernel.entry.rollouts import Batch, drive_on, seats_of
    from ftqp.qp.dtrnn.jax.arrays import double

    planner, targets, q = study
    robot = planner.robot
    moving, standing = part_of(targets, 200), part_of(targets, 200)
    standing.packed[:] = ftqp.Targets(robot.pose(robot.neutral)[None]).packed
    what_ifs = ftqp.Planner(robot, DT, level=level).what_ifs()
    faults = [*((ftqp.Locked(k, deceleration=5e-3), 50) for k in (0, 4, 6)), None, None]
    who, q = np.arange(5), q[[0, 4, 6, 7, 10]]
    for given, told in ((moving, faults), (standing, None)):
        own = OwnFaults(told, 5, robot, what_ifs)
        batch = Batch.of(q.copy(), np.zeros_like(q), given.packed, *own.of(who), 0)
        kernel = seats_of(what_ifs.session, 5)
        for _ in range(2):
            drive_on(what_ifs.session, batch, own.beliefs, who, kernel, CHUNK, threads=1)
        assert (kernel["tick"] == 1 + CHUNK).all(), "ready for array code"
        arrays = kernel.copy()
        drive_on(what_ifs.session, batch, own.beliefs, who, kernel, CHUNK, threads=1)
        with double():
            stretches = _Stretches(what_ifs.session.K, batch, arrays)
            stretches.advance(who, 1 + CHUNK, 1 + 2 * CHUNK)
        arrays["anchor"] = stretches.targets.anchors[1 + 2 * CHUNK]
        for name in kernel.dtype.names:
            np.testing.assert_allclose(arrays[name], kernel[name], rtol=0.0, atol=OFF, err_msg=name)
        if given is moving:
            assert (np.abs(kernel["lock_velocity"][1:3]).sum(axis=1) > 1e-3).all(), "they brake on"
        else:
            assert (kernel["stood"] > 0.1).all()


@pytest.mark.parametrize(
    "settings",
    [
        {"scheme": "dlsm", "level": "acceleration"},
        {"task": ftqp.Task(mode="scaled"), "level": "velocity"},
        {"task": ftqp.Task(damping=ftqp.DirectionalDamping()), "level": "velocity"},
    ],
)
def test_planner_without_common_ticks_goes_through_compiled_code(study, caplog, settings):
    planner, targets, q = study
    both(ftqp.Planner(planner.robot, DT, **settings), q[:2], targets)
    assert "array code" not in caplog.text or share_by_arrays(caplog) == 0.0


def test_joint_that_swings_freely_sends_its_arm_alone_through_compiled_code(study, caplog):
    planner, targets, q = study
    both(planner, q[:3], targets, faults=[None, (ftqp.FreeSwinging(5, damping=0.5), 30), None])
    assert share_by_arrays(caplog) > 0.8, "of the arms beside it"


def test_interrupt_is_heard_between_two_stretches(study):
    planner, targets, q = study
    before = threading.active_count()

    def interrupt(*_):
        """What Ctrl-C raises there; a signal may be ignored, or heard in a garbage collection of pytest's."""
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ftqp.batch.rollout(planner, q, targets=targets, engine="jax", progress=interrupt)
    assert threading.active_count() == before


def chain(rng, n):
    """Constants of a random arm, of which some joints slide."""
    spin = np.linalg.qr(rng.normal(size=(n + 1, 3, 3)))[0]
    spin *= np.linalg.det(spin)[:, None, None]
    root = rng.normal(size=(n, 3, 3))
    return dict(
        rotation=spin[:n], translation=rng.normal(size=(n, 3)), mass=rng.uniform(1.0, 3.0, n),
        com=rng.normal(size=(n, 3)), inertia=root @ np.swapaxes(root, 1, 2), prismatic=np.arange(n) % 3 == 1,
        continuous=np.zeros(n, dtype=bool), tip_rotation=spin[n], tip_translation=rng.normal(size=3),
        gravity=np.array([0.3, -0.2, -9.0]), armature=rng.uniform(0.0, 0.2, n),
        viscous=rng.uniform(0.0, 1.0, n),
    )  # fmt: skip


def test_kinematics_and_torques_are_those_of_the_kernel():
    from ftqp.control.batch.jax.array_dynamics import torques
    from ftqp.control.batch.jax.array_facts import Arm
    from ftqp.control.batch.jax.array_kinematics import frames, motion
    from ftqp.qp.dtrnn.jax.arrays import double, jit

    rng, n = np.random.default_rng(11), 6
    constants = chain(rng, n)
    session, own = Session(n), ArmSession(constants)
    load_chain(session.K, **constants)
    q, v, a = rng.normal(size=(3, 4, n))

    def seen(arm, q, v, a):
        at = frames(arm, q)
        return at.o_tip, at.R_tip, at.J, motion(arm, at, v, 0.0 * v).tip, torques(arm, at, v, a)

    with double():
        tips, turns, J, drift, tau = (np.asarray(part) for part in jit(seen)(Arm.of(session.K), q, v, a))
    for k in range(4):
        own.dynamics(q[k], v[k])
        found = own.K.kinematics
        np.testing.assert_allclose(tips[k], found.o_tip, atol=1e-12)
        np.testing.assert_allclose(turns[k].ravel(), found.R_tip, atol=1e-12)
        np.testing.assert_allclose(J[k], found.J[:, :n], atol=1e-12)
        np.testing.assert_allclose(drift[k], found.drift, atol=1e-10)
        np.testing.assert_allclose(tau[k], found.M[:n, :n] @ a[k] + found.h[:n], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "level", "task"),
    [
        ("panda", "velocity", ftqp.Task(priority="position_first")),
        ("panda", "acceleration", ftqp.Task(rows="position_axis", axis=(1.0, 1.0, 0.0))),
        ("sliding", "acceleration", ftqp.Task(rows=("x", "z", "rz"))),
    ],
)
def test_error_rows_and_curvature_are_those_of_the_kernel(name, level, task):
    from ftqp.control.batch.jax.array_calm import curvature_bound, needs_no_calm
    from ftqp.control.batch.jax.array_facts import Arm, Kind
    from ftqp.control.batch.jax.array_kinematics import frames
    from ftqp.control.batch.jax.array_rows import pose_error, rows
    from ftqp.kernel.arm import kinematics
    from ftqp.kernel.arm import pose_error as errors
    from ftqp.kernel.calm.curvature import curvature, weigh_rows
    from ftqp.kernel.feedback.gap import norms
    from ftqp.kernel.rows import objective, task_rows
    from ftqp.qp.dtrnn.jax.arrays import double, jit

    robot, rng = robot_of(name), np.random.default_rng(2)
    n = robot.nv
    planner = ftqp.Planner(robot, DT, level=level, task=task, scheme="rmp", posture=robot.neutral + 0.1)
    K = planner.what_ifs().session.K
    at, v = robot.neutral + rng.uniform(-0.3, 0.3, n), rng.uniform(-0.3, 0.3, n)
    targets = ftqp.Targets(robot.pose(at + 0.05)[None], rng.normal(size=(1, 6)), rng.normal(size=(1, 6)))
    K.faults.order[:n], K.faults.working, K.faults.movable = np.arange(n), n, n
    K.state.q[:n], K.state.v[:n], K.task.target[:] = at, v, targets.packed[0]
    kinematics.forward_kinematics(K)
    kinematics.motion(K)
    errors.pose_error(K)
    K.task.position_error, K.task.rotation_error = norms(K, K.task.error)
    objective.uncoupled_objective(K)
    task_rows.task_rows(K, K.task.kp)
    task_rows.compliance(K, K.task.slack_ratio)
    weigh_rows(K)
    kind, m = Kind.of(K, False), int(K.task.m)
    G = K.calm.A[:m, :n] @ K.calm.A[:m, :n].T

    def seen(arm, limits, state, target):
        frame = frames(arm, state.q)
        error = pose_error(kind, arm, frame, target)
        own = rows(kind, arm, frame, state, error, target)
        bound = curvature_bound(kind, arm, limits, frame, error)
        return error, own, bound, needs_no_calm(kind, arm, limits, frame, state, error, own)

    limits, state = inside(K, n)
    with double():
        error, own, bound, calm = jit(seen)(Arm.of(K), limits, state, targets.packed[0])
    np.testing.assert_allclose(error.along[0], K.task.error, atol=1e-12)
    assert error.near.all()
    np.testing.assert_allclose(error.position, [K.task.position_error], atol=1e-12)
    np.testing.assert_allclose(error.rotation, [K.task.rotation_error], atol=1e-12)
    np.testing.assert_allclose(own.A[0], K.qp.A[:m, :n], atol=1e-12)
    np.testing.assert_allclose(own.b[0], K.qp.b[:m], atol=1e-11)
    np.testing.assert_allclose(own.soft[0], K.qp.soft[:m], rtol=1e-12)
    np.testing.assert_allclose(own.g[0], K.qp.g[:n], atol=1e-12)
    np.testing.assert_allclose(own.H, K.qp.H_diagonal[:n], rtol=1e-12)
    s = curvature(K)
    bound = float(bound[0])
    assert s <= bound <= 1.3 * s
    assert bool(calm[0]) == (np.linalg.eigvalsh(G)[0] > bound)


def inside(K, n):
    """Limits and state of one arm whose joints work, away from their limits."""
    from ftqp.control.batch.jax.array_facts import Limits, State

    whole = np.full((1, n), 100.0)
    limits = dict.fromkeys(Limits._fields, whole) | {"works": whole / 100.0, "q_min": -whole}
    state = dict.fromkeys(State._fields, np.zeros(1)) | {"q": K.state.q[None, :n], "v": K.state.v[None, :n]}
    return Limits(**limits), State(**state)


def test_thresholds_are_those_of_the_kernel():
    from ftqp.control.batch.jax import array_bounds, array_calm, array_qp, array_rows, targets_ahead
    from ftqp.kernel.active_set import active_set, working_set
    from ftqp.kernel.arm import pose_error
    from ftqp.kernel.calm import rest, trigger
    from ftqp.kernel.judge import ladder
    from ftqp.kernel.lanes import regular
    from ftqp.kernel.maths import trigonometry

    assert array_bounds.REDUCED == trigonometry.REDUCED
    assert pytest.approx(array_calm.AWAY) == trigger.NEAR + trigger.STEP
    assert array_calm.BEND == regular.BEND
    assert array_rows.NEAR == pose_error.NEAR
    for name in ("STANDS_WITHIN", "STANDS_BELOW"):
        assert getattr(targets_ahead, name) == getattr(rest, name)
    for name, module in (
        ("DEPENDENT", working_set),
        ("REFINE_FROM", working_set),
        ("REFINEMENTS", active_set),
        ("RELAXED_FROM", ladder),
        ("TASK_FLOOR", ladder),
    ):
        assert getattr(array_qp, name) == getattr(module, name)


def test_memory_counts_what_array_code_keeps_beside(study):
    planner, *_ = study
    least = ftqp.batch.memory(planner, 1000, 100)
    assert 500e3 < ftqp.batch.memory(planner, 1000, 100, engine="jax") - least < 2e6


def test_unknown_engine_is_refused_with_the_nearest(study):
    planner, targets, q = study
    with pytest.raises(
        InputError, match=r"engine is 'jacks' \(did you mean 'jax'\?\), expected one of numba"
    ):
        ftqp.batch.rollout(planner, q, targets=targets, engine="jacks")


def test_jax_stays_in_single_precision_for_everybody_else(study):
    import jax
    import jax.numpy as jnp

    planner, targets, q = study
    before = jax.config.jax_enable_x64
    ftqp.batch.rollout(planner, q[0], targets=targets, engine="jax")
    assert jax.config.jax_enable_x64 == before
    assert jnp.zeros(1).dtype == (jnp.float64 if before else jnp.float32)


def test_missing_jax_is_named_with_its_remedy():
    code = (
        "import sys; sys.modules['jax'] = None\n"
        "import ftqp\n"
        "robot = ftqp.robots.load('panda')\n"
        "targets = ftqp.Targets([robot.pose(robot.neutral)])\n"
        "planner = ftqp.Planner(robot, level='velocity')\n"
        "try: ftqp.batch.rollout(planner, robot.neutral, targets=targets, engine='jax')\n"
        "except ftqp.MissingPackage as error: sys.stdout.write(str(error))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert remedy_for_extra("gpu") in done.stdout, done.stderr
