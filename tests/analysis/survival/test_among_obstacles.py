"""Coverage and plans among things that stand around the arm, seen with the distances of a planner."""

import pickle

import numpy as np
import pytest
from tests.analysis.planar_arms import PATH as UNIT_PATH
from tests.analysis.planar_arms import Q0 as UNIT_START
from tests.analysis.planar_arms import UNIT

import ftqp
from ftqp.kernel.layout.enums import Survival
from ftqp.model import catalog

PANDA = catalog.load("panda")
Q0 = PANDA.neutral
PATH = ftqp.paths.Line(PANDA.pose(Q0), (0.0, 0.3, 0.0), duration=4.0)
KEEP, OFF = 0.01, 2e-3
CLEAR = ftqp.Clearance(keep=KEEP)


def things():
    scene = ftqp.Scene()
    elbow = PANDA.pose(Q0, PANDA.joints[3])[:3, 3]
    scene.add("ball", ftqp.Sphere(0.05, elbow + np.array([0.0, -0.2, 0.05])))
    scene.add("box", ftqp.Box((0.1, 0.1, 0.3), (0.3, 0.35, 0.15)))
    return scene


SCENE = things()
TASK = ftqp.analysis.task_path(PANDA, PATH, dt=0.02)
MOTION = ftqp.analysis.track(TASK, Q0)
SEES = ftqp.Planner(PANDA, scene=SCENE, clearance=CLEAR)


def least(q, planner=SEES):
    return min(float(d.min()) for d in planner.distances(q).values())


def test_a_failure_after_which_the_arm_comes_too_near_is_not_survived():
    blind = ftqp.analysis.coverage(PANDA, TASK, MOTION, stride=10)
    seeing = ftqp.analysis.coverage(PANDA, TASK, MOTION, stride=10, scene=SCENE, clearance=CLEAR)
    near = seeing.status == Survival.TOO_NEAR
    assert near.any() and blind.survived[near].all()  # else it would be lost for that before
    assert (seeing.status == blind.status)[~near].all()
    assert np.isinf(blind.clearance).all()
    for joint, k in np.argwhere(blind.survived):
        d = least(blind.continue_after(int(joint), float(blind.t[k])))
        assert near[joint, k] == (d < KEEP)
        if not near[joint, k]:
            assert seeing.clearance[joint, k] == pytest.approx(d, abs=1e-12)
    joint, k = np.argwhere(near)[0]
    with pytest.raises(ftqp.analysis.NotSurvived, match="TOO_NEAR") as lost:
        seeing.continue_after(int(joint), float(seeing.t[k]))
    assert least(lost.value.q) >= KEEP > seeing.clearance[joint, k]


def test_where_a_path_is_lost_its_end_is_come_to_by_a_way_round_or_the_search_says_what_it_looked_for():
    seeing = ftqp.analysis.coverage(PANDA, TASK, MOTION, stride=40, scene=SCENE, clearance=CLEAR)
    led = 0
    for joint, k in np.argwhere(~seeing.survived):
        time = float(seeing.t[k])
        try:
            motion = seeing.way_round(int(joint), time)
        except ftqp.analysis.NotSurvived as lost:
            assert "of its end no posture was found in 600 starts" in str(lost)
            continue
        with pytest.raises(ftqp.analysis.NotSurvived) as lost:
            seeing.continue_after(int(joint), time)
        assert motion[0] == pytest.approx(lost.value.q[-1], abs=1e-9)
        assert (motion[:, joint] == motion[0, joint]).all() and least(motion[::10]) > 0.5 * KEEP
        off = np.linalg.inv(TASK.goals[-1]) @ PANDA.pose(motion[-1])
        assert np.linalg.norm(off[:3, 3]) < 2e-3
        led += 1
    assert led > 3
    joint, k = np.argwhere(seeing.survived)[0]
    with pytest.raises(ftqp.InputError, match="is survived on the path"):
        seeing.way_round(int(joint), float(seeing.t[k]))


def test_a_path_through_a_body_is_refused_by_the_names_of_what_meets():
    scene = ftqp.Scene()
    scene.add("crate", ftqp.Box((0.1, 0.1, 0.3), PANDA.pose(Q0)[:3, 3]))
    with pytest.raises(ftqp.InputError, match=r"at sample 0 .* to crate\)"):
        ftqp.analysis.plan(PANDA, TASK, scene=scene, clearance=CLEAR)


