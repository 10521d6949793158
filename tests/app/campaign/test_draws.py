"""What a campaign draws, from the number of the episode alone, and what its rows come to."""

import json

import numpy as np
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
from ftqp.app.campaign.draws import episode, refuse_wrong
from ftqp.app.campaign.episode_study import ABSENT, COLUMNS, KnownArms, named_files
from ftqp.app.scenario.setup import shoulder
from ftqp.core.errors import InputError
from ftqp.model import catalog

SCENARIO = {
    "robot": {"name": "planar"},
    "path": {"kind": "circle", "duration": 2.0},
    "faults": [{"kind": "locked", "joint": 0, "at": 0.0}],
}


ARMS = KnownArms()


def drawn(vary, numbers=200, seed=0):
    return [episode(SCENARIO, vary, seed, number, ARMS)[1] for number in range(numbers)]


def test_episode_is_the_same_whichever_others_are_drawn():
    vary = {"planner.dt": [0.001, 0.002], "path.radius": {"uniform": [0.1, 0.2]}, "start.q": {"start": 0.1}}
    first = episode(SCENARIO, vary, 3, 17)
    drawn(vary, 5, seed=3)
    assert episode(SCENARIO, vary, 3, 17) == first
    assert episode(SCENARIO, vary, 4, 17) != first != episode(SCENARIO, vary, 3, 18)
    assert "planner" not in SCENARIO  # what episodes share is left as it is


def test_numbers_follow_their_distribution():
    vary = {
        "a": {"uniform": [2.0, 3.0]},
        "b": {"log_uniform": [1e-3, 1e3]},
        "c": {"normal": [5.0, 0.1]},
        "d": {"integers": [1, 3]},
        "e": {"one_of": ["x", "y"], "weights": [9, 1]},
    }
    found = drawn(vary, 1000)
    a, b, c = (np.array([one[key] for one in found]) for key in "abc")
    assert 2.0 <= a.min() < 2.05 and 2.95 < a.max() <= 3.0
    assert abs(np.median(np.log10(b))) < 0.3 and b.min() < 1e-2
    assert abs(c.mean() - 5.0) < 0.02 and abs(c.std() - 0.1) < 0.02
    assert {one["d"] for one in found} == {1, 2, 3}
    assert 850 < sum(one["e"] == "x" for one in found) < 950


def test_number_may_depend_on_another_one():
    vary = {
        "path.duration": {"uniform": [1.0, 4.0]},
        "faults.0.at": {"uniform": [0.5, 0.5], "times": "path.duration"},
        "faults.0.announced": {"uniform": [0.1, 0.2], "plus": "faults.0.at"},
    }
    for number in range(20):
        tables, found = episode(SCENARIO, vary, 0, number)
        assert found["faults.0.at"] == 0.5 * found["path.duration"] == tables["faults"][0]["at"]
        assert 0.1 <= found["faults.0.announced"] - found["faults.0.at"] <= 0.2


