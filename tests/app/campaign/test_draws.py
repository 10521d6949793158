"""What a campaign draws: from the number of the episode alone, and nothing that a file may not ask for."""

import numpy as np
import pytest

from ftqp.app.campaign.draws import episode, refuse_wrong
from ftqp.app.campaign.episode_study import ABSENT, KnownArms, named_files
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
    for vary in ({"start.q": what}, {"start": [{}], "start.q": what}):
        with pytest.raises(InputError, match=message):
            refuse_wrong(SCENARIO, vary)
    if isinstance(what, dict) and what:
        with pytest.raises(InputError, match=message):
            refuse_wrong(SCENARIO, {"start.q": what | {"chance": 0.0}})


@pytest.mark.parametrize("key", ["path.kind.x", "faults.7.at", "faults.x"])
def test_key_that_leads_nowhere_is_refused(key):
    for refuse in (refuse_wrong, lambda *tables: episode(*tables, 0, 0)):
        with pytest.raises(InputError, match="leads to no table of the scenario"):
            refuse(SCENARIO, {key: [1]})
    with pytest.raises(InputError, match="leads to no table of the scenario"):
        refuse_wrong(SCENARIO, {key: {"one_of": [1], "chance": 0.0}})


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
    refuse_wrong(scenario, vary, BUNDLES)


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
