"""N-1 on line: what the lock of each joint would cost, and a null space that is led by it."""

import os
import signal
import subprocess
import sys
from time import sleep

import numpy as np
import pytest
from tests.going import closed_loop, targets_along

import ftqp
from ftqp.core.errors import InputError

PANDA = ftqp.robots.load("panda")
DT = 4e-3


def path():
    goal = PANDA.pose(PANDA.neutral)
    goal[:3, 3] += [0.1, -0.15, -0.1]
    return ftqp.paths.PointToPoint(PANDA.pose(PANDA.neutral), goal, duration=2.0)


def followed(planner, line=None, seconds=1.0, faults=()):
    """Joints and speeds at every tick, and what was foretold at each."""
    planner.reset(PANDA.neutral)
    for fault in faults:
        planner.report(fault)
    planner.foresee(line)
    targets = targets_along(path(), 1 if line is None else 600, DT)
    rows, told = [(PANDA.neutral.copy(), np.zeros(7))], []
    at = lambda k: targets.at(min(k, len(targets) - 1))  # noqa: E731
    for step in closed_loop(planner, at, round(seconds / DT), reset=False):
        rows.append((step.q.copy(), step.v.copy()))
        told.append(planner.security)
    return rows[:-1], told


def planner_with(**given):
    return ftqp.Planner(PANDA, DT, n_minus_one=ftqp.NMinusOne(**{"horizon": 1.0, "waits": True} | given))


def test_what_is_foretold_of_each_lock_is_what_happens():
    line, planner = path(), planner_with()
    rows, told = followed(planner, line)
    security = told[-1]
    assert security.tick > 0 and [loss.joint for loss in security.losses] == list(PANDA.joints)
    q, v = rows[security.tick]
    sample = line.sample(np.minimum(DT * (security.tick + np.arange(250)), line.duration))
    done = ftqp.batch.rollout(
        ftqp.Planner(PANDA, DT, scheme="rmp", task=ftqp.Task(degrade=())), q, v,
        ftqp.Targets(sample.pose, sample.twist, sample.acceleration),
        faults=[ftqp.Locked(joint) for joint in PANDA.joints], threads=1,
    )  # fmt: skip
    foretold = np.array([loss.position_error for loss in security.losses])
    np.testing.assert_allclose(foretold, done.position_error, atol=1e-9)
    lost = [loss for loss in security.losses if not loss.survived]
    assert lost and 0.0 <= lost[0].after < 1.0 and lost[0].joint in security.sentence


def test_the_same_ticks_have_the_same_answers():
    (one, first), (two, second) = (followed(planner_with(), path(), 0.5) for _ in range(2))
    assert first[-1] == second[-1]
    np.testing.assert_array_equal(one[-1][0], two[-1][0])


def test_the_null_space_is_led_and_the_tip_is_not():
    rows, _ = followed(planner_with(), path(), 1.5)
    other, _ = followed(planner_with(leads=False), path(), 1.5)
    assert np.abs(rows[-1][0] - other[-1][0]).max() > 1e-3
    assert np.abs(PANDA.pose(rows[-1][0]) - PANDA.pose(other[-1][0])).max() < 1e-4


def test_an_arm_at_rest_stays_at_rest():
    rows, told = followed(planner_with(), None, 1.5)
    assert np.abs(rows[-1][1]).max() < 1e-6
    assert told[-1].survived == 1.0 and "any one joint may lock" in told[-1].sentence


def test_after_a_failure_the_next_one_is_looked_at():
    _, told = followed(planner_with(), path(), 0.5, faults=[ftqp.Locked(2)])
    assert [loss.joint for loss in told[-1].losses] == [name for i, name in enumerate(PANDA.joints) if i != 2]


def test_a_follower_says_itself_what_it_follows():
    planner = ftqp.Planner(
        PANDA, DT, task=ftqp.Task(mode="scaled"), n_minus_one=ftqp.NMinusOne(horizon=1.0, waits=True)
    )
    *_, _ = closed_loop(ftqp.PathFollower(planner, path()), None, 200)
    assert planner.security.survived < 1.0


def test_nothing_that_is_measured_ends_the_look_ahead():
    planner = planner_with()
    planner.reset(PANDA.neutral)
    target = ftqp.Target(pose=PANDA.pose(PANDA.neutral))
    for k in range(60):
        q = np.full(7, np.nan) if 20 < k < 25 else PANDA.neutral
        assert np.isfinite(planner.step(q, None, target).q).all()
    assert planner.security is not None


def test_a_look_that_takes_more_than_the_budget_is_the_same_and_older():
    (_, whole), (_, parts) = (
        followed(planner_with(budget=budget), path(), 0.9) for budget in (25_000, 1_500)
    )
    first = next(one for one in parts if one is not None)
    assert first.losses == next(one for one in whole if one is not None).losses
    assert 0.0 < whole[-1].age < 0.11 < parts[-1].age < 0.5
    assert f"as of {parts[-1].age:.2g} s ago" in parts[-1].sentence


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
@pytest.mark.parametrize("waits", [False, True])
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_goes_on_looking(waits):
    planner = planner_with(waits=waits)
    planner.reset(PANDA.neutral)
    target = ftqp.Target(pose=PANDA.pose(PANDA.neutral))
    planner.step(PANDA.neutral, None, target)  # a look is under way
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        for _ in range(2000):
            planner.step(PANDA.neutral, None, target)
            if planner.security is not None and planner.security.tick > 0:
                os._exit(7)
            sleep(0.0 if waits else 1e-3)
        os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7


@pytest.mark.slow
@pytest.mark.long
def test_a_cloud_that_comes_and_goes_while_it_is_looked_at_ends_nothing():
    code = """
import gc, numpy as np, ftqp
robot = ftqp.robots.load("panda")
scene = ftqp.Scene()
planner = ftqp.Planner(robot, 4e-3, scene=scene, n_minus_one=ftqp.NMinusOne(horizon=0.2, rate=200.0))
planner.reset(robot.neutral)
target, rng = ftqp.Target(pose=robot.pose(robot.neutral)), np.random.default_rng(0)
for k in range(1500):
    count = 4000 if k % 3 else 0
    scene.update(np.column_stack([rng.uniform(0.8, 1.2, (count, 3)), np.full(count, 0.01)]))
    if k % 50 == 0:
        scene.add(f"{k}", ftqp.Sphere(0.05, (2.0, 0.0, 0.0))); scene.remove(f"{k}")
    planner.step(robot.neutral, None, target)
    gc.collect(0)
assert planner.security is not None
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=200, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: ftqp.NMinusOne(horizon=0.0), "horizon"),
        (lambda: ftqp.NMinusOne(budget=0), "budget is 0, expected a whole number >= 1"),
        (lambda: ftqp.NMinusOne(rate=1000.0), "rate is 1000, expected a number at most 200 Hz"),
        (lambda: ftqp.Planner(PANDA, scheme="mvn", n_minus_one=ftqp.NMinusOne()), "leads to no posture"),
        (lambda: ftqp.Planner(PANDA, n_minus_one=True), "ftqp.NMinusOne or None"),
        (lambda: ftqp.Planner(PANDA, backend="daqp", n_minus_one=ftqp.NMinusOne()), "active_set"),
    ],
)
def test_what_cannot_be_is_said_in_a_sentence(make, said):
    with pytest.raises(InputError, match=said):
        make()