def test_joint_and_start_are_those_of_the_arm_that_was_drawn():
    vary = {"faults.0.joint": {"joint": "any"}, "start.q": {"start": 0.2}, "robot.name": ["panda", "planar"]}
    joints = {"panda": set(), "planar": set()}
    for one in drawn(vary, 100):
        robot = catalog.load(one["robot.name"])
        joints[robot.name.partition("(")[0]].add(one["faults.0.joint"])
        assert len(one["start.q"]) == robot.nv
        assert (robot.limits.q_min < one["start.q"]).all() and (one["start.q"] < robot.limits.q_max).all()
    assert joints["panda"] == set(range(7)) and max(joints["planar"]) == catalog.load("planar").nv - 1


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ([], "expected a list of at least one value"),
        (3, "expected a list of values or a distribution"),
        ({}, "names 0 distributions"),
        ({"uniform": [1, 2], "normal": [0, 1]}, "names 2 distributions"),
        ({"unifrom": [1, 2]}, "did you mean 'uniform'"),
        ({"uniform": [2, 1]}, r"expected \[low, high\] with low <= high"),
        ({"uniform": [1]}, "expected two numbers"),
        ({"uniform": [1, float("nan")]}, "expected two numbers"),
        ({"log_uniform": [0, 1]}, "with 0 < low <= high"),
        ({"away": [-1, 0]}, "with 0 <= low <= high"),
        ({"normal": [0, -1]}, "deviation"),
        ({"one_of": [1, 2], "weights": [0, 0]}, "not all 0"),
        *(
            ({"one_of": [1, 2], "weights": weights}, r"expected 2 numbers >= 0 up to 1e\+15, not all 0")
            for weights in ("12", 3, ["1_000", "\uff12"], [True, False], [1e308, 1e308], [1, -1])
        ),
        ({"uniform": [1, 2], "times": "path.kind"}, "which is no number"),
        ({"uniform": [1, 2], "plus": "nowhere.x"}, "which is no number"),
        ({"one_of": [1, 2], "plus": "path.duration"}, "together with one_of"),
        ({"start": 2.0}, "share of the range"),
        ({"start": True}, "share of the range"),
        ({"joint": 3}, 'expected "any"'),
    ],
)
def test_wrong_distribution_is_said_with_its_key_and_before_anything_is_drawn(what, message):
    with pytest.raises(InputError, match=message) as refused:
        episode(SCENARIO, {"start.q": what}, 0, 0)
    assert "vary.start.q" in str(refused.value)
    if message != "which is no number":
        more = {"chance": 0.0} if what and isinstance(what, dict) else None
        with pytest.raises(InputError, match=message):
            refuse_wrong({"start.q": what | more if more else what})


@pytest.mark.parametrize("key", ["path.kind.x", "faults.7.at", "faults.x"])
def test_key_that_leads_nowhere_is_refused(key):
    with pytest.raises(InputError, match="leads to no table of the scenario"):
        episode(SCENARIO, {key: [1]}, 0, 0)


def test_key_with_a_chance_is_drawn_as_often_as_it_says():
    vary = {"planner.dt": {"one_of": [0.004], "chance": 0.25}}
    found = drawn(vary, 1000)
    assert 200 < sum("planner.dt" in one for one in found) < 300
    without = next(number for number, one in enumerate(found) if not one)
    assert "planner" not in episode(SCENARIO, vary, 0, without)[0]
    assert drawn({"planner.dt": {"one_of": [1], "chance": 0.0}}) == [{}] * 200


def test_keys_of_a_list_that_was_drawn_shorter_are_left_out():
    lock = {"kind": "locked", "joint": 0, "at": 0.0}
    vary = {
        "faults": [[], [lock]],
        "faults.0.at": {"uniform": [0.5, 1.0]},
        "faults.0.joint": {"joint": "any"},
    }
    healthy = 0
    for number in range(40):
        tables, found = episode(SCENARIO, vary, 0, number)
        if found["faults"]:
            assert tables["faults"][0]["at"] == found["faults.0.at"] >= 0.5
            assert found["faults"] == [lock]
        else:
            assert tables["faults"] == [] and list(found) == ["faults"]
            healthy += 1
    assert 10 < healthy < 30


def test_way_leads_so_many_lengths_of_the_arm_away_from_its_shoulder():
    vary = {
        "path.displacement": {"away": [0.9, 1.1]},
        "start.q": {"start": 0.2},
        "robot.name": ["panda", "iiwa14"],
    }
    for one in drawn(vary, 20):
        robot = catalog.load(one["robot.name"])
        centre, reach = shoulder(robot)
        end = robot.pose(np.array(one["start.q"]))[:3, 3] + one["path.displacement"]
        assert 0.9 <= np.linalg.norm(end - centre) / reach <= 1.1


@pytest.fixture
def folder(tmp_path):
    for name in ("a.urdf", "b.urdf", "way.csv"):
        (tmp_path / name).write_text(name)
    return tmp_path


