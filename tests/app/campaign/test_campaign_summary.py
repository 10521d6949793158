"""What the rows of a campaign come to: values by size, and ranges where there are many."""

import json

import pytest
from scipy.stats import binomtest

from ftqp.app.campaign.campaign_summary import COLUMNS as OF_DETECTORS
from ftqp.app.campaign.campaign_summary import (
    RANGES,
    detector_summary,
    fallback_share,
    share_interval,
    summary,
)
from ftqp.app.campaign.episode_study import COLUMNS


def row(number, drawn, outcome="sound", **values):
    return dict.fromkeys(("episode", *COLUMNS)) | {
        "episode": number,
        "drawn": json.dumps(drawn),
        "outcome": outcome,
        "ticks": 10,
        **values,
    }


def test_many_numbers_are_told_by_ranges_with_as_many_episodes_each():
    rows = [row(k, {"at": 0.01 * k, "q": [k]}, "broken" if k > 90 else "sound") for k in range(100)]
    found = summary("x", rows)["by_key"]
    assert list(found) == ["at"] and len(found["at"]) == RANGES
    assert [value["episodes"] for value in found["at"].values()] == [20] * RANGES
    assert [value["broken"] for value in found["at"].values()] == [0, 0, 0, 0, 9]
    assert next(iter(found["at"])) == "0 to 0.19"


def test_numbers_of_few_episodes_are_in_ranges_and_those_that_repeat_are_not():
    rows = [row(k, {"at": 0.123456789 * k, "joint": k % 6}) for k in range(12)]
    found = summary("x", rows)["by_key"]
    assert [value["episodes"] for value in found["at"].values()] == [2, 2, 3, 2, 3]
    assert next(iter(found["at"])) == "0 to 0.1235"
    assert list(found["joint"]) == ["0", "1", "2", "3", "4", "5"]


def test_ticks_whose_answer_was_not_used_are_told_by_value():
    said = [{"OK": 190, "FALLBACK": 10}, {"OK": 97, "FALLBACK": 3}, {"STOPPED": 50}, None]
    rows = [
        row(k, {"backend": "ab"[k > 1]}, said=None if one is None else json.dumps(one))
        for k, one in enumerate(said)
    ]
    found = summary("x", [*rows, row(4, {"backend": "c"}, "refused")])["by_key"]["backend"]
    assert [found[name]["fallbacks"] for name in "abc"] == [13, 0, 0]
    assert [found[name]["ticks"] for name in "abc"] == [300, 50, 0]
    assert [fallback_share(found[name]) for name in "abc"] == ["4.33 %", "0.00 %", "-"]


def test_broken_episodes_have_an_interval_and_laws_their_counts():
    rows = [row(k, {}) for k in range(98)]
    rows += [row(98, {}, "broken", law_honesty=0.5, sentences="x"), row(99, {}, "raised", sentences="y")]
    found = summary("x", rows)
    assert found["bound"] is None
    assert found["broken_interval"] == pytest.approx((0.00243134, 0.0703839), rel=1e-4)
    assert (found["violations"], found["exceptions"], found["false_ok"], found["swings"]) == (1, 1, 1, 0)
    assert [one["episode"] for one in found["examples"]] == [98, 99]


def test_failures_are_told_by_arm_joint_and_instant_and_those_without_a_motion_apart():
    def failed(number, arm, joint, since, feasible=1, finished=1, stopped=0):
        names = ("arm", "joint", "since", "feasible", "finished", "stopped")
        given = (arm, joint, since, feasible, finished, stopped)
        return row(number, {}, **{f"rest_{name}": one for name, one in zip(names, given, strict=True)})

    rows = [
        failed(0, "panda", 2, 0.1),
        failed(1, "panda", 4, 0.5, finished=0),
        failed(2, "iiwa14", 4, 1.0, finished=0, stopped=1),
        failed(3, "iiwa14", 7, 0.9, feasible=0, finished=0, stopped=1),
        row(4, {}),
    ]
    found = summary("x", rows)["after_failures"]
    assert (found["all"]["failures"], found["all"]["finished"], found["stopped"]) == (3, 1, 1)
    assert found["all"]["interval"] == pytest.approx((0.00840376, 0.905701), rel=1e-4)
    assert list(found["by"]) == [
        "iiwa14", "panda", "0 to 33 % of the motion", "33 to 66 % of the motion", "66 to 100 % of the motion",
        "joint 2", "joint 4",
    ]  # fmt: skip
    assert found["by"]["joint 4"] == {
        "failures": 2, "finished": 0, "interval": found["by"]["joint 4"]["interval"]
    }  # fmt: skip
    assert found["unproven"]["failures"] == 1
    assert summary("x", [row(0, {})])["after_failures"] is None


def watched(**values):
    zero = dict.fromkeys(OF_DETECTORS, 0) | {"healthy_time": 3600.0, "delay": None, "found_as": ""}
    return zero | values


def test_hours_without_a_false_alarm_bound_their_rate():
    found = detector_summary([watched(), watched(), dict.fromkeys(OF_DETECTORS)])
    assert found["healthy_hours"] == 2.0 and found["false_alarms"] == 0
    assert found["false_alarms_per_hour_at_most"] == pytest.approx(2.9957 / 2.0, rel=1e-4)


def test_failures_are_counted_by_what_was_said_of_them():
    rows = [
        watched(unannounced=1, found=1, right_kind=1, delay=0.1 * k, found_as="locked") for k in range(1, 4)
    ]
    found = detector_summary([*rows, watched(unannounced=1, wrong_joint=1, false_alarms=2)])
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
