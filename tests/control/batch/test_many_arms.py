"""Many arms at once do what each does alone with ``planner.step``, whatever befalls the arms beside it."""

import logging
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from tests.arm_at import arm_at
from tests.going import targets_along

import ftqp
from ftqp.core.errors import InputError

DT, TICKS, ARMS = 2e-3, 300, 11
STATUSES = list(ftqp.StepStatus)


def circle(robot, radius=0.03):
    return targets_along(ftqp.paths.Circle(robot.pose(robot.neutral), radius, duration=3.0), TICKS, DT)


def robot_of(name):
    """An arm of the catalog, or one whose third and fifth joints slide."""
    if name != "sliding":
        return ftqp.robots.load(name)
    table = [
        (0.0, 0.3, 0.0, 1.2), (0.3, 0.1, 0.3, -0.9), (0.2, 0.2, 0.0, 1.5), (0.5, 0.1, 0.2, -1.1),
        (-0.4, 0.15, 0.1, 0.8), (0.3, 0.1, 0.05, 0.3), (0.2, 0.1, 0.1, -1.0),
    ]  # fmt: skip
    limits = {"q_min": -3.0, "q_max": 3.0, "v_max": 2.0}
    return ftqp.Robot.from_dh(table, limits=limits, acceleration=8.0, prismatic=(2, 4))


def starts(robot, spread=1e-3):
    return robot.neutral + spread * np.random.default_rng(5).normal(size=(ARMS, robot.nv))


def faults_of(robot):
    """A fault an arm, of every kind but a free joint: none, late, two, after the end, at once ..."""
    n = robot.nv
    return [
        None,
        ftqp.Locked(0),
        (ftqp.Locked(2 % n, deceleration=1.0), 40),
        [(ftqp.Locked(1), 60), (ftqp.Locked(n - 1), 61)],
        (ftqp.Locked(n - 2, mode="instant"), 100),
        (ftqp.Degraded(1, velocity=0.2), 50),
        (ftqp.Degraded(2 % n, torque=0.6), 50),
        (ftqp.Locked(1), TICKS + 5),
        [(ftqp.Locked(n - 1), 200), (ftqp.Degraded(0, acceleration=0.3), 20)],
        (ftqp.Locked(robot.joints[n - 1], mode="instant"), 0),
        (ftqp.Locked(2 % n), TICKS - 1),
    ]


OFF_Q, OFF_V = 1e-11, 1e-10
"""Rounding, grown over the ticks; a wrong tick shows at 1e-7."""


def alone(planner_of, robot, q, entry, targets):
    """The same arm tick by tick: final q, v, largest errors, ticks per status, the first that was not OK.

    It goes on from the reference, as a batch does: what a failed joint is sent is not where it is believed
    to be.
    """
    planner, v = planner_of(), np.zeros(robot.nv)
    entry = [] if entry is None else entry if isinstance(entry, list) else [entry]
    told = [one if isinstance(one, tuple) else (one, 0) for one in entry]
    planner.reset(q)
    counts, worst, bad = np.zeros(len(STATUSES), dtype=int), np.zeros(2), -1
    for k in range(len(targets)):
        for fault, at in told:
            if at == k:
                planner.report(fault)
        step = planner.step(q, v, targets.at(k))
        q, v, _ = (part.copy() for part in step.reference)
        counts[STATUSES.index(step.status)] += 1
        if bad < 0 and step.status is not ftqp.StepStatus.OK:
            bad = k
        worst = np.maximum(worst, (step.position_error, step.rotation_error))
    return q, v, worst, counts, bad