@pytest.mark.parametrize(
    ("scenario", "vary", "names"),
    [
        ({"robot": {"name": "a.urdf"}, "description": "way.csv"}, {"planner.dt": [0.1]}, []),
        ({"robot": {"urdf": "a.urdf"}, "path": {"file": "way.csv"}}, {}, ["a.urdf", "way.csv"]),
        ({}, {"robot.urdf": ["b.urdf", "a.urdf"]}, ["a.urdf", "b.urdf"]),
        ({}, {"robot": {"one_of": [{"mjcf": "a.urdf"}], "chance": 0.5}}, ["a.urdf"]),
        ({}, {"path.file": {"one_of": ["way.csv"]}}, ["way.csv"]),
        ({"base": {"disturbances": [{"kind": "recorded", "file": "way.csv"}]}}, {}, ["way.csv"]),
        ({"planner": {"plan": "way.csv", "profile": "a.urdf"}}, {}, ["a.urdf", "way.csv"]),
        ({}, {"planner.detector": [{"calibration": "way.csv"}]}, ["way.csv"]),
    ],
)
def test_file_is_found_where_a_key_names_it(folder, scenario, vary, names):
    found = named_files(scenario, vary, folder)
    assert list(found) == names and ABSENT not in found.values()


def test_hash_is_that_of_the_bytes_and_files_that_are_not_there_have_none(folder):
    scenario = {"robot": {"urdf": "a.urdf"}}
    first = named_files(scenario, {}, folder)
    (folder / "a.urdf").write_text("changed")
    assert named_files(scenario, {}, folder) != first
    for name in ("nowhere", ".", "x" * 300, "\0"):
        assert named_files({"robot": {"urdf": name}}, {}, folder) == {name: ABSENT}


BUNDLES = {
    "what": {
        "nothing": {"weight": 3},
        "lock": {"faults": [{"kind": "locked", "joint": 0, "at": 0.0}]},
        "slow": {"planner.dt": 0.01},
    }
}


def test_bundle_is_drawn_as_a_whole_and_what_it_has_is_not_drawn_again():
    vary = {"planner.dt": [0.001, 0.002], "faults.0.joint": {"joint": "any"}, "faults.0.reset": ["task"]}
    scenario = {key: SCENARIO[key] for key in ("robot", "path")}
    counts = dict.fromkeys(BUNDLES["what"], 0)
    for number in range(200):
        tables, found = episode(scenario, vary, 0, number, ARMS, bundles=BUNDLES)
        counts[found["what"]] += 1
        assert ("faults" in tables) == ("faults.0.joint" in found) == (found["what"] == "lock")
        assert "faults.0.reset" not in found  # the entry of the bundle does not have it
        assert (tables["planner"]["dt"] == 0.01) == (found["what"] == "slow")
    assert 90 < counts["nothing"] < 150 and min(counts.values()) > 20
    assert BUNDLES["what"]["lock"]["faults"][0]["joint"] == 0
    refuse_wrong(vary, BUNDLES)


def test_numbers_of_the_arm_scale_with_it():
    arm = catalog.load("panda")
    scenario = SCENARIO | {"robot": {"name": "panda"}}
    vary = {
        "a": {"each": [0.5, 2.0]},
        "b": {"each": [0.1, 0.2], "of": "torque"},
        "c": {"vector": [0.1, 0.2], "of": "length"},
        "d": {"share": [1.0, 1.0], "of": "load"},
        "e": {"share": [1.0, 1.0], "of": "weight"},
        "start.q": {"regular": 0.1},
    }
    for number in range(20):
        found = episode(scenario, vary, 0, number, ARMS)[1]
        assert list(found["a"]) == list(found["b"]) == list(arm.joints)
        assert all(0.5 <= x <= 2.0 for x in found["a"].values()) and len(set(found["a"].values())) == 7
        shares = np.array(list(found["b"].values())) / arm.limits.tau_max
        assert shares.min() >= 0.1 and shares.max() <= 0.2
        assert 0.1 * 0.8 < np.linalg.norm(found["c"]) < 0.2 * 1.5  # a Panda is about a metre long
        assert 0.0 < found["d"] < 20.0 and found["e"] == pytest.approx(9.81 * found["d"])
        J = arm.jacobian(found["start.q"]).copy()
        J[:3] /= arm.length
        assert np.linalg.svd(J, compute_uv=False)[-1] >= 0.1


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
