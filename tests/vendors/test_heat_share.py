"""Heat lowers a joint's share, and gives it back; it never takes the place of a fault."""

import numpy as np
import pytest
from tests.going import PANDA, started

import ftqp

JOINT = PANDA.joints[3]


def spared(dt=0.05, **given):
    planner = started(PANDA, dt=dt, task=ftqp.Task("position"))
    return planner, ftqp.vendors.Spare(planner, JOINT, **({"warm": 50.0, "hot": 65.0} | given))


def test_the_share_falls_from_warm_to_hot_and_is_reported_in_tenths():
    planner, spare = spared()
    told, shares = [], []
    for k in range(800):
        verdict = spare.look(45.0 + 0.05 * k)
        shares.append(spare.share)
        if verdict is not None:
            told.append((k, planner.faults.get(JOINT), verdict))
    assert shares[0] == 1.0 and shares[-1] == 0.3 and (np.diff(shares) <= 0).all()
    assert shares[250] == pytest.approx(1.0 - 0.7 * 0.5, abs=1e-9)
    reports = [(k, fault.velocity, fault.torque) for k, fault, _ in told]
    assert all(v == t for _, v, t in reports) and reports[-1][1] == 0.3
    assert min(np.diff([k for k, *_ in reports if k < 400])) >= 20  # a second
    rest = [verdict for *_, verdict in told if "rest it" in verdict.why]
    assert len(rest) == 1 and rest[0].recovery[0].by == "person" and rest[0].arm == "goes_on"


def test_it_is_given_back_three_kelvin_later_and_withdrawn_at_one():
    planner, spare = spared()
    for _ in range(30):
        spare.look(57.5)
    assert planner.faults[JOINT].velocity == pytest.approx(0.65)
    for _ in range(30):
        assert spare.look(55.0) is None  # within 3 K
    for _ in range(30):
        spare.look(50.0)
    assert planner.faults[JOINT].velocity == pytest.approx(1.0 - 0.7 * 3.0 / 15.0)
    for _ in range(30):
        spare.look(46.9)
    assert not planner.faults and spare.share == 1.0


def test_what_somebody_withdraws_is_reported_again_while_it_is_hot():
    planner, spare = spared()
    for _ in range(30):
        spare.look(60.0)
    told = planner.faults[JOINT]
    planner.withdraw(JOINT)
    for _ in range(30):
        spare.look(60.0)
    assert planner.faults == {JOINT: told}


@pytest.mark.parametrize(
    "fault", [ftqp.Locked(JOINT), ftqp.FreeSwinging(JOINT), ftqp.Degraded(JOINT, velocity=0.5)]
)
def test_heat_takes_the_place_of_no_fault_that_was_reported(fault):
    planner, spare = spared()
    planner.report(fault)
    for value in (*np.linspace(40, 80, 200), *np.linspace(80, 30, 200)):
        spare.look(float(value))
        assert planner.faults == {JOINT: fault}


@pytest.mark.parametrize("seed", range(3))
def test_whatever_is_measured_shares_are_in_range_and_reports_are_rare(seed):
    draw = np.random.default_rng(seed)
    planner, spare = spared()
    last, present = -np.inf, planner.faults
    for k in range(2000):
        value = draw.choice([np.nan, 57.0 + 20.0 * draw.normal(), 1e9, -1e9, 60.0])
        spare.look(float(value))
        assert 0.3 <= spare.share <= 1.0
        if planner.faults != present:
            assert k - last >= 20
            last, present = k, planner.faults
    assert present is not None and last > 0


def test_a_load_is_looked_at_by_its_mean():
    planner, spare = spared(warm=0.6, hot=0.9, over=10.0)
    spare.look(0.2)
    for _ in range(40):
        spare.look(1.0)  # two seconds of full load
    assert not planner.faults
    for _ in range(600):
        spare.look(1.0)
    assert planner.faults[JOINT].torque < 0.4


def test_a_makers_limit_says_what_is_warm_and_hot():
    planner, spare = spared(warm=None, hot=None, limit=70.0)
    for _ in range(30):
        spare.look(57.5)
    assert planner.faults[JOINT].velocity == pytest.approx(0.65)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"warm": 65.0}, "warm is 65, expected less than hot, 65"),
        ({"warm": 70.0}, "warm is 70, expected less than hot, 65"),
        ({"still": 0.0}, "still"),
        ({"still": 1.5}, r"still is 1.5, expected a share in \(0, 1\]"),
        ({"warm": None}, "warm and hot are not both given"),
        ({"over": 0.0}, "over"),
    ],
)
def test_what_makes_no_share_is_refused(given, words):
    with pytest.raises(ftqp.InputError, match=words):
        spared(**given)


def test_an_unknown_joint_is_refused():
    with pytest.raises(ftqp.InputError, match="'elbow' is not a joint of panda"):
        ftqp.vendors.Spare(started(PANDA, dt=0.05), "elbow", warm=1, hot=2)


@pytest.mark.parametrize("value", [None, "hot"])
def test_a_temperature_that_is_no_number_is_refused(value):
    planner, spare = spared()
    with pytest.raises(ftqp.InputError, match=f"value is {value!r}"):
        spare.look(value)
    assert not planner.faults