def as_alone(planner_of, q, faults, targets, planner=None):
    """A rollout in which every arm does what it does alone."""
    done = ftqp.batch.rollout(planner or planner_of(), q, targets=targets, faults=faults)
    robot = planner_of().robot
    for arm in range(len(q)):
        own = alone(planner_of, robot, q[arm], faults[arm], targets)
        np.testing.assert_allclose(done.q[arm], own[0], rtol=0.0, atol=OFF_Q, err_msg=f"q of arm {arm}")
        np.testing.assert_allclose(done.v[arm], own[1], rtol=0.0, atol=OFF_V, err_msg=f"v of arm {arm}")
        found = done.position_error[arm], done.rotation_error[arm]
        np.testing.assert_allclose(found, own[2], rtol=0.0, atol=1e-10)
        np.testing.assert_array_equal(done.counts[arm], own[3], err_msg=f"statuses of arm {arm}")
        assert done.first_bad[arm] == own[4], f"first bad tick of arm {arm}"
    return done


def test_every_arm_moves_as_a_planner_moves_it(level):
    robot = ftqp.robots.load("panda")

    def planner_of():
        return ftqp.Planner(robot, DT, level=level)

    q, faults, targets = starts(robot), faults_of(robot), circle(robot)
    done = as_alone(planner_of, q, faults, targets)
    assert (done.counts.sum(axis=1) == TICKS).all()
    assert done.share(ftqp.StepStatus.OK)[0] > 0.9, "an arm without a fault keeps its task"
    assert done.v[2, 2] == 0.0, "a locked joint rests"


def test_a_weak_joint_is_kept_where_it_can_hold_the_arm_as_a_planner_keeps_it(level):
    robot = ftqp.robots.load("panda")
    q, targets = starts(robot), circle(robot, radius=0.1)
    held = abs(arm_at(robot, robot.neutral, np.zeros(7)).h)
    weak = [ftqp.Degraded(j, torque=1.07 * held[j] / robot.limits.tau_max[j]) for j in (1, 3, 5)]
    weak = [weak[k % 3] for k in range(ARMS)]

    def planner_of():
        return ftqp.Planner(robot, DT, level=level, task=ftqp.Task(rows="position"))

    done = as_alone(planner_of, q, weak, targets)
    free = ftqp.batch.rollout(planner_of(), q, targets=targets)
    assert np.abs(done.q - free.q).max() > 1e-3, "the rows are in its way"


@pytest.mark.parametrize(
    ("name", "level", "settings"),
    [
        ("iiwa14", "velocity", {"task": ftqp.Task(mode="hard")}),
        ("planar6", "velocity", {}),
        ("sliding", "acceleration", {}),
        ("puma560", "acceleration", {"task": ftqp.Task(rows="position"), "torque_limits": False}),
        ("panda", "velocity", {"task": ftqp.Task(rows="position_axis")}),
        ("panda", "velocity", {"task": ftqp.Task(mode="scaled")}),
        ("panda", "velocity", {"task": ftqp.Task(mode="lexicographic")}),
        ("panda", "acceleration", {"task": ftqp.Task(damping=ftqp.DirectionalDamping())}),
        ("panda", "acceleration", {"bounds": "one_step"}),
        ("panda", "velocity", {"task": ftqp.Task(calm=False), "emergency": None}),
    ],
)
def test_law_holds_for_other_robots_tasks_and_schemes(name, level, settings):
    robot = robot_of(name)
    q = starts(robot, 1e-2)[:6]

    def planner_of():
        planner = ftqp.Planner(robot, DT, level=level, posture=robot.neutral, **settings)
        planner.reset(robot.neutral)
        return planner

    faults, targets = faults_of(robot)[:6], circle(robot, 0.02)
    as_alone(planner_of, q, faults, targets)


@pytest.mark.parametrize(
    ("scheme", "level"), [("rmp", "velocity"), ("rmp", "acceleration"), ("dlsm", "velocity")]
)
def test_arms_of_a_planner_without_a_posture_return_each_to_its_own_start(scheme, level):
    """Three starts, two of them twice, and a planner that has been reset elsewhere."""
    robot = ftqp.robots.load("panda")

    def planner_of():
        return ftqp.Planner(robot, DT, level=level, scheme=scheme)

    elsewhere = planner_of()
    elsewhere.reset(robot.neutral + 0.3)
    q, targets = starts(robot, 0.1)[[0, 1, 0, 2, 1]], circle(robot, 0.02)
    faults = [None, None, (ftqp.Locked(2), 40), None, (ftqp.Degraded(1, velocity=0.2), 50)]
    for planner in (planner_of(), elsewhere):
        as_alone(planner_of, q, faults, targets, planner)


