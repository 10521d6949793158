"""Defects that are planted into the kernel, and alarms of detectors, are found by the checker."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.checker.panda_runs import ARM, ROBOT, trace_of
from tests.going import closed_loop, targets_along

import ftqp
from ftqp.checker.alarms import Alarm, detection
from ftqp.checker.checked_run import verdict
from ftqp.checker.trace import KINEMATIC, PHYSICS, Failure, Plane

DT, MOVES, LASTS = 1e-3, 1.5, 9.0
T = DT * np.arange(round(LASTS / DT) + 1)
J = 3
"""The joint that is shown with a defect."""
LOCK = 0.7
"""When that joint locks, where one does [s]."""


@pytest.fixture(scope="module")
def sound():
    """A Panda on a circle of 1.5 s, which then rests; the arm does what it is told."""
    planner = ftqp.Planner(ROBOT, DT)
    path = ftqp.paths.Circle(ROBOT.pose(ROBOT.neutral), 0.05, duration=MOVES)
    truth, said = [(ROBOT.neutral, np.zeros(ROBOT.nv))], []
    for step in closed_loop(planner, targets_along(path, len(T) - 1, DT).at, len(T) - 1):
        truth.append((step.q.copy(), step.v.copy()))
        said.append(step.status.name)
    q, v = np.array(truth)[:, 0], np.array(truth)[:, 1]
    return trace_of(
        q, v, DT, status=said, target=path.sample(T[:-1]).pose, rows=ROBOT.default_rows,
        tolerance=(planner.task.tolerance, planner.task.rotation_tolerance), can_be_followed=True,
    )  # fmt: skip


def moved(run, speeds, joint=J, **changes):
    """The run with other speeds of a joint, (K + 1,) [rad/s], and where they lead; it was sent so, too."""
    q, v = run.q.copy(), run.v.copy()
    v[:, joint] = speeds
    q[:, joint] = q[0, joint] + np.concatenate([[0.0], np.cumsum(0.5 * DT * (speeds[1:] + speeds[:-1]))])
    return replace(run, **{"q": q, "v": v, "sent_q": q[1:], "sent_v": v[1:]} | changes)


def placed(run, places, joint=J, **changes):
    """The run with a joint at other places, (K + 1,) [rad], and the speeds that belong to them."""
    q, v = run.q.copy(), run.v.copy()
    q[:, joint], v[:, joint] = places, np.gradient(places, DT)
    return replace(run, **{"q": q, "v": v, "sent_q": q[1:], "sent_v": v[1:]} | changes)


def bump(begin, end):
    """Rises from 0 to 1 and falls again, smoothly, between two times."""
    return np.where((begin < T) & (end > T), np.sin(np.pi * (T - begin) / (end - begin)) ** 2, 0.0)


def locked(run, speed=0.0, sent=0.0, at=LOCK):
    """A joint that locks, and moves or is sent on at these speeds from then on [rad/s]."""
    speeds = np.where(at + 0.05 > T, run.v[:, J], 0.0)
    k = round(at / DT)
    speeds[k : k + 51] = run.v[k, J] * np.linspace(1.0, 0.0, 51)
    change = moved(run, np.where(at + 0.05 <= T, speed, speeds))
    commands = change.sent_v.copy()
    commands[k + 50 :, J] = sent
    lock = Failure(joint=J, kind="locked", since=at, reported_at=at, deceleration=0.25 * float(ARM.a_max[J]))
    status = ["OK" if k < at / DT else "RELAXED" for k in range(len(run.status))]
    return replace(change, sent_v=commands, failures=[lock], status=status, can_be_followed=False)


def weak(run, excess, status, joint=0):
    """A joint that is known to have lost strength carries ``excess`` times what is left, at the worst."""
    tau = ARM.torques(run.q[:-1], run.v[:-1], np.diff(run.v, axis=0) / DT)
    share = float(np.abs(tau[:, joint]).max() / ARM.tau_max[joint] / excess)
    known = Failure(joint=joint, kind="degraded", since=0.0, reported_at=0.0, shares={"tau_max": share})
    return replace(run, failures=[known], status=[status] * len(run.status))


def slowed(run, gentle):
    """A joint at 0.1 of its speed limit, of which 0.05 is left from 1 s on, reached gently or fully."""
    v, a = 0.1 * ARM.v_max[J], ARM.a_max[J] * (0.2 if gentle else 1.0)
    left = np.maximum(v - a * np.clip(T - 1.0, 0.0, None), 0.5 * v)
    known = Failure(joint=J, kind="degraded", since=1.0, reported_at=1.0, shares={"v_max": 0.05})
    away = np.where(T < 1.5, 1.0, np.maximum(1.0 - 2.0 * (T - 1.5), 0.0))
    return moved(run, left * np.minimum(5.0 * T, 1.0) * away, failures=[known])


def after_a_blow(run, again):
    """Joint 3 falls to its end stop at 2 s, which throws the elbow; it is fast again 0.2 s later."""
    v, top = run.v[:, J].copy(), float(ARM.v_max[J])
    thrown = (T >= 2.0) & (T < 2.6)
    v[thrown] = np.maximum(3.0 * top - 0.999 * ARM.a_max[J] * (T[thrown] - 2.0), 0.0)
    v = v + again * top * bump(2.7, 3.2)
    fall = np.where(T < 2.0, 2.0 * np.clip(T - 1.0, 0.0, None), 0.0)
    end = float(ARM.q_max[1])
    struck = placed(moved(run, 0.0 * v), np.where(T < 2.0, end + 0.01 - (2.0 - T), end + 0.01), joint=1)
    q, speeds = struck.q.copy(), struck.v.copy()
    speeds[:, 1], speeds[:, J] = np.where(T < 2.0, fall, 0.0), v
    free = Failure(joint=1, kind="free", since=1.0, reported_at=1.0)
    return replace(struck, q=q, v=speeds, failures=[free], status=["STOPPED"] * len(run.status))


def flickering(run):
    """The tip is 15 mm off for a second, and OK is said but for one tick in fifty."""
    status = ["RELAXED" if k % 50 == 0 else "OK" for k in range(len(run.status))]
    return replace(run, target=off(run, 15e-3), status=status, can_be_followed=False)


def off(run, distance):
    """Targets that leave the tip for a second [m]."""
    target = run.target.copy()
    target[:, 0, 3] += distance * ((T[:-1] > 0.3) & (T[:-1] < 1.3))
    return target


def beyond_a_plane(run):
    """The tip, which is to stay above the lowest place of the circle, sinks below it in two seconds."""
    zero = ARM.tips(np.zeros((1, ROBOT.nv)))[0, :3, 3]
    low = float(ARM.point(run.q, 6, zero)[:, 2].min())
    plane = Plane(joint=6, at_zero=zero, normal=(0.0, 0.0, 1.0), offset=low)
    sunk = placed(run, run.q[:, 1] + 0.3 * np.clip((T - 3.0) / 2.0, 0.0, 1.0), joint=1)
    return replace(sunk, planes=[plane], status=["RELAXED"] * len(run.status))


RESTS = 4.0
"""From here on every joint rests, in both strictnesses [s]."""
UP = np.where(T > RESTS, 1.0, 0.0)
EVERY_TICK = np.where(np.arange(len(T)) % 2, 1.0, -1.0)
THIRD = np.where(np.arange(len(T)) // 2 % 2, 1.0, -1.0)

DEFECTS = {
    "a joint comes to three times its speed limit little by little": (
        "speed",
        lambda r: moved(r, 3.0 * ARM.v_max[J] * (bump(0.2, 1.2) - bump(1.3, 2.3))),
    ),
    "a joint is 5 % too fast for a while": (
        "speed",
        lambda r: moved(r, 1.05 * ARM.v_max[J] * (bump(0.2, 1.2) - bump(1.3, 2.3))),
    ),
    "a limit has shrunk and is reached at a fifth of the deceleration": ("speed", lambda r: slowed(r, True)),
    "a joint is fast again after a blow": ("speed", lambda r: after_a_blow(r, 2.0)),
    "a joint creeps half a radian past its range": (
        "position",
        lambda r: placed(r, r.q[:, J] + (ARM.q_max[J] + 0.5 - r.q[:, J]) * np.clip(T / 8.0, 0.0, 1.0)),
    ),
    "a joint stands 0.03 rad past its range": (
        "position",
        lambda r: placed(r, r.q[:, J] + (ARM.q_max[J] + 0.03 - r.q[:, J]) * np.clip(T / 4.0, 0.0, 1.0)),
    ),
    "OK is said of a joint that is past its range": (
        "inside",
        lambda r: placed(r, r.q[:, J] + (ARM.q_max[J] + 0.03 - r.q[:, J]) * np.clip(T / 4.0, 0.0, 1.0)),
    ),
    "a joint runs to its end and brakes too late": (
        "braking",
        lambda r: placed(r, np.minimum(r.q[0, J] + np.clip(T - 1.0, 0.0, None) ** 2, ARM.q_max[J] - 1e-3)),
    ),
    "a locked joint goes on at 0.05 rad/s": ("failed", lambda r: locked(r, speed=0.05, sent=0.0)),
    "a locked joint creeps by a milliradian in a second": ("failed", lambda r: locked(r, speed=1e-3)),
    "a locked joint is sent on at 0.02 rad/s": ("failed", lambda r: locked(r, sent=0.02)),
    "a joint swings at 0.2 Hz for ever": (
        "rest",
        lambda r: placed(r, r.q[:, J] + 0.35 * UP * np.sin(2.0 * np.pi * 0.2 * (T - RESTS))),
    ),
    "a joint swings at 2 Hz, and stops in the last second": (
        "rest",
        lambda r: placed(r, r.q[:, J] + 0.05 * bump(RESTS, 8.2) * np.sin(4.0 * np.pi * T)),
    ),
    "a joint swings at 2 Hz once, in the middle of the rest": (
        "rest",
        lambda r: placed(r, r.q[:, J] + 0.05 * bump(5.5, 6.5) * np.sin(4.0 * np.pi * T)),
    ),
    "full acceleration with another sign in every tick, at rest": (
        "chatter",
        lambda r: moved(r, r.v[:, J] + 0.5 * DT * ARM.a_max[J] * EVERY_TICK * (T > RESTS)),
    ),
    "full acceleration with another sign in every second tick, on the way": (
        "chatter",
        lambda r: moved(r, r.v[:, J] + 0.5 * DT * ARM.a_max[J] * THIRD * ((T > 0.5) & (T < 0.6))),
    ),
    "half as much torque again as there is, under RELAXED": ("torque", lambda r: weak(r, 1.5, "RELAXED")),
    "a tenth more torque than there is, under OK": ("torque", lambda r: weak(r, 1.1, "OK")),
    "OK is said 15 mm beside the target": (
        "honesty",
        lambda r: replace(r, target=off(r, 15e-3), can_be_followed=False),
    ),
    "OK is said 15 mm beside the target, with interruptions": ("honesty", flickering),
    "a target that can be followed is not": (
        "tracking",
        lambda r: replace(r, target=off(r, 15e-3), status=["RELAXED"] * len(r.status)),
    ),
    "a joint is led away from where it is sent, under OK": (
        "obedience",
        lambda r: replace(r, sent_q=r.sent_q + 0.1 * np.clip(T[1:, None] - 1.0, 0.0, 1.0)),
    ),
    "a point sinks through its plane": ("plane", beyond_a_plane),
}
"""Each: the law that it breaks, and the run with it."""

INNOCENT = {
    "nothing": lambda r: r,
    "a joint that locks": locked,
    "a joint that is weak, and strong enough": lambda r: weak(r, 0.9, "OK"),
    "a joint that slows down fully when its limit has shrunk": lambda r: slowed(r, False),
}
"""Runs with something unusual and without a defect."""


@pytest.mark.parametrize("strict", [KINEMATIC, PHYSICS], ids=["kinematic", "physics"])
@pytest.mark.parametrize("what", INNOCENT)
def test_run_without_a_defect_breaks_no_law(sound, what, strict):
    seen = verdict(ARM, INNOCENT[what](sound), strict)
    let = set() if what == "nothing" else {"honesty", "tracking"}
    assert [str(one) for one in seen.breaches if one.law not in let] == []


@pytest.mark.parametrize("strict", [KINEMATIC, PHYSICS], ids=["kinematic", "physics"])
@pytest.mark.parametrize("defect", DEFECTS)
def test_gradual_defect_is_found(sound, defect, strict):
    law, plant = DEFECTS[defect]
    assert law in verdict(ARM, plant(sound), strict).laws


SHOWN_BY = {
    "clamp off": "speed",
    "a locked column kept": "tracking",
    "viability off": "braking",
    "status forced to OK": "honesty",
}


@pytest.fixture(scope="module")
def found():
    script = Path(__file__).with_name("planted_defects.py")
    plain = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    ended = subprocess.run([sys.executable, script], capture_output=True, text=True, env=plain, check=False)
    assert ended.returncode == 0, ended.stderr[-2000:]
    return json.loads(ended.stdout)


@pytest.mark.parametrize("defect", SHOWN_BY)
def test_planted_defect_is_found(found, defect):
    assert SHOWN_BY[defect] in found[defect]["with"]


@pytest.mark.parametrize("defect", SHOWN_BY)
def test_planner_without_the_defect_is_found_innocent(found, defect):
    assert found[defect]["without"] == []


NEVER = float("inf")


def alarm(joint, at, *kinds):
    return Alarm(joint=joint, at=at, kinds=frozenset(kinds or ("locked",)))


def lock(joint=2, since=1.0, reported_at=NEVER, kind="locked"):
    return Failure(joint=joint, kind=kind, since=since, reported_at=reported_at)


def test_failure_that_is_named_is_found_after_its_delay():
    seen = detection([alarm(2, 1.25, "locked", "degraded")], [lock()], 4.0)
    assert (seen.unannounced, seen.found, seen.right_kind) == (1, 1, 1)
    assert seen.delay == 0.25 and seen.found_as == "degraded or locked"
    assert seen.healthy_time == 1.0 and seen.false_alarms == seen.wrong_joint == 0


def test_failure_showed_if_it_made_a_difference_or_was_found():
    quiet, other = lock(), lock(joint=3)
    assert detection([], [quiet], 4.0).showed == 0
    assert detection([], [quiet, other], 4.0, [other]).showed == 1
    assert detection([alarm(2, 1.25)], [quiet], 4.0).showed == 1
    assert detection([], [lock(reported_at=2.0)], 4.0, [lock(reported_at=2.0)]).showed == 0


def test_right_joint_with_another_kind_is_found_with_the_wrong_kind():
    seen = detection([alarm(2, 1.1, "degraded")], [lock()], 4.0)
    assert (seen.found, seen.right_kind) == (1, 0)
    assert detection([alarm(2, 1.1, "free_swinging")], [lock(kind="free")], 4.0).right_kind == 1


def test_alarm_while_nothing_has_failed_is_false_even_of_the_joint_that_fails_later():
    seen = detection([alarm(2, 0.5), alarm(2, 1.5)], [lock()], 4.0)
    assert (seen.false_alarms, seen.found, seen.wrong_joint) == (1, 1, 0)
    assert detection([alarm(0, 3.0)], [], 4.0).false_alarms == 1
    assert detection([], [], 4.0).healthy_time == 4.0


def test_alarm_of_a_joint_that_works_after_a_failure_names_the_wrong_joint():
    seen = detection([alarm(3, 1.2)], [lock()], 4.0)
    assert (seen.found, seen.wrong_joint, seen.false_alarms) == (0, 1, 0)


@pytest.mark.parametrize("alarms", [[], [alarm(2, 2.5)]])
def test_failure_that_was_announced_first_is_nothing_to_find(alarms):
    seen = detection(alarms, [lock(reported_at=2.0)], 4.0)
    assert (seen.unannounced, seen.found, seen.wrong_joint) == (0, 0, 0)


def test_failure_that_is_found_before_it_is_announced_counts():
    assert detection([alarm(2, 1.5)], [lock(reported_at=2.0)], 4.0).found == 1
