"""What the encoders make of the truth, in which order, and that they make nothing of it by default."""

import numpy as np
import pytest

from ftqp.control.paths import Circle
from ftqp.control.planner.planner import Planner
from ftqp.core.errors import InputError
from ftqp.sim.loop import Simulation
from ftqp.sim.plants.plant import Motors
from ftqp.sim.sensors.joint_sensors import Drifting, Dropped, Frozen, JointSensors, Offset, Scattered

DT = 1e-3
TRUTH = np.random.default_rng(3).normal(size=(2, 400, 7))


def seen(sensors, count=50):
    """What is measured of the first samples of TRUTH, (count, nv) twice."""
    q, v = np.zeros((count, 7)), np.zeros((count, 7))
    for k in range(count):
        sensors.measure(TRUTH[0, k], TRUTH[1, k])
        q[k], v[k] = sensors.q, sensors.v
    return q, v


def test_perfect_sensors_hand_the_truth_on_bit_by_bit(panda):
    q, v = seen(JointSensors(panda, DT))
    np.testing.assert_array_equal(q, TRUTH[0, :50])
    np.testing.assert_array_equal(v, TRUTH[1, :50])


def test_run_with_perfect_sensors_is_the_run_without(panda):
    path = Circle(panda.pose(panda.neutral), 0.05, duration=0.3)
    runs = [
        Simulation(Planner(panda, DT), path, q=panda.neutral, sensors=sensors, log="memory").run()
        for sensors in (None, JointSensors(panda, DT))
    ]
    np.testing.assert_array_equal(runs[0].log["q"], runs[1].log["q"])
    np.testing.assert_array_equal(runs[1].log["q_measured"], runs[1].log["q"])
    np.testing.assert_array_equal(runs[1].log["q_command"][:-1], runs[1].log["q"][1:])
    assert "q_measured" not in {name.partition(".")[0] for name in runs[0].log.names}


def test_late_sensors_repeat_the_first_sample_then_lag_by_whole_ticks(panda):
    q, v = seen(JointSensors(panda, DT, latency=3))
    np.testing.assert_array_equal(q[:4], TRUTH[0, [0, 0, 0, 0]])
    np.testing.assert_array_equal(q[3:], TRUTH[0, :47])
    np.testing.assert_array_equal(v[3:], TRUTH[1, :47])


def test_steps_come_after_the_delay_and_before_the_bias(panda):
    q, _ = seen(JointSensors(panda, DT, latency=2, quantum=0.25, bias=0.1))
    np.testing.assert_allclose(q[2:], 0.25 * np.round(TRUTH[0, :48] / 0.25) + 0.1, atol=1e-15)
    own, _ = seen(JointSensors(panda, DT, bias=np.arange(7.0)))
    np.testing.assert_allclose(own, TRUTH[0, :50] + np.arange(7.0), atol=1e-15)


def test_noise_has_its_deviation_and_comes_again_after_a_reset(panda):
    sensors = JointSensors(panda, DT, position_noise=1e-3, velocity_noise=0.1, seed=5)
    q, v = seen(sensors, 400)
    assert np.std(q - TRUTH[0]) == pytest.approx(1e-3, rel=0.05)
    assert np.std(v - TRUTH[1]) == pytest.approx(0.1, rel=0.05)
    sensors.reset()
    np.testing.assert_array_equal(seen(sensors, 400)[0], q)
    other, _ = seen(JointSensors(panda, DT, position_noise=1e-3, velocity_noise=0.1, seed=6), 400)
    assert not np.array_equal(other, q)


def test_frozen_encoder_repeats_its_last_reading_noise_included(panda):
    fault = Frozen(joint="panda_joint3", at=0.02, samples=10)
    q, v = seen(JointSensors(panda, DT, position_noise=1e-3, faults=[fault]))
    assert (q[20:30, 2] == q[19, 2]).all()
    assert (v[20:30, 2] == v[19, 2]).all()
    assert q[30, 2] != q[19, 2]
    assert len(set(q[20:30, 1])) == 10


def test_dropped_encoder_reads_nan_for_so_many_samples(panda):
    q, v = seen(JointSensors(panda, DT, faults=[Dropped(joint=0, at=0.01, samples=3)]))
    np.testing.assert_array_equal(np.isnan(q[:, 0]), [10 <= k < 13 for k in range(50)])
    np.testing.assert_array_equal(np.isnan(v), np.isnan(q))
    every, _ = seen(JointSensors(panda, DT, faults=[Dropped(at=0.01)]))
    assert np.isnan(every[10:]).all()