@pytest.fixture(scope="module")
def study():
    """A Panda's planner, targets and starts."""
    robot = ftqp.robots.load("panda")
    return ftqp.Planner(robot, DT, level="velocity"), circle(robot), starts(robot)


def test_threads_neighbours_and_order_change_nothing(study):
    planner, targets, q = study
    faults = faults_of(planner.robot)
    one = ftqp.batch.rollout(planner, q, targets=targets, faults=faults, threads=1)
    three = ftqp.batch.rollout(planner, q, targets=targets, faults=faults, threads=3)
    back = ftqp.batch.rollout(planner, q[::-1], targets=targets, faults=faults[::-1])
    single = ftqp.batch.rollout(planner, q[4], targets=targets, faults=faults[4:5])
    np.testing.assert_array_equal(one.q, three.q)
    np.testing.assert_array_equal(one.q, back.q[::-1])
    np.testing.assert_array_equal(one.q[4], single.q[0])


def test_start_that_is_no_number_harms_no_other_arm(study):
    planner, targets, q = study
    faults = faults_of(planner.robot)
    good = ftqp.batch.rollout(planner, q, targets=targets, faults=faults)
    broken, v = q.copy(), np.zeros_like(q)
    broken[3, 2], v[6, 0] = np.nan, np.inf
    done = ftqp.batch.rollout(planner, broken, v, targets, faults=faults)
    others = [arm for arm in range(ARMS) if arm not in (3, 6)]
    np.testing.assert_array_equal(done.q[others], good.q[others])
    assert np.isnan(done.q[[3, 6]]).all()
    assert (done.counts[[3, 6], STATUSES.index(ftqp.StepStatus.INVALID_INPUT)] == TICKS).all()


def test_beliefs_of_the_planner_hold_for_every_arm(study):
    planner, targets, q = study
    told = ftqp.Planner(planner.robot, DT, level="velocity")
    told.report(ftqp.Locked(3))
    by_planner = ftqp.batch.rollout(told, q[:2], targets=targets)
    by_fault = ftqp.batch.rollout(planner, q[:2], targets=targets, faults=[ftqp.Locked(3)] * 2)
    np.testing.assert_allclose(by_planner.q, by_fault.q, rtol=0.0, atol=1e-12)


def test_arms_rest_at_a_target_that_stands_and_go_on_when_it_leaves(study):
    planner, _, q = study
    robot, faults = planner.robot, [None, (ftqp.Locked(1), 400), None]
    poses = np.repeat(robot.pose(robot.neutral)[None], 900, axis=0)
    poses[600:, 0, 3] += 5.0  # out of reach

    def planner_of():
        return ftqp.Planner(robot, DT, level="velocity", emergency=None)

    targets = ftqp.Targets(poses)
    done = as_alone(planner_of, q[:3], faults, targets)
    assert (done.counts[:, STATUSES.index(ftqp.StepStatus.RELAXED)] > 200).all()


