"""What no study can answer is refused in one sentence, before anything is computed."""

from functools import partial

import numpy as np
import pytest
from tests.analysis.planar_arms import PATH, Q0, START, TASK, UNIT, links

import ftqp
from ftqp import analysis
from ftqp.analysis import PlanSettings, plan, task_path, track, workspace
from ftqp.analysis.goals import goal_study
from ftqp.analysis.survival.coverage_report import mission_survival
from ftqp.core.errors import InputError
from ftqp.model import catalog

PANDA = catalog.load("panda")
DUAL = catalog.load("dual_panda")
TWO = links(1, 1)
NOW = DUAL.neutral
THERE = DUAL.pose(NOW)
LINE = ftqp.paths.Line(PANDA.pose(PANDA.neutral), (0.0, 0.1, 0.0), duration=2.0)
ALONG = task_path(PANDA, LINE, dt=0.05)
MOTION = track(ALONG, PANDA.neutral)
REPORT = analysis.coverage(PANDA, ALONG, MOTION)
POSTURES = np.random.default_rng(3).normal(size=(300, 6, 7))

learned = analysis.Effectiveness(3, 0.01)
locked = partial(analysis.reachable_after, UNIT, (1.0, 1.0))
rest_test = partial(analysis.rest_test, UNIT, np.zeros(3), goal=(1.0, 1.0))
rests = partial(analysis.rest_configurations, UNIT)
goal = partial(goal_study, UNIT)
mapped = partial(workspace, UNIT)
in_space = partial(workspace, PANDA, rows="position")
planned = partial(plan, UNIT, rows="position", dt=0.1, settings=PlanSettings(waypoints=50, spacing=0.12))
covered = partial(analysis.coverage, PANDA, LINE, MOTION)
rates = partial(mission_survival, UNIT, np.ones((3, 100), dtype=bool), np.arange(100) * 36.0, 3600.0)