def test_spike_and_wrap_add_a_constant_for_so_many_samples(panda):
    faults = [
        Offset(joint=1, at=0.01, samples=1, size=0.5, speed=50.0),
        Offset(joint=2, at=0.02, size=2 * np.pi),
    ]
    q, v = seen(JointSensors(panda, DT, faults=faults))
    wrong = q - TRUTH[0, :50]
    np.testing.assert_allclose(wrong[10, 1], 0.5, atol=1e-15)
    np.testing.assert_allclose(v[10, 1] - TRUTH[1, 10, 1], 50.0, atol=1e-12)
    assert not wrong[11:, 1].any()
    np.testing.assert_allclose(wrong[20:, 2], 2 * np.pi, atol=1e-14)


def test_fault_lasts_for_its_duration_whatever_the_period_is(panda):
    for dt, count in ((1e-3, 30), (1e-2, 3)):
        sensors = JointSensors(panda, dt, faults=[Dropped(at=2.0 * dt, duration=0.03)])
        silent = []
        for _ in range(40):
            sensors.measure(panda.neutral, np.zeros(7))
            silent.append(bool(np.isnan(sensors.q).any()))
        assert silent == [False] * 2 + [True] * count + [False] * (38 - count)
    with pytest.raises(InputError, match="samples and duration both say how long"):
        Dropped(at=0.0, samples=3, duration=0.1)


def test_drift_grows_by_its_rate(panda):
    q, v = seen(JointSensors(panda, DT, faults=[Drifting(joint=4, at=0.01, rate=0.2)]))
    np.testing.assert_allclose(q[10:, 4] - TRUTH[0, 10:50, 4], 0.2 * DT * np.arange(1, 41), atol=1e-14)
    np.testing.assert_allclose(v[10:, 4] - TRUTH[1, 10:50, 4], 0.2, atol=1e-14)


def test_scattered_readings_are_a_share_of_all(panda):
    q, _ = seen(JointSensors(panda, DT, faults=[Scattered(share=0.1, size=0.5)], seed=2), 400)
    wrong = q != TRUTH[0]
    assert wrong.mean() == pytest.approx(0.1, abs=0.02)
    assert np.std((q - TRUTH[0])[wrong]) == pytest.approx(0.5, rel=0.1)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda r: JointSensors(r, DT, latency=-1), "latency of the sensors is -1, expected a whole number"),
        (lambda r: JointSensors(r, DT, latency=1.5), "latency of the sensors is 1.5"),
        (lambda r: JointSensors(r, DT, bias=[0.0, 1.0]), r"bias of the sensors has shape \(2,\)"),
        (lambda r: JointSensors(r, DT, bias=np.inf), "bias of the sensors is infinite"),
        (lambda r: JointSensors(r, DT, faults=[Frozen(joint="j9")]), "'j9' is not a joint of panda"),
        (lambda r: Scattered(share=1.5), "share is 1.5, expected a share of the samples"),
    ],
)
def test_wrong_values_are_refused_with_a_sentence(panda, make, message):
    with pytest.raises(InputError, match=message):
        make(panda)


def test_torques_are_measured_as_late_as_positions_and_only_where_there_are_sensors(panda):
    still = np.zeros(7)
    sensors = JointSensors(panda, DT, latency=2, torque_noise=0.0)
    for k in range(5):
        sensors.measure(still, still, Motors(np.full(7, 1.0 * k), np.full(7, 10.0 * k)))
    assert (sensors.tau == 2.0).all() and (sensors.demand == 20.0).all()
    without = JointSensors(panda, DT, latency=2)
    without.measure(still, still, Motors(still, still))
    assert without.tau is None and (without.demand == 0.0).all() and not without.feels_torque


def test_noise_of_torques_leaves_that_of_positions_as_it_was(panda):
    still, readings = np.zeros(7), []
    for noise in (None, 0.3):
        sensors = JointSensors(panda, DT, position_noise=1e-4, torque_noise=noise, seed=3)
        sensors.measure(still, still, Motors(still, still))
        readings.append(sensors.q.copy())
    assert (readings[0] == readings[1]).all() and 0.05 < np.std(sensors.tau) < 1.0
    with pytest.raises(InputError, match="torque noise"):
        JointSensors(panda, DT, torque_noise=-1.0)