INTERRUPTED = """
import _thread, time
import numpy as np
import ftqp
from ftqp.kernel.entry import session

# The more often the main thread wakes, the surer the signal finds it between two waits, where locks are held.
session.POLL = 1e-4
planner = ftqp.Planner(ftqp.robots.load("panda"), 2e-3, level="velocity")
q = np.repeat(planner.robot.neutral[None], 5_000, axis=0)
still = ftqp.Targets(np.repeat(planner.robot.pose(planner.robot.neutral)[None], 500_000, axis=0))
ftqp.batch.rollout(planner, q, targets=ftqp.Targets(still.packed[:2, :16].reshape(-1, 4, 4)))
before = _thread._count()
print("rolling", flush=True)
try:
    ftqp.batch.rollout(planner, q, targets=still)
except KeyboardInterrupt:
    time.sleep(0.2)
    print("interrupted, threads left:", _thread._count() - before, flush=True)
"""


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for another process")
def test_interrupt_stops_all_threads_within_a_moment():
    """In a process of its own: a Ctrl-C in this one may fall into pytest's code or a garbage collection's."""
    process = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Shells start what runs in the background with Ctrl-C ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stdout.readline() == "rolling\n", process.stderr.read()
    time.sleep(0.1)
    begin = time.monotonic()
    process.send_signal(signal.SIGINT)
    try:
        stdout, stderr = process.communicate(timeout=60)
    finally:
        process.kill()
    assert time.monotonic() - begin < 20.0, "2.5e9 ticks would take minutes"
    assert stdout == "interrupted, threads left: 0\n", stderr
    assert process.returncode == 0


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"q": np.zeros((3, 6))}, r"q has shape \(3, 6\), expected \(B, nv\) = \(B, 7\)"),
        ({"q": [[0.0] * 7, [0.0] * 6]}, r"q is no array of numbers .* every arm of the same size"),
        ({"q": "home"}, "q is no array of numbers"),
        ({"targets": np.zeros((4, 4))}, r"targets is of type ndarray, expected ftqp.Targets\(poses,"),
        ({"faults": [None]}, "faults has 1 entries, expected one for each of 11 arms"),
        ({"faults": ftqp.Locked(0)}, "expected a list with one entry an arm"),
        ({"faults": ["lock"] + [None] * 10}, r"faults\[0\] is 'lock', expected None, a fault"),
        ({"faults": [(ftqp.Locked(0), -1)] + [None] * 10}, "fault of arm 0 is at tick -1, expected a whole"),
        ({"faults": [(ftqp.Locked(0), 1.5)] + [None] * 10}, "fault of arm 0 is at tick 1.5, expected a"),
        ({"faults": [ftqp.Locked(9)] + [None] * 10}, "9"),
        ({"every": 0}, "every is 0, expected a whole number from 1"),
        ({"planner": None}, "planner is of type NoneType, expected an ftqp.Planner"),
    ],
)
def test_wrong_input_is_refused_with_one_sentence(study, given, sentence):
    planner, targets, q = study
    with pytest.raises(InputError, match=sentence):
        ftqp.batch.rollout(**({"planner": planner, "q": q, "targets": targets} | given))


def test_starts_in_degrees_are_noticed_and_a_share_is_of_a_status(study, caplog):
    planner, targets, q = study
    done = ftqp.batch.rollout(planner, q, targets=targets)
    assert "degrees" not in caplog.text
    with pytest.raises(InputError, match=r"status is 'OK', expected an ftqp\.StepStatus"):
        done.share("OK")
    ftqp.batch.rollout(planner, np.rad2deg(planner.robot.neutral), targets=targets)
    assert "arm 0 starts with panda_joint2 at -45, beyond its range" in caplog.text


def test_a_fault_after_the_end_is_said(study, caplog):
    planner, targets, q = study
    joint, faults = planner.robot.joints[3], [None] * len(q)
    faults[0] = (ftqp.Locked(joint), len(targets) - 1)
    ftqp.batch.rollout(planner, q, targets=targets, faults=faults)
    assert "never reached" not in caplog.text
    faults[1] = (ftqp.Locked(joint), len(targets))
    ftqp.batch.rollout(planner, q, targets=targets, faults=faults)
    assert f"1 of 2 faults are reported at tick {len(targets)} or later" in caplog.text


def test_planners_that_are_not_compiled_as_a_whole_are_refused(study):
    planner, targets, q = study
    for settings, sentence in (
        ({"backend": "osqp"}, "solved by 'osqp', expected the backend 'active_set'"),
        ({"backend": "dtrnn"}, "solved by 'dtrnn'"),
    ):
        other = ftqp.Planner(planner.robot, DT, level="velocity", **settings)
        with pytest.raises(InputError, match=sentence):
            ftqp.batch.rollout(other, q, targets=targets)


