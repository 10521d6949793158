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
        (
            {"level": "acceleraton"},
            r"level is 'acceleraton' \(did you mean 'acceleration'\?\), expected one of ",
        ),
        ({"bounds": "viabilty"}, r"'viabilty' is not a bound conversion \(did you mean 'viability'\?\)"),
        (
            {"backend": "dapq"},
            r"'dapq' is not a backend of ftqp \(did you mean 'daqp'\?\); it has active_set, ",
        ),
        ({"backend": 3}, "backend is 3, expected a name, a mapping with a name, or the path of a profile"),
        ({"dt": 0.0}, "dt is 0, expected a finite number > 0 s"),
        ({"dt": -1e-3}, "dt is -0.001, expected a finite number > 0 s"),
        ({"dt": np.nan}, "dt is nan, expected a finite number > 0 s"),
        ({"dt": "fast"}, "dt is 'fast', expected a number in s"),
        ({"posture": [0.0, 1.0]}, r"posture has shape \(2,\), expected \(nv,\) = \(7,\)"),
        ({"dt": 0.2}, r"kv is 20, but with dt = 0.2 s the feedback is unstable; expected kv < 10"),
        (
            {"dt": 0.2, "level": "velocity"},
            r"kp is 10, but with dt = 0.2 s the feedback is unstable; expected kp < 10",
        ),
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
