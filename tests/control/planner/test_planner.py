"""A planner refuses what makes no sense when it is made."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError, ModelError

DT = 2e-3


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"scheme": "mvm"}, r"'mvm' is not a scheme \(did you mean 'mvn'\?\); there are mvn, "),
        ({"level": "acceleraton"}, r"level is 'acceleraton' \(did you mean 'acceleration'\?\), expected"),
        ({"bounds": "viabilty"}, r"'viabilty' is not a bound conversion \(did you mean 'viability'\?\)"),
        ({"backend": "dapq"}, r"'dapq' is not a backend of ftqp \(did you mean 'daqp'\?\); it has"),
        ({"backend": 3}, "backend is 3, expected a name, a mapping with a name, or the path of a profile"),
        ({"dt": 0.0}, "dt is 0, expected a finite number > 0 s"),
        ({"dt": -1e-3}, "dt is -0.001, expected a finite number > 0 s"),
        ({"dt": np.nan}, "dt is nan, expected a finite number > 0 s"),
        ({"dt": "fast"}, "dt is 'fast', expected a number in s"),
        ({"posture": [0.0, 1.0]}, r"posture has shape \(2,\), expected \(nv,\) = \(7,\)"),
        ({"dt": 0.2}, r"kv is 20, but with dt = 0.2 s the feedback is unstable; expected kv < 10"),
        ({"dt": 0.2, "level": "velocity"}, r"kp is 10, but with dt = 0.2 s the feedback is unstable;"),
        ({"task": ftqp.Task(kp=4e6)}, r"kv is 4000, but with dt = 0.001 s the feedback is unstable"),
    ],
)
def test_wrong_parameter_is_refused_with_one_sentence(panda, given, sentence):
    with pytest.raises(InputError, match=sentence) as error:
        ftqp.Planner(panda, **given)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("scheme", ["mtn", "mke", "iiwt", "dlsm", "dlsm_mvn"])
def test_scheme_that_needs_inertia_is_refused_for_a_robot_without(srs7, level, scheme):
    with pytest.raises(
        InputError, match=r"scheme '\w+' needs inertia, which srs7 has not; use mvn, man or rmp"
    ):
        ftqp.Planner(srs7, scheme=scheme, level=level)


def test_robot_without_acceleration_limit_is_refused_with_the_joints_and_the_remedy(panda):
    a_max = panda.limits.a_max.copy()
    a_max[[1, 4]] = np.inf
    with pytest.raises(
        ModelError, match=r"no acceleration limit on panda_joint2, panda_joint5; .*with_limits\(a_max="
    ):
        ftqp.Planner(panda.with_limits(a_max=a_max))


@pytest.mark.parametrize(("q", "v", "sentence"), [
    (np.zeros(6), None, r"q has shape \(6,\), expected \(nv,\) = \(7,\)"),
    (np.full(7, np.nan), None, "q contains NaN at index 0"),
    (np.zeros(7), np.zeros(8), r"v has shape \(8,\), expected \(nv,\) = \(7,\)"),
    (np.zeros(7), [0.0] * 6 + [np.inf], "v is infinite at index 6"),
])  # fmt: skip
def test_reset_refuses_a_wrong_state(panda, q, v, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Planner(panda).reset(q, v)


def test_time_of_a_step_is_measured_only_when_asked(panda, home):
    for timing in (False, True):
        planner = ftqp.Planner(panda, DT, timing=timing)
        planner.reset(panda.neutral)
        time = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home)).qp.time
        assert (time is not None and 0.0 < time < 1.0) is timing


@pytest.mark.parametrize("given", ["panda", None, 7, np.eye(4), {"name": "panda"}, ftqp.Robot])
def test_what_is_no_robot_is_refused_with_the_way_to_one(given):
    with pytest.raises(
        InputError, match=r"^robot is .*, expected an ftqp.Robot, for example ftqp.robots.load"
    ):
        ftqp.Planner(given)


def test_arm_without_velocity_limits_is_told_of_those():
    arm = ftqp.Robot.from_dh([[0.0, 0.1, 0.3, 0.0], [0.0, 0.0, 0.3, 0.0]])
    with pytest.raises(ModelError, match=r"no velocity limit, .* on j1, j2; .*with_limits\(v_max=...\)$"):
        ftqp.Planner(arm)
    assert ftqp.Planner(arm.with_limits(v_max=1.0)).robot.limits.a_max.tolist() == [5.0, 5.0]


BODY = ftqp.robots.load("dual_panda")


def test_a_planner_says_its_tasks_constraints_and_what_it_believes():
    planner = ftqp.Planner(
        BODY,
        tasks=[
            ftqp.PoseTask("left_hand"),
            ftqp.RelativeTask("right_hand", "left_hand", level=0, name="<grip>"),
        ],
        constraints=[ftqp.Keep("left_joint4", above=[0.0, 0.0, 0.2])],
    )
    planner.reset(BODY.neutral)
    assert "every joint works" in planner._repr_html_() and repr(planner).endswith("failed: none)")
    planner.report(ftqp.Locked("left_joint3"))
    said = planner._repr_html_()
    for word in (
        "dual_panda, 14 joints",
        "RelativeTask, level 0",
        "&lt;grip&gt;",
        "Keep",
        "left_joint3 locks",
    ):
        assert word in said


def test_a_path_says_where_it_begins_and_how_long_and_fast_it_is():
    said = ftqp.paths.Line(BODY.pose(BODY.neutral), displacement=(0.0, 0.0, 0.2), duration=2.0)._repr_html_()
    assert "Line" in said and "0.2 m" in said and "2 s" in said and "0.1" in said
