"""Every row of the tables of status words, and servos that are too warm."""

import re

import numpy as np
import pytest
from tests.going import PANDA, started

import ftqp
from ftqp.vendors.verdict import ARM

JOINTS = ("j1", "j2", "j3", "j4", "j5", "j6", "j7")
ROWS = [
    (name, word, i)
    for name in ftqp.vendors.names()
    for word, told in ftqp.vendors.table(name).words.items()
    for i in range(len(told.rows))
]


def joints_of(table):
    return JOINTS[: table.joints or 7]


def value_of(word, row, single=0):
    """A value that says what a row says and, as far as a value can, nothing else."""
    if word.form == "names":
        return (row.values[single],)
    if row.mask is not None:
        return row.values[single]
    enabled = next((one.values[0] for one in word.rows if one.well and one.mask is not None), 0)
    return row.values[0] | enabled


def well(table, but=None, value=None, place=None):
    """A sample that says that all is well, but for one word."""
    sample = {}
    for name, word in table.words.items():
        fine = next((one for one in word.rows if one.well), None)
        calm = () if word.form == "names" else value_of(word, fine) if fine else 0
        sample[name] = [calm] * len(joints_of(table)) if word.of == "joint" else calm
        if name == but:
            sample[name] = value if place is None else [*sample[name]]
            if place is not None:
                sample[name][place] = value
    return sample


def said(table, word, value, **brakes):
    """The verdicts of a sample with one value that is not well, of the third joint or of the arm."""
    place = 2 if table.words[word].of == "joint" else None
    return table.verdicts(well(table, word, value, place), joints_of(table), brakes)


@pytest.mark.parametrize("name", ftqp.vendors.names())
def test_a_sample_that_is_well_says_nothing(name):
    table = ftqp.vendors.table(name)
    assert table.verdicts(well(table), joints_of(table)) == ()
    needed = {word: one for word, one in well(table).items() if not table.words[word].optional}
    assert table.verdicts(needed, joints_of(table)) == ()


@pytest.mark.parametrize(("name", "word", "i"), ROWS)
def test_every_value_of_every_row_says_what_the_row_says(name, word, i):
    table = ftqp.vendors.table(name)
    row, told = table.words[word].rows[i], table.words[word]
    assert row.arm in ARM and row.joint in ("", "off", "locked", "weak") and row.sensor in ("", "lost")
    assert not row.recovery or table.recovery[row.recovery]
    for single in range(len(row.values)):
        value = value_of(told, row, single)
        found = said(table, word, value)
        if row.well:
            assert found == ()
            continue
        (one,) = found
        named = row.values[single] - row.names if row.names is not None else 2
        joint = joints_of(table)[named] if told.of == "joint" or row.names is not None else None
        assert (one.joint, one.arm, one.sensor_lost) == (joint, row.arm, row.sensor == "lost")
        loose = row.joint == "off" and not table.brakes and not row.sensor
        kind = {
            "off": ftqp.FreeSwinging if loose else ftqp.Locked,
            "locked": ftqp.Locked,
            "weak": ftqp.Degraded,
        }
        assert type(one.fault) is kind.get(row.joint, type(None))
        assert row.means in one.why and str(value[0] if told.form == "names" else value) in one.why
        assert one.recovery == table.recovery.get(row.recovery, ())
        assert one.recovery or (one.arm == "goes_on" and not isinstance(one.fault, ftqp.Locked))


@pytest.mark.parametrize("name", ["dynamixel", "cia402"])
def test_a_joint_that_is_off_is_locked_where_it_has_a_brake(name):
    table = ftqp.vendors.table(name)
    word, value = {"dynamixel": ("hardware_error", 0x20), "cia402": ("statusword", 0x08)}[name]
    assert said(table, word, value)[0].fault == ftqp.FreeSwinging("j3")
    assert said(table, word, value, j3=True)[0].fault == ftqp.Locked("j3")
    assert said(ftqp.vendors.table("kinova"), "fault_bank_a", 1, j3=False)[0].fault == ftqp.FreeSwinging("j3")


UNDEFINED = {
    ("dynamixel", "hardware_error"): (0x40, 0x80, 0x60, 0x100, -1),
    ("feetech", "status"): (0x10, 0x40, 0x80, 0xFF),
    ("cia402", "statusword"): (0x01, 0x47 & ~0x40 | 0x48, 0x10027, 0x63),
    ("cia402", "error_code"): (0x1000, 0x7400, 0x8200, 0xFF01),
    ("universal_robots", "safety_status_bits"): (0, 0x1000, 0x1001, -1),
    ("universal_robots", "robot_mode"): (-2, 9, 255),
    ("universal_robots", "joint_mode"): (0, 241, 256),
    ("franka", "robot_mode"): ("reflex", "", 3),
    ("franka", "current_errors"): (("a_new_error",), ("joint_reflex", "a_new_error")),
    ("kinova", "arm_state"): (10, 255),
    ("kinova", "fault_bank_a"): (0x20000000, 0x20000001, 0x80000000),
    ("kinova", "warning_bank_a"): (0x40000000,),
    ("xarm", "error_code"): (4, 9, 18, 30, 61),
    ("xarm", "state"): (-1, 7),
    ("xarm", "servo_code"): (1, 12, 41),
    ("xarm", "warn_code"): (10, 16),
}