PANDA = ftqp.robots.load("panda")


def free(joint):
    return ftqp.FreeSwinging(joint, damping=1.0)


def test_rows_are_given_up_beside_a_free_joint_without_gravity(level, caplog):
    """The first joint of a Panda that stands upright, on a circle that six joints cannot follow."""
    q, faults = starts(PANDA)[:3], [(free(0), 60), None, (free(0), 0)]
    targets = targets_along(ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=1.0), 200, 5e-3)

    def planner_of():
        return ftqp.Planner(PANDA, 5e-3, level=level)

    caplog.set_level(logging.WARNING, logger="ftqp")
    ftqp.batch.rollout(planner_of(), q, targets=targets, faults=faults)
    assert not caplog.records
    as_alone(planner_of, q, faults, targets)
    assert "the task stays infeasible: the attitude is given up" in caplog.messages


def test_fault_told_while_a_joint_swings_has_everything_decided_anew(level):
    q, targets = starts(PANDA)[:5], circle(PANDA, 0.05)
    faults = [
        [(free(2), 50), (ftqp.Degraded(0, velocity=0.5), 80)],
        [(free(5), 50), (ftqp.Locked(1), 120)],
        [(free(3), 50), (free(5), 90)],
        [(free(3), 50), (ftqp.Locked(3), 51)],
        [(ftqp.Locked(1), 50), (free(5), 50)],
    ]

    def planner_of():
        return ftqp.Planner(PANDA, DT, level=level)

    as_alone(planner_of, q, faults, targets)


def test_arms_of_both_ways_are_one_result(caplog):
    """With a start that is no number, kept positions, progress, and nothing on the logger."""
    q, v, seen = starts(PANDA)[:4], np.zeros((4, 7)), []
    v[2, 1] = np.nan
    faults = [(free(0), 20), None, (free(0), 20), (free(6), 20)]
    done = ftqp.batch.rollout(
        ftqp.Planner(PANDA, DT),
        q,
        v,
        circle(PANDA),
        faults=faults,
        every=TICKS,
        progress=lambda *pair: seen.append(pair),
    )
    assert seen[-1] == (4, 4) and seen == sorted(seen)
    assert (
        np.isnan(done.q[2]).all() and done.counts[2, STATUSES.index(ftqp.StepStatus.INVALID_INPUT)] == TICKS
    )
    np.testing.assert_array_equal(done.trace[[0, 1, 3], 0], done.q[[0, 1, 3]])
    assert (done.counts.sum(axis=1) == TICKS).all() and not caplog.records


def test_arms_that_a_planner_steps_have_its_tasks_and_constraints_too(panda):
    weightless = panda.with_gravity((0.0, 0.0, 0.0)) if hasattr(panda, "with_gravity") else panda
    target = np.tile(weightless.pose(weightless.neutral), (300, 1, 1))
    elbow = ftqp.PositionTask("panda_joint4", target=(0.0, 0.3, 0.6), weight=100.0, name="elbow")
    ends = []
    for tasks in ((), (elbow,)):
        planner = ftqp.Planner(weightless, 2e-3, task=ftqp.Task(rows="position"), tasks=tasks)
        fault = ftqp.FreeSwinging(0, 1.0)
        done = ftqp.batch.rollout(planner, weightless.neutral, targets=ftqp.Targets(target), faults=[fault])
        planner.reset(weightless.neutral)
        planner.report(fault)
        q, v = weightless.neutral.copy(), np.zeros(7)
        for k in range(300):
            step = planner.step(q, v, ftqp.Targets(target).at(k))
            q, v, _ = (part.copy() for part in step.reference)
        np.testing.assert_allclose(done.q[0], q, atol=1e-12)
        ends.append(q)
    assert np.abs(ends[0] - ends[1]).max() > 1e-3
