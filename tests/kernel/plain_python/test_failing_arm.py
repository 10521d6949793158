"""Which joint of an arm has failed, how and since when, whatever of its torques is known."""

import numpy as np
import pytest
from failing_arm import (
    AT,
    BEGIN,
    DT,
    SIGMA,
    TAU_MAX,
    commanded,
    detector,
    driven,
    know_what_is_usual,
    reference,
)

KNOWN = {
    "torques sent": ("torque", {}),
    "torques sent and measured": ("torque", {"measured": True}),
    "torques demanded": ("position", {"demands": True}),
    "torques measured": ("position", {"measured": True}),
    "no torques": ("position", {}),
}
EACH = [name if name == "no torques" else pytest.param(name, marks=pytest.mark.slow) for name in KNOWN]


@pytest.mark.parametrize("known", EACH)
def test_a_healthy_arm_raises_no_suspicion(known):
    drive, told = KNOWN[known]
    tick, diagnosis = driven(detector(drive), most=150, **told)
    assert tick == 150 and not diagnosis.watching and diagnosis.suspicion < 0.5


@pytest.mark.parametrize("known", EACH)
@pytest.mark.parametrize("joint", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_a_joint_that_brakes_and_stands_is_locked(known, joint):
    drive, told = KNOWN[known]
    tick, diagnosis = driven(detector(drive), "locked", joint, **told)
    found = diagnosis.isolated[f"j{joint + 1}"]
    assert tick < AT + 40 and list(diagnosis.isolated) == [f"j{joint + 1}"]
    assert found.kinds == {"locked"}
    assert found.onset == pytest.approx(DT * (AT + 400), abs=6 * DT)


@pytest.mark.parametrize("known", EACH)
@pytest.mark.parametrize("joint", [1, 2])
def test_a_joint_with_all_of_its_torque_runs_away(known, joint):
    drive, told = KNOWN[known]
    tick, diagnosis = driven(detector(drive), "runs", joint, **told)
    assert tick < AT + 10 and diagnosis.isolated[f"j{joint + 1}"].kinds == {"runaway"}
    assert diagnosis.isolated[f"j{joint + 1}"].onset == pytest.approx(DT * (AT + 400), abs=3 * DT)


@pytest.mark.parametrize("known", EACH)
def test_a_joint_without_torque_swings_freely(known):
    drive, told = KNOWN[known]
    tick, diagnosis = driven(detector(drive), "share", 0, 0.0, most=180, **told)
    if known == "torques measured":  # the motor gives what it is said to give; nothing is odd but the motion
        assert not diagnosis.isolated and diagnosis.watching and diagnosis.suspect == "j1"
        return
    assert tick < AT + 60 and diagnosis.isolated["j1"].kinds == {"free_swinging"}
    assert diagnosis.isolated["j1"].onset == pytest.approx(DT * (AT + 400), abs=10 * DT)


@pytest.mark.slow
@pytest.mark.parametrize("known", ["torques sent and measured", "torques demanded", "no torques"])
def test_a_joint_with_half_of_its_torque_is_degraded_by_half(known):
    drive, told = KNOWN[known]
    _, diagnosis = driven(detector(drive), "share", 0, 0.5, **told)
    found = diagnosis.isolated["j1"]
    assert found.kinds == {"degraded"} and found.share == pytest.approx(0.5, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("joint", [1, 2])
def test_what_is_not_clear_is_said_to_be_either(joint):
    """Where the arm asks little of a joint its share shows late, and may be any small one."""
    _, diagnosis = driven(detector("position"), "share", joint, 0.25)
    assert diagnosis.isolated[f"j{joint + 1}"].kinds == {"degraded", "free_swinging"}


def samples(watch, ticks, spoilt=lambda k, q: q, tau=lambda k: None, sent=lambda k: None):
    """Samples of an arm that follows its reference, as ``spoilt`` as they are; the last diagnosis."""
    rng = np.random.default_rng(1)
    for k in ticks:
        q = reference(BEGIN + k)[0] + SIGMA * rng.standard_normal(3)
        diagnosis = watch.update(spoilt(k, q), None, tau(k), commanded(k, sent(k)))
    return diagnosis


def off(joint, by, since=AT, until=10**6):
    """Samples of a joint that are off."""

    def spoilt(k, q):
        q = q.copy()
        q[joint] += (by(k - since) if callable(by) else by) if since <= k < until else 0.0
        return q

    return spoilt


@pytest.mark.parametrize(
    ("kind", "spoilt", "within"),
    [
        ("sensor_dropped", off(1, np.nan), 3),
        ("sensor_biased", off(1, 0.05), 3),
        ("sensor_biased", off(1, lambda k: 0.05 * (-1.0) ** k), 10),
    ],
    ids=["no numbers", "the same offset", "any offset"],
)
def test_a_sensor_is_lost_after_its_samples(kind, spoilt, within):
    watch = detector("position")
    diagnosis = samples(watch, range(AT + within - 1), spoilt)
    assert not diagnosis.isolated
    diagnosis = samples(watch, range(AT + within - 1, AT + within), spoilt)
    assert diagnosis.isolated["j2"].kinds == {kind}
    assert diagnosis.isolated["j2"].onset == pytest.approx(DT * AT, abs=1.5 * DT)


def test_a_frozen_sensor_is_one_that_repeats_its_number_finer_than_its_noise():
    last = {}

    def frozen(k, q):
        last.setdefault(k < AT or "since", q[2])
        return np.array([q[0], q[1], q[2] if k < AT else last["since"]])

    assert samples(detector("position"), range(AT + 6), frozen).isolated["j3"].kinds == {"sensor_frozen"}
    last.clear()
    coarse = detector("position", quantum=1e-4)
    diagnosis = samples(coarse, range(AT + 60), frozen)
    assert diagnosis.isolated["j3"].kinds == {"locked", "sensor_frozen"}, "a coarse one may be a brake, too"


def test_an_offset_that_grows_is_motion_and_one_sample_is_a_glitch():
    watch = detector("position")
    diagnosis = samples(watch, range(AT + 40), off(0, 0.3, until=AT + 2))
    assert not diagnosis.isolated and not diagnosis.watching
    watch = detector("position")
    diagnosis = samples(watch, range(AT + 12), off(0, lambda k: 3e-3 * (k + 1) ** 2))
    D = watch._session.D
    assert D.sensor[0] == 0 and diagnosis.watching and diagnosis.suspect == "j1"
    assert abs(D.seen[0] - D.q[0]) < 1e-9, "the last sample was taken"


def test_a_sample_beyond_a_turn_of_a_joint_without_end_is_the_same_sample():
    watch = detector("position")
    chain = watch._session._arm[0]["chain"]
    chain["continuous"][:3] = 1
    turned = off(1, lambda k: 2.0 * np.pi * (1 - 2 * (k % 2)), since=20)
    diagnosis = samples(watch, range(AT), turned)
    assert not diagnosis.isolated and diagnosis.suspicion < 0.5
    chain["continuous"][:3] = 0
    assert samples(watch, range(AT, AT + 12), turned).isolated["j2"].kinds == {"sensor_biased"}


@pytest.mark.parametrize("latency", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_late_samples_are_compared_with_the_reference_of_their_time(latency):
    def late(k, q):
        return q - reference(BEGIN + k)[0] + reference(BEGIN + k - latency)[0]

    in_time = samples(detector("position", delay=latency * DT), range(AT + 50), late)
    assert in_time.suspicion < 0.2
    for delay in (0.0, (latency + 1) * DT):
        watch = detector("position", delay=delay)
        samples(watch, range(AT + 50), late)
        wrong = round(delay / DT) - latency
        v = reference(BEGIN + AT + 49 - latency)[1]
        assert np.allclose(watch._session.D.e[:3], DT * wrong * v, atol=5 * SIGMA + 1e-6)


@pytest.mark.slow
def test_a_suspicion_that_calms_down_ends():
    """After 300 quiet ticks, and not before; then nothing is suspected."""
    watch = detector("position")
    samples(watch, range(AT))
    D = watch._session.D
    shift = off(0, lambda k: 1e-4 * max(min(k, 24, 60 - k), 0))
    watched = []
    for k in range(AT, AT + 420):
        diagnosis = samples(watch, range(k, k + 1), shift)
        watched.append(bool(diagnosis.watching))
    assert any(watched) and not watched[-1] and D.suspect == -1 and not diagnosis.isolated


def test_a_suspicion_without_a_finding_begins_anew_after_200_ticks():
    watch = detector("position")
    samples(watch, range(AT))
    D = watch._session.D
    D.pause = 10**6  # no verdict is asked for
    ages = []
    for k in range(AT, AT + 230):
        samples(watch, range(k, k + 1), off(0, lambda k: 0.05 * np.sin(0.2 * k)))
        ages.append(int(D.watch))
    assert max(ages) == 200
    first = ages.index(200)
    assert ages[first + 1] == 1 and D.held > 200


@pytest.mark.parametrize("what", ["tau", "effort"])
def test_torques_that_are_no_numbers_or_left_out_are_those_of_the_tick_before(what):
    def torque(k):
        return np.array([10.0, 5.0, 1.0]) + 0.1 * k

    def held(k):
        return torque(k - 1 if k in (30, 40) else k)

    def spoilt(k):
        return np.array([np.nan, np.inf, 1.0]) if k == 30 else None if k == 40 else torque(k)

    runs = []
    for given in (held, spoilt):
        watch = detector("position" if what == "tau" else "torque")
        for k in range(60):
            q = reference(BEGIN + k)[0]
            step = commanded(k, None, torque(k)) if what == "tau" else commanded(k, given(k))
            watch.update(q, None, given(k) if what == "tau" else None, step)
            if k in (30, 40):
                runs.append(getattr(watch._session.D, what)[:3].copy())
    mended = [np.array([held(30)[0], held(30)[1], 1.0]), held(40)]
    for asked, expected, found in zip(runs[:2], mended, runs[2:], strict=True):
        assert np.allclose(found, expected) and (found[:2] == asked[:2]).all()


def test_a_reference_that_is_no_number_is_the_one_before_at_rest():
    watch = detector("position")
    samples(watch, range(20))
    D = watch._session.D
    before = D.q_ref[:3].copy()
    broken = commanded(20)
    broken.q[1] = np.nan
    watch.update(reference(BEGIN + 20)[0], None, None, broken)
    assert D.q_ref[1] == before[1] and D.v_ref[1] == 0.0 == D.a_ref[1]
    assert D.q_ref[0] != before[0]


def test_no_number_at_all_at_the_first_tick_is_a_rest_at_nought():
    watch = detector("position")
    bad = np.full(3, np.nan)
    step = commanded(0)
    step.q[:] = bad
    watch.update(bad, None, None, step)
    D = watch._session.D
    assert D.q_ref[:3].tolist() == [0.0] * 3 and D.good[:3].tolist() == [0.0] * 3


def test_a_motor_at_its_limit_unasked_runs_away_though_its_joint_hardly_moves():
    """FULL of the largest torque against what is asked is enough; with what is asked it is not."""
    from ftqp.kernel.detection.fault_isolation import _runs_away

    watch = detector("torque")
    driven(watch, most=AT, measured=True)
    D, K = know_what_is_usual(watch), watch._session._arm[0]
    D.past_v[:, 1], D.kept[:, 1] = 0.0, 0.3
    for asked, given, expected in ((-0.9, 0.9, True), (0.5, 0.9, True), (0.9, 0.9, False), (0.0, 0.8, False)):
        D.motor_torque[1], D.tau[1] = asked * TAU_MAX[1], given * TAU_MAX[1]
        assert bool(_runs_away(D, K, 1, 0)) == expected, (asked, given)


@pytest.mark.parametrize("times", [1.5, 2.5, 5.0])
def test_a_joint_that_jams_within_a_tick_is_locked_however_fast_it_was(times):
    """By more than any motor could do in a tick: samples that are refused do not make the next ones wrong."""
    watch, rng = detector("position"), np.random.default_rng(2)
    way = times * watch._session.D.jump[1]
    for k in range(AT + 60):
        q, ahead = reference(BEGIN + k)[0] + SIGMA * rng.standard_normal(3), commanded(k)
        q[1] += way * min(k, AT) - reference(BEGIN + k)[0][1]
        ahead.q[1], ahead.v[1], ahead.a[1] = way * (k + 1), way / DT, 0.0
        diagnosis = watch.update(q, None, None, ahead)
    assert diagnosis.isolated["j2"].kinds == {"locked"} and list(diagnosis.isolated) == ["j2"]
    assert watch._session.D.good[1] == q[1]
