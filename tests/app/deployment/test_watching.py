"""What a library in C notices is what Python notices, in the same ticks and with the same numbers."""

import numpy as np
import pytest
from tests.app.deployment.in_c import KINDS, MISTAKES, PANDA, Both, Finding, Library
from tests.going import targets_along

import ftqp
from ftqp.app.deployment.headers import arm_file

DT, NOISE = 1e-3, ftqp.Noise(q=1e-5, tau=0.05)
DRIVE = ftqp.Drive(kind="torque", inertia_error=0.0)
LOCKED, TICKS, STUCK = 3, 1200, 900


@pytest.mark.long
def test_findings_are_those_of_python(built):
    both = Both(built, ftqp.Planner(PANDA, DT, drive=DRIVE, noise=NOISE), noise=NOISE.q)
    arm, said = both.arm, []
    targets = targets_along(ftqp.paths.Circle(PANDA.pose(both.q), radius=0.1, duration=2.0), TICKS, DT)
    for k in range(TICKS):
        stuck = both.q[LOCKED]
        both.step(targets.at(k))
        said.append(arm.call("watch", None))
        if both.planner.findings:
            break
        if k >= STUCK:
            both.q[LOCKED] = stuck
    assert said[-1] == 2 and 2 not in said[:-1]
    (finding,) = both.planner.findings
    out = (Finding * 7)()
    assert arm.call("detect", out, 7) == 1
    assert out[0].joint == PANDA.joint(finding.joint) == LOCKED
    assert out[0].kinds == 1 and finding.kind == "locked"
    assert (out[0].onset, out[0].detected_at) == (finding.onset, finding.detected_at)
    assert out[0].probability == 1.0
    assert arm.call("watch", None) == 0 and arm.call("withdraw", LOCKED) == 0
    assert arm.call("detect", out, 7) == 0


def stands_then_works(q, sent, k):
    """The elbow stands for a while."""
    return np.where((np.arange(7) == LOCKED) & (400 <= k < 900), q, sent)


def all_stand_then_work(q, sent, k):
    return q if 400 <= k < 900 else sent


def one_stands_then_another(q, sent, k):
    stand = [LOCKED] * (k >= 400) + [1] * (k >= 1000)
    return np.where(np.isin(np.arange(7), stand), q, sent)


def encoder_is_lost(q, sent, k):
    found = sent.copy()
    found[LOCKED] += np.nan if k >= 500 else 0.0
    return found


STORIES = {
    "weak, stands, works again": (stands_then_works, {5: ftqp.Degraded(LOCKED, velocity=0.5)}, "locked"),
    "all are held and let go": (all_stand_then_work, {}, None),
    "two stand": (one_stands_then_another, {}, "locked"),
    "an encoder gives no numbers": (encoder_is_lost, {}, None),
    "stands, and is reported later": (stands_then_works, {700: ftqp.Locked(LOCKED)}, "locked"),
}


@pytest.mark.long
@pytest.mark.parametrize("kind", ["position", "torque"])
@pytest.mark.parametrize("story", STORIES)
def test_what_is_made_of_a_finding_is_what_python_makes_of_it(built, story, kind):
    """Joints stand, work again or lose their encoders unannounced: commands are Python's to the last bit."""
    arm_does, told, named = STORIES[story]
    planner = ftqp.Planner(PANDA, DT, drive=kind, noise=NOISE)
    both = Both(built, planner, noise=NOISE.q)
    targets = targets_along(ftqp.paths.Circle(PANDA.pose(both.q), radius=0.12, duration=2.0), 1500, DT)
    seen, statuses = set(), set()
    for k in range(1500):
        if k in told:
            both.report(told[k])
        before = both.q
        step = both.step(targets.at(k))
        kinds = [0 if one not in planner.faults else KINDS[planner.faults[one].kind] for one in PANDA.joints]
        assert [both.arm.call("believed", i) for i in range(7)] == kinds, k
        seen |= {finding.kind for finding in planner.findings}
        statuses.add(step.status.name)
        both.q = arm_does(before, both.q, k)
    assert named is None or named in seen, seen
    assert ("HELD" in statuses) == (story == "all are held and let go")
    assert (both.arm.call("stop_reason") != 0) == (planner.stopped_because is not None)


@pytest.mark.long
def test_watching_says_what_it_lacks(built):
    arm = Library(built, arm_file(ftqp.Planner(PANDA, DT, detector=False).deployable(), 7))
    assert arm.call("watch", None) == MISTAKES["NOT_OPEN"]
    arm.open()
    arm.reset()
    arm.step()
    assert arm.call("watch", None) == arm.call("detect", None, 0) == MISTAKES["UNSUPPORTED"]
    arm = Library(built, arm_file(ftqp.Planner(PANDA, DT).deployable(), 7))
    arm.open()
    assert arm.call("watch", None) == MISTAKES["NOT_RESET"]
    arm.reset()
    arm.step()
    assert arm.call("watch", None) == 0
    assert arm.call("detect", None, 1) == MISTAKES["NULL"]