REFUSED = [
    # weights of rates, of the law of every study
    (lambda: rests((1.0, 1.0), "j1", 0.0, -np.eye(3)), "expected a positive definite matrix"),
    (lambda: rests((1.0, 1.0), "j1", 0.0, np.ones((2, 2))), "W has shape"),
    (lambda: mapped((1.5, 1.5), W=[[1, 2, 0], [0, 1, 0], [0, 0, 1]]), "not symmetric"),
    # goals
    (lambda: goal((1.0, np.nan), "pose"), "contains NaN"),
    (lambda: goal((1.0, 1.0), ("x", "y", "rz")), "give a pose"),
    (lambda: goal((1.0, 1.0), ("x", "z")), r"give a point \(3,\)"),
    (lambda: goal((1.0, 1.0, 0.0), ("x", "y", "z")), "do not move independently"),
    (lambda: goal((1.0, 1.0), "position_axis"), "expected 'pose', 'position' or names"),
    (lambda: goal(np.ones((4, 4)), "pose"), "not a rotation"),
    # locks
    (lambda: locked({"j9": 0.0}), "is not a joint"),
    (lambda: locked({"j1": 0.0, 0: 0.0}), "twice"),
    (lambda: locked({}), "expected 1 to 2 of 3"),
    (lambda: locked({"j1": 0.0, "j2": 0.0, "j3": 0.0}), "expected 1 to 2 of 3"),
    (lambda: rest_test(["j1", "j2", "j3"]), "names all 3 joints"),
    (lambda: analysis.convergence_rates(UNIT, np.zeros(3)), "is singular at q"),
    # maps
    (lambda: mapped((4.0, 0.0)), "nearest: 1 m off in rows x, y.; expected a goal inside the workspace"),
    (lambda: mapped((1.5, 1.5), steps=2.5), "steps is 2.5"),
    (lambda: mapped((1.5, 1.5), jobs=0), "jobs is 0"),
    (lambda: in_space((0.5, 0.0, 0.5), grid=1), "grid is 1"),
    (lambda: in_space((0.5, 0.0, 0.5), plane="zx"), "plane is 'zx'"),
    (lambda: in_space((9.0, 0.0, 0.0)), "expected a goal inside the workspace"),
    (lambda: analysis.survival_map(PANDA, rows="tool"), "tool"),
    # tasks
    (lambda: task_path(PANDA, np.zeros((3, 4, 4)), dt=0.1), "sample 0 of the path has a rotation part"),
    (lambda: task_path(PANDA, "line", dt=0.1), "path is 'line', expected an ftqp path"),
    (lambda: task_path(PANDA, LINE, rows="poses"), "poses"),
    (lambda: task_path(PANDA, LINE, q0=PANDA.neutral + 0.1), "off in row .* at sample 0 of the path"),
    (lambda: task_path(PANDA, LINE, q0=PANDA.neutral + 4.0), "outside its limits"),
    # plans
    (lambda: planned(PATH, weights={"j1": -1.0}), "weight of 'j1'"),
    (lambda: planned(PATH, weights={"j1": 0.0}), "weights are all zero"),
    (lambda: planned(PATH, weights={"j1": 1.0, 0: 1.0}), "name a joint twice"),
    (lambda: planned(PATH, weights=[1.0, 1.0, 1.0]), "weights is"),
    (lambda: planned(PATH, optimise=("yaw",)), "for which the turn of the tool does not count"),
    (lambda: planned(PATH, Q0, optimise=("base",)), "q0 is given and the path may move"),
    (lambda: planned(PATH, settings={"waypoints": 5}), "settings is of type dict"),
    (lambda: planned(PATH, Q0 + 0.1), "off in row"),
    (
        lambda: planned(ftqp.paths.Line(START, (3.0, 0.0, 0.0), duration=10.0)),
        r"does not reach sample \d+ of the path \(t = .*m off at least",
    ),
    (
        lambda: planned(ftqp.paths.Line(START, (-0.4, 1.0, 0.0), duration=0.4)),
        "no way along the path is found beyond t = ",
    ),
    (lambda: plan(links(1, 1, 0.9), TASK), "path is a task of another"),
    (
        lambda: plan(
            TWO, ftqp.paths.Line(TWO.pose(TWO.neutral), (-0.1, 0, 0), duration=1.0), rows="position"
        ),
        "no joint is to spare",
    ),
    (lambda: PlanSettings(thetas=()), "thetas is empty"),
    (lambda: PlanSettings(stride=2.5), "stride is 2.5"),
    # coverage
    (lambda: analysis.coverage(PANDA, LINE, MOTION + 0.01), "q does not follow the path: at sample 0"),
    (lambda: analysis.coverage(PANDA, None, MOTION), "give the path of this motion"),
    (lambda: analysis.coverage(catalog.load("xarm7"), ALONG, MOTION), "is a task of another panda"),
    (lambda: covered(lock="brake"), "lock is 'brake'"),
    (lambda: covered(fault="free_swinging", post="qp"), "leave post out"),
    (lambda: covered(post="planner", joints="pairs"), "give single joints"),
    (lambda: covered(post="planner", lock="ramp", deceleration=np.ones(7)), "one number a joint"),
    (lambda: covered(velocity=2.0), "share of the speed limit"),
    (lambda: covered(post="exact", rows="position"), "6 joints are left for 3 rows"),
    (lambda: covered(post="newton"), "post is 'newton'"),
    (lambda: covered(joints=[(0, 1, 2)]), "sets of two"),
    (lambda: covered(rows="position", upper_bound=3), "one joint more than rows"),
    (lambda: covered(task="nose"), "frame is 'nose'"),
    (lambda: REPORT.survives("panda_joint4", 9.0), "time is 9 s"),
    (lambda: REPORT.continue_after("panda_joint4", 4.0), "time is 4 s"),
    (lambda: REPORT.survives("elbow", 0.0), "elbow"),
    (lambda: covered(joints=[0]).survives(1, 0.0), "was not verified"),
    (lambda: rates({"j9": 1.0}), "j9"),
    (lambda: rates({}), "mtbf is empty"),
    # tracking
    (lambda: track(ALONG.with_rows("position"), PANDA.neutral, 0.1), "one joint more than rows"),
    # tolerance
    (lambda: analysis.null_vector(np.ones((6, 8))), "expected one column more than rows"),
    (lambda: analysis.null_vector("J"), "expected a Jacobian"),
    (lambda: analysis.relative_manipulability(POSTURES, [()]), "the set"),
    (lambda: analysis.relative_manipulability(POSTURES, [(7,)]), "from 0 to 6"),
    (lambda: analysis.fall_energy(catalog.load("srs7"), np.zeros(7)), "has no inertia, so no joint falls"),
    # the law that learns
    (
        lambda: learned.learn(np.ones((2, 3)), np.ones(2), np.ones(2)),
        r"dq has shape \(2,\), expected",
    ),
    (lambda: analysis.Effectiveness(0, 0.01), "joints"),
    (lambda: analysis.Effectiveness(2, 0.0), "dt"),
    (lambda: analysis.Effectiveness(2, 0.1, noise=-1.0), "noise"),
    # robots with branches
    *(
        (study, "needs one serial arm, but dual_panda has joints off")
        for study in (
            lambda: analysis.self_motion(DUAL, THERE),
            lambda: analysis.structural_joints(DUAL),
            lambda: analysis.learned_run(DUAL, THERE[:3, 3], NOW),
            lambda: analysis.survival_map(DUAL),
            lambda: analysis.rest_curves(DUAL, THERE[:3, 3], 0),
            lambda: analysis.convergence_rates(DUAL, NOW),
            lambda: analysis.outcome(DUAL, THERE[:3, 3], NOW, 0),
            lambda: analysis.workspace(DUAL, THERE[:3, 3], rows="position"),
            lambda: analysis.joint_ranges(DUAL, THERE),
            lambda: analysis.reachable_after(DUAL, THERE, {0: 0.0}),
        )
    ),
    (lambda: analysis.basins(DUAL, THERE[:2, 3], 1, 0.0), "expected a planar arm of three revolute joints"),
]


@pytest.mark.parametrize(("study", "sentence"), REFUSED)
def test_what_cannot_be_answered_is_refused_in_one_sentence(study, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence) as refusal:
        study()
    assert "\n" not in str(refusal.value)


def test_one_arm_of_a_robot_with_branches_is_studied_like_any_other():
    one = ftqp.Robot.from_pinocchio(DUAL.model, "right_hand", limits={"a_max": 10.0})
    assert analysis.structural_joints(one) == analysis.structural_joints(PANDA) == ()
    assert len(analysis.self_motion(one, one.pose(one.neutral))) > 0
    found, alone = analysis.fall_energy(DUAL, NOW), analysis.fall_energy(PANDA, NOW[:7])
    for side in ("left", "right"):
        own = [found[f"{side}_joint{i}"] for i in range(1, 8)]
        assert own == pytest.approx(list(alone.values()), abs=1e-9)