def test_every_word_has_values_that_are_not_defined():
    assert set(UNDEFINED) == {(name, word) for name, word, _ in ROWS}


@pytest.mark.parametrize(("name", "word"), UNDEFINED)
def test_what_no_row_defines_is_unknown_and_pauses_with_its_number(name, word):
    table = ftqp.vendors.table(name)
    for value in UNDEFINED[name, word]:
        (one,) = said(table, word, value)
        assert (one.arm, one.fault, one.sensor_lost) == ("paused", None, False)
        number = str(value[-1] if isinstance(value, tuple) else value)
        assert "unknown" in one.why and number in one.why and table.version in one.why
        assert one.recovery[0].by == "person"


def test_a_sample_of_another_shape_is_refused_in_a_sentence():
    table = ftqp.vendors.table("feetech")
    for sample, words in (
        ({"status": [0, 0]}, "status has 2 numbers, expected 3"),
        ({"status": [0, float("nan"), 0]}, "status holds nan, expected whole numbers"),
        ({"status": [0, 0.5, 0]}, "status holds 0.5, expected whole numbers"),
        ({"status": 0}, "status is 0, expected one number for each of 3 joints"),
        ({}, "a sample of Feetech STS3215 lacks status"),
        (
            {"status": [0] * 3, "stauts": 1},
            "'stauts' is not a word of Feetech STS3215 (did you mean 'status'",
        ),
        (3, "a sample is int, expected a mapping of status"),
    ):
        with pytest.raises(ftqp.InputError, match=re.escape(words)):
            table.verdicts(sample, JOINTS[:3])
    with pytest.raises(ftqp.InputError, match="current_errors is 'joint_reflex', expected the names"):
        franka = ftqp.vendors.table("franka")
        franka.verdicts({"robot_mode": "Idle", "current_errors": "joint_reflex"}, JOINTS)
    with pytest.raises(
        ftqp.InputError, match=r"'feetch' is not a table of ftqp\.vendors \(did you mean 'feetech'"
    ):
        ftqp.vendors.table("feetch")


def test_one_answer_has_status_and_position_or_is_refused():
    table = ftqp.vendors.table("feetech")
    answer = bytes([0x00, 0x08, 0, 0, 0xE8, 0x03, 120, 41, 0, 0x20])
    assert table.decode(answer) == {"position": 2048, "load": 1000, "temperature": 41, "status": 0x20}
    for wrong in (answer[:-1], answer + b"\0", b""):
        with pytest.raises(ftqp.InputError, match=f"an answer has {len(wrong)} bytes, expected 10"):
            table.decode(wrong)
    with pytest.raises(ftqp.InputError, match="Franka is no servo on a bus"):
        ftqp.vendors.table("franka").decode(answer)


@pytest.mark.parametrize("name", ftqp.vendors.names())
def test_the_steps_back_are_safe_in_their_order(name):
    """Goal before torque, a person before an arm is acknowledged, a reboot alone for an overload only."""
    table = ftqp.vendors.table(name)
    for steps in table.recovery.values():
        done = [step.do for step in steps]
        assert all(step.by in ("person", "program") for step in steps)
        if "torque on" in done:
            assert done.index("goal := present") < done.index("torque on") < done.index("withdraw")
        if table.goes_on != "yes":
            person = next(i for i, step in enumerate(steps) if step.by == "person")
            assert all("leave" in do or do == "planner.stop()" for do in done[:person])
    alone = {
        row.means
        for word in table.words.values()
        for row in word.rows
        if row.recovery and table.recovery[row.recovery][0].do == "reboot"
    }
    assert alone == ({"overload"} if name == "dynamixel" else set())


JOINT = PANDA.joints[3]


def spared(**given):
    planner = started(PANDA, dt=0.05, task=ftqp.Task("position"))
    return planner, ftqp.vendors.Spare(planner, **({"joint": JOINT, "warm": 50.0, "hot": 65.0} | given))


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
        ({"joint": "elbow"}, "'elbow' is not a joint of panda"),
    ],
)
def test_what_makes_no_share_is_refused(given, words):
    with pytest.raises(ftqp.InputError, match=words):
        spared(**given)


@pytest.mark.parametrize("value", [None, "hot"])
def test_a_temperature_that_is_no_number_is_refused(value):
    planner, spare = spared()
    with pytest.raises(ftqp.InputError, match=f"value is {value!r}"):
        spare.look(value)
    assert not planner.faults
