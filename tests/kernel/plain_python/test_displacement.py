"""Small parts: the displacement of a target, paths that wait, sines of wide angles, and residuals of NaN."""

from math import inf, nan
from types import SimpleNamespace

import numpy as np
import pytest
from records import empty_record

from ftqp.kernel.calm import waiting
from ftqp.kernel.feedback import tip_correction
from ftqp.kernel.judge import kkt
from ftqp.kernel.layout.enums import ACCELERATION, TARGET_HAS_ROTATION, TARGET_TWIST, VELOCITY
from ftqp.kernel.maths import trigonometry

DT = 0.01


def displaced(level=ACCELERATION, *, has_tip=1):
    """An arm whose measured tip is off by 2 mm along x and 0.1 rad about z."""
    K = empty_record()
    K.state.dt, K.state.level, K.task.kv = DT, level, 9.0
    K.feedback.kappa, K.feedback.has_tip = 5.0, has_tip
    K.feedback.off[:6] = [2e-3, 0.0, 0.0, 0.0, 0.0, 0.1]
    return K


@pytest.mark.parametrize("level", [ACCELERATION, VELOCITY])
def test_the_displacement_takes_back_what_the_tip_is_off_critically_damped(level):
    """c -> -d by c'' = -kappa^2 (c + d) - 2 kappa c', semi-implicit; and what is fed forward."""
    K = displaced(level)
    c, rate, d = np.zeros(6), np.zeros(6), K.feedback.off[:6].copy()
    for _ in range(300):
        change = -25.0 * (c + d) - 10.0 * rate
        rate = rate + DT * change
        c = c + DT * rate
        tip_correction.correct(K)
        assert K.feedback.displaced == 1 and K.feedback.c[:6] == pytest.approx(c, abs=1e-15)
        forward = change + 9.0 * rate if level == ACCELERATION else rate
        assert K.feedback.push[:6] == pytest.approx(forward, abs=1e-12)
    assert K.feedback.c[:6] == pytest.approx(-d, abs=1e-5)


@pytest.mark.parametrize("why", ["refused", "latched", "holding", "near a target that stands"])
def test_it_rests_while_there_is_a_reason(why):
    K = displaced()
    K.feedback.c_rate[:6] = 1.0
    if why == "refused":
        K.feedback.refused = 1
    elif why == "latched":
        K.watch.latched = 1
    elif why == "holding":
        K.calm.holding = 1
    else:
        K.calm.stood, K.feedback.tip_gap = tip_correction.STOOD, 0.9 * tip_correction.QUIET
    tip_correction.correct(K)
    assert not K.feedback.c[:6].any() and not K.feedback.c_rate[:6].any() and not K.feedback.push[:6].any()


def test_rest_near_a_target_has_a_hysteresis():
    K = displaced()
    K.calm.stood = tip_correction.STOOD
    between = 0.5 * (tip_correction.QUIET + tip_correction.LOUD)
    said = []
    for gap in (between, 0.9 * tip_correction.QUIET, between, 1.1 * tip_correction.LOUD, between):
        K.feedback.tip_gap = gap
        said.append(bool(tip_correction._rests(K)))
    assert said == [False, True, True, False, False]
    K.feedback.quiet, K.calm.stood = 1, 0.9 * tip_correction.STOOD
    assert not tip_correction._rests(K)


def test_a_displacement_that_nobody_measured_is_bounded():
    for has_tip in (0, 1):
        K = displaced(has_tip=has_tip)
        K.feedback.off[:6] = [9.0, 0.0, 0.0, 9.0, 0.0, 0.0]
        for _ in range(200):
            tip_correction.correct(K)
        far, turned = np.linalg.norm(K.feedback.c[:3]), np.linalg.norm(K.feedback.c[3:6])
        if has_tip:
            assert min(far, turned) > 8.0
        else:
            assert far == pytest.approx(tip_correction.FARTHEST) and turned == pytest.approx(
                tip_correction.LARGEST_TURN
            )


def test_without_anything_to_take_back_the_task_is_left_alone():
    K = displaced()
    K.feedback.off[:6] = 0.0
    K.task.error[:6] = 1.0
    tip_correction.correct(K)
    tip_correction.displace(K)
    assert K.feedback.displaced == 0 and (K.task.error[:6] == 1.0).all()
    K.feedback.displaced, K.feedback.c[:6] = 1, 0.25
    tip_correction.displace(K)
    assert not np.allclose(K.task.error[:6], 1.0)


def test_the_target_of_a_blocked_path_stands_where_calm_is_on():
    for limit, on, stands in ((0.0, 1, True), (0.5, 1, False), (0.0, 0, False)):
        K = empty_record()
        K.calm.on = on
        K.task.target[:] = 3.0
        path = SimpleNamespace(limit=limit)
        assert waiting.stand_still(K, path) == stands
        moved = K.task.target[TARGET_TWIST:TARGET_HAS_ROTATION]
        assert (moved == (0.0 if stands else 3.0)).all() and K.task.target[0] == 3.0


@pytest.mark.parametrize(
    ("rate", "limit", "progress", "waits"),
    [(1.0, 1.0, 0.5, False), (1.0, 0.0, 0.5, True), (1.0, 1.0, 1.0, True), (0.0, 1.0, 0.5, True)],
)
def test_a_path_waits_that_is_slow_blocked_or_at_its_end(rate, limit, progress, waits):
    path = SimpleNamespace(rate=rate, limit=limit, progress=progress, end=1.0)
    assert waiting.waits(empty_record(), path) == waits


@pytest.mark.parametrize("turns", [0.0, 1e5])
def test_sines_of_joints_are_those_of_their_angles_however_far_they_have_turned(turns):
    K = empty_record()
    K.chain.n, K.chain.prismatic[1] = 5, 1
    q = np.linspace(-3.0, 3.0, 5) + 2.0 * np.pi * turns
    K.state.q[:5] = q
    trigonometry.joint_sines(K)
    turning = np.arange(5) != 1
    assert K.kinematics.sine[:5] == pytest.approx(np.where(turning, np.sin(q), 0.0), abs=1e-15)
    assert K.kinematics.cosine[:5] == pytest.approx(np.where(turning, np.cos(q), 1.0), abs=1e-15)


@pytest.mark.parametrize("at", range(4))
def test_residuals_of_what_is_no_number_are_infinite(at):
    given = [0.5, 0.0, 1.0, 0.25]
    assert (
        kkt.violation(1.5, 0.0, 1.0) == 0.5 == kkt.violation(-0.5, 0.0, 1.0)
        and kkt.violation(*given[:3]) == 0.0
    )
    assert kkt.slackness(*given) == 0.25 and kkt.slackness(0.5, 0.0, 0.6, 9.0) == pytest.approx(0.1)
    assert (
        kkt.slackness(0.5, 0.4, 1.0, -9.0) == pytest.approx(0.1) and kkt.slackness(0.5, -inf, inf, 3.0) == 3.0
    )
    given[at] = nan
    assert kkt.slackness(*given) == inf
    if at < 3:
        assert kkt.violation(*given[:3]) == inf
