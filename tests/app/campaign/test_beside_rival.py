"""Episodes beside a rival: drawn from their number alone, and judged by what the arm did."""

import copy
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, distribution

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

from ftqp.app.campaign.beside_rival import Events, Led, counted, judged, led_by_ftqp, led_by_rival, sentences
from ftqp.app.campaign.episode_study import load_campaign, located, with_files
from ftqp.app.scenario.setup import load
from ftqp.core.errors import ScenarioError

DT, SECONDS = 1e-3, 3.0
HOLD = "simulation.holds=[{at=1.0, duration=0.5}]"
LOCK = 'faults=[{kind="locked", joint=1, at=1.0, announced="never"}]'
NONE = "faults=[]"


@pytest.fixture(scope="module")
def setup():
    return load("panda-mujoco-brake", [NONE, HOLD, "planner.detector=", "path.duration=2.0"])


@pytest.fixture(scope="module")
def locked():
    return load("panda-mujoco-brake", [LOCK, "planner.detector=", "path.duration=2.0"])


def led(setup, **changes):
    """An arm that stands where its path ends, but for what is changed."""
    t = DT * np.arange(round(SECONDS / DT))
    still = np.tile(setup.q, (len(t), 1))
    return replace(Led(t=t, q=still, v=np.zeros_like(still), named={}), **changes)


def seen(setup, ideal=None, **changes):
    return judged(setup, Events.of(setup), led(setup, **changes), ideal)


def fast(setup, joint, share, begin, end):
    """Velocities with a joint at a share of its limit for a while."""
    v = np.zeros((round(SECONDS / DT), setup.robot.nv))
    v[round(begin / DT) : round(end / DT), joint] = share * setup.robot.limits.v_max[joint]
    return v


def test_arm_that_ends_at_its_target_within_limits_has_finished(setup):
    found = seen(setup)
    assert found["finished"] and sentences(found, healthy=True) == []
    q = np.tile(setup.q, (round(SECONDS / DT), 1))
    q[-1, 1] += 0.05
    assert not seen(setup, q=q)["finished"] and not seen(setup, q=q)["broken"]


def test_planted_leap_after_a_hold_is_seen_and_the_same_speed_before_it_is_not_one(setup):
    found = seen(setup, v=fast(setup, 2, 1.2, 1.6, 1.7))
    assert found["leapt"] and found["broken"] and not found["finished"]
    assert any("leap after a hold" in one for one in sentences(found, healthy=True))
    assert not seen(setup, v=fast(setup, 2, 1.2, 0.5, 0.6))["leapt"]
    usual = fast(setup, 2, 1.2, 0.5, 0.6) + fast(setup, 2, 1.3, 1.6, 1.7)
    assert not seen(setup, v=usual)["leapt"]


def test_planted_accusation_and_stop_are_seen(setup):
    found = seen(setup, named={3: 0.7}, stopped="the arm does not follow")
    assert found["accused"] == [setup.robot.joints[3]] and not found["finished"]
    said = " ".join(sentences(found, healthy=True))
    assert "accused while healthy" in said and "stopped though healthy: the arm does not follow" in said


def test_range_that_is_left_is_a_broken_limit(setup):
    q = np.tile(setup.q, (round(SECONDS / DT), 1))
    q[5, 3] = setup.robot.limits.q_max[3] + 0.03
    found = seen(setup, q=q)
    assert found["broken"]
    assert sentences(found, healthy=True) == [
        "limits are broken: a joint that obeys goes 0.03 rad or m beyond its range"
    ]


def test_lock_that_matters_is_found_late_or_never_and_its_joint_may_be_fast(locked):
    t = DT * np.arange(round(SECONDS / DT))
    ideal = np.tile(locked.q, (len(t), 1))
    assert seen(locked, ideal)["locks"] == {}  # the joint would not have moved
    ideal[:, 1] += 0.1 * t
    name = locked.robot.joints[1]
    assert seen(locked, ideal)["locks"] == {name: None}
    assert seen(locked, ideal, named={1: 1.25})["locks"] == {name: pytest.approx(0.25)}
    early = seen(locked, ideal, named={1: 0.5})
    assert early["accused"] == [name] and early["locks"] == {name: None}
    assert not seen(locked, ideal, v=fast(locked, 1, 3.0, 1.1, 1.2))["broken"]
    assert seen(locked, ideal, v=fast(locked, 1, 3.0, 0.5, 0.6))["broken"]


@pytest.mark.long
@pytest.mark.parametrize("drive", ["position", "torque"])
def test_arm_that_is_as_its_model_says_is_finished_by_both(drive):
    content = [NONE, "planner.detector=", f"planner.drive={drive}", "path.duration=2.0"]
    for lead in (led_by_ftqp, led_by_rival):
        one = load("panda-mujoco-brake", [*content, "simulation.duration=3.0"])
        found = judged(one, Events.of(one), lead(one), None)
        assert found["finished"] and not found["accused"], found


def test_encoder_that_is_off_by_a_turn_is_healthy_and_one_that_is_off_by_less_is_not():
    for size, healthy in ((2.0 * np.pi, True), (0.2, False)):
        fault = f'sensors.faults=[{{kind="offset", joint=2, at=1.0, size={size}}}]'
        assert Events.of(load("panda-mujoco-brake", [NONE, fault])).healthy is healthy


def test_counts_are_by_group_and_over_all(setup):
    one = {"healthy": True} | dict.fromkeys(("ftqp", "rival"), seen(setup, stopped="why"))
    rows = counted([({"event": "hold"}, one), ({"event": "nothing"}, one)], ["event"])
    assert [(row["name"], row["episodes"], row["ftqp"]["stopped"]) for row in rows] == [
        ("hold", 1, 1),
        ("nothing", 1, 1),
        ("all", 2, 2),
    ]


def test_files_of_packages_are_found_and_what_is_absent_is_named_once():
    assert located({"a": ["wheel:numpy/numpy/__init__.py"]})["a"][0].endswith("numpy/__init__.py")
    arms = {name: {"robot": {"urdf": f"wheel:no-such-package/{name}"}} for name in ("one", "two")}
    kept, told = with_files({"arm": arms | {"three": {}}}, "it")
    assert list(kept["arm"]) == ["three"]
    assert told == ["arm one, two of it left out, as package no-such-package is not installed"]
    with pytest.raises(ScenarioError, match=r"bundles\.arm has nothing left to draw"):
        with_files({"arm": arms}, "it")


@pytest.fixture(scope="module")
def strangers():
    try:
        distribution("example-robot-data")
    except PackageNotFoundError:
        pytest.skip('needs the extra "robots": pip install -e ".[robots]"')
    return load_campaign("strangers")


def test_episode_of_strangers_is_drawn_from_its_number(strangers):
    first = copy.deepcopy(strangers.drawn(7))
    assert strangers.drawn(8) != first and load_campaign("strangers").drawn(7) == first
    drawn = [strangers.drawn(number)[1] for number in range(60)]
    for group, least in (("arm", 9), ("drive", 3), ("leader", 3), ("event", 15)):
        assert len({one[group] for one in drawn}) >= least