def test_a_plan_that_finds_no_way_along_its_path_tells_where_one_leads_on_off_it():
    scene, clear = ftqp.Scene(), ftqp.Clearance(keep=KEEP, self_pairs=False)
    scene.add("ball", ftqp.Sphere(0.06, (0.411, -0.691, 0.0)))
    settings = ftqp.analysis.PlanSettings(waypoints=16, spacing=0.15)
    given = {"rows": "position", "dt": 0.1, "settings": settings, "scene": scene, "clearance": clear}
    with pytest.raises(ftqp.InputError, match=r"off the path a way round of .* part the path at t = 5 s"):
        ftqp.analysis.plan(UNIT, UNIT_PATH, UNIT_START, **given)
    behind = UNIT_PATH.sample(np.arange(5.0, 10.01, 0.1)).pose
    assert ftqp.analysis.plan(UNIT, behind, **given).coverage > 0.0


def test_rows_lead_the_arm_round_what_it_would_meet():
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(0.05, (0.2, 0.22, 0.55)))  # below the forearm
    sees = ftqp.Planner(PANDA, scene=scene, clearance=CLEAR)
    blind = ftqp.analysis.coverage(PANDA, TASK, MOTION, rows="position", stride=20)
    seeing = ftqp.analysis.coverage(
        PANDA, TASK, MOTION, rows="position", stride=20, scene=scene, clearance=CLEAR
    )
    met = 0
    for joint, k in np.argwhere(seeing.survived):
        when = int(joint), float(seeing.t[k])
        met += least(blind.continue_after(*when), sees) < KEEP - OFF
        d = least(seeing.continue_after(*when), sees)
        assert d >= KEEP - OFF and seeing.clearance[joint, k] == pytest.approx(d, abs=1e-12)
    assert (seeing.status.size, seeing.survived.sum(), met) == (70, 56, 47) and blind.coverage == 1.0


def test_what_the_planner_does_is_judged_by_the_same_distance():
    found = ftqp.analysis.coverage(
        PANDA, TASK, MOTION, rows="position", post="planner", stride=100, scene=SCENE, clearance=CLEAR
    )
    assert found.coverage == 1.0 and KEEP - 1e-4 < found.least_clearance < 0.1


def test_a_plan_keeps_clear_of_what_the_best_one_without_a_scene_passes_through():
    few = ftqp.analysis.PlanSettings(waypoints=20, spacing=0.2, stride=20)
    blind = ftqp.analysis.plan(PANDA, TASK, settings=few)
    seeing = ftqp.analysis.plan(PANDA, TASK, settings=few, scene=SCENE, clearance=CLEAR)
    assert least(blind.q) < 0.0 and least(seeing.q) >= KEEP - OFF
    assert seeing.task_digest != blind.task_digest
    assert seeing.report.counts[Survival.SURVIVED] == round(seeing.coverage * seeing.report.status.size)
    assert least(seeing.continue_after(*next(survived(seeing.report)))) >= KEEP - OFF
    again = pickle.loads(pickle.dumps(seeing.task))
    assert (
        again.digest == seeing.task.digest
        and (again.clearances(seeing.q) == seeing.task.clearances(seeing.q)).all()
    )


def survived(report):
    for joint, k in np.argwhere(report.survived):
        yield int(joint), float(report.t[k])


def test_a_path_into_something_has_no_plan_and_a_start_in_it_is_refused():
    few = ftqp.analysis.PlanSettings(waypoints=10, spacing=0.3)
    wall = ftqp.Scene()
    wall.add("wall", ftqp.HalfSpace(point=(0.0, 0.2, 0.0), normal=(0.0, -1.0, 0.0)))
    with pytest.raises(ftqp.InputError, match=r"comes too near to something at sample .* of the path"):
        ftqp.analysis.plan(PANDA, TASK, settings=few, scene=wall)
    with pytest.raises(ftqp.InputError, match=r"q0 comes too near to something: .* expected at least 250 mm"):
        ftqp.analysis.plan(PANDA, TASK, Q0, settings=few, scene=SCENE, clearance=ftqp.Clearance(keep=0.25))


def test_what_moves_is_refused_and_a_scene_that_changes_later_changes_nothing():
    scene = things()
    task = ftqp.analysis.task_path(PANDA, PATH, dt=0.02, scene=scene, clearance=CLEAR)
    before = task.clearances(MOTION)
    scene.move("ball", (5.0, 0.0, 0.0))
    assert (task.clearances(MOTION) == before).all()
    assert task.digest != ftqp.analysis.task_path(PANDA, PATH, dt=0.02, scene=scene, clearance=CLEAR).digest
    scene.move("ball", (5.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(ftqp.InputError, match=r"'ball' in the scene moves, .*say where it stands"):
        ftqp.analysis.task_path(PANDA, PATH, dt=0.02, scene=scene)
