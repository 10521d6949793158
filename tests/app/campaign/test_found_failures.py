"""What a campaign says of detectors: shares with their intervals, and the rate of false alarms."""

import pytest
from scipy.stats import binomtest

from ftqp.app.campaign.found_failures import COLUMNS, detector_summary, share_interval


def row(**values):
    zero = dict.fromkeys(COLUMNS, 0) | {"healthy_time": 3600.0, "delay": None, "found_as": ""}
    return zero | values


def test_episodes_without_a_detector_say_nothing():
    assert detector_summary([dict.fromkeys(COLUMNS)]) is None


def test_hours_without_a_false_alarm_bound_their_rate():
    found = detector_summary([row(), row(), dict.fromkeys(COLUMNS)])
    assert found["healthy_hours"] == 2.0 and found["false_alarms"] == 0
    assert found["false_alarms_per_hour_at_most"] == pytest.approx(2.9957 / 2.0, rel=1e-4)


def test_failures_are_counted_by_what_was_said_of_them():
    rows = [row(unannounced=1, found=1, right_kind=1, delay=0.1 * k, found_as="locked") for k in range(1, 4)]
    found = detector_summary([*rows, row(unannounced=1, wrong_joint=1, false_alarms=2)])
    assert (found["unannounced"], found["found"], found["right_kind"], found["wrong_joint"]) == (4, 3, 3, 1)
    assert found["delay"]["median"] == pytest.approx(0.2) and found["delay"]["max"] == pytest.approx(0.3)
    assert found["found_as"] == {"locked": 3}
    assert found["false_alarms_per_hour"] == 0.5


def test_interval_of_a_share_is_that_of_clopper_and_pearson():
    wanted = binomtest(7, 50).proportion_ci(0.95, method="exact")
    assert share_interval(7, 50) == pytest.approx((wanted.low, wanted.high))
    assert share_interval(0, 100) == pytest.approx((0.0, 1.0 - 0.05**0.01))
    assert share_interval(100, 100) == pytest.approx((0.05**0.01, 1.0))
    assert share_interval(0, 0) is None
