"""What was learned of servos is said in sentences, goes through a file, and is a planner's prior."""

import json

import numpy as np
import pytest

import ftqp
from ftqp.control.drive.learned_servos import PARAMETERS, with_error
from ftqp.control.drive.servo_prior import TOLD_SHARE, prior

PANDA = ftqp.robots.load("panda")


def servos(lag=0.042, error=0.002, **others):
    n = 7
    values, deviations = np.zeros((n, 6)), np.full((n, 6), 1e-4)
    values[:, 0], deviations[:, 0] = lag, error
    given = {
        "robot": "panda", "joints": PANDA.joints, "units": ("rad",) * n, "values": values,
        "deviations": deviations, "droop": np.full(n, -0.0123), "droop_error": np.full(n, 4e-4),
        "noise": np.full(n, 5e-5), "way": np.full(n, 0.35),
    }  # fmt: skip
    return ftqp.LearnedServos(**given | others)


def test_sentences_say_what_is_known_with_its_error_and_what_is_not():
    errors = np.full((7, 6), 1e-4)
    errors[:, 0] = 0.002
    errors[5, 0] = 0.07
    found = servos(deviations=errors, way=np.array([0.35] * 5 + [0.0012, 0.35]))
    assert found.sentences[0] == (
        "panda_joint1 lags by 42 ± 2 ms (a servo of about 7.6 Hz), stands 12.3 ± 0.4 mrad off what it is "
        "sent; its samples scatter by 0.05 mrad."
    )
    assert found.sentences[5] == "Nothing of panda_joint6 is known yet: it has moved by 1.2 mrad."
    assert "lags by no more than 5 ms" in servos(lag=0.001).sentences[0]


@pytest.mark.parametrize(
    ("value", "error", "said"),
    [
        (42.4, 2.1, "42 ± 2"),
        (0.1234, 0.034, "0.12 ± 0.03"),
        (-0.01, 0.2, "0.0 ± 0.2"),
        (3.14159, 0.0, "3.14"),
    ],
)
def test_a_value_has_the_digits_of_its_error(value, error, said):
    assert with_error(value, error) == said


def test_a_file_gives_back_what_was_saved(tmp_path):
    file = tmp_path / "arm.json"
    saved = servos()
    saved.save(file)
    found = ftqp.LearnedServos.load(file)
    assert found.joints == saved.joints and found.units == saved.units and found.robot == "panda"
    for name in ("values", "deviations", "droop", "droop_error", "noise", "way"):
        np.testing.assert_allclose(getattr(found, name), getattr(saved, name), rtol=1e-5)


def test_a_planner_begins_with_it_doubted_as_a_stated_bandwidth(tmp_path):
    file = tmp_path / "arm.json"
    servos().save(file)
    drive = ftqp.Drive(known=file)
    mean, doubt = prior(drive, 7, 0.0, 0.0)
    np.testing.assert_allclose(mean[:, 0], 0.042)
    np.testing.assert_allclose(doubt[:, 0], TOLD_SHARE * 0.042, rtol=1e-6)
    assert (doubt[:, 3] > 0.005).all()  # the load may be another one by now
    assert ftqp.Planner(PANDA, drive={"known": str(file)}).drive.known.joints == PANDA.joints


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda c: c | {"format": 2}, "has format 2, expected estimates of servos in format 1"),
        (lambda c: [], "is not a file with estimates of servos, or is damaged"),
        (lambda c: c | {"joints": {}}, "or is damaged"),
        (lambda c: c["joints"]["panda_joint2"].pop("lag") and c, "damaged (KeyError: 'lag')"),
        (lambda c: c["joints"]["panda_joint2"].update(lag=["long", 1]) or c, "or is damaged"),
        (lambda c: c["joints"]["panda_joint2"].update(lag=[0.04, -1.0]) or c, "deviation is negative"),
        (lambda c: c["joints"]["panda_joint2"].update(unit="deg") or c, "is neither rad nor m"),
    ],
)
def test_a_strange_file_is_refused_in_a_sentence(tmp_path, change, sentence):
    file = tmp_path / "arm.json"
    servos().save(file)
    file.write_text(json.dumps(change(json.loads(file.read_text()))))
    with pytest.raises(ftqp.InputError) as refused:
        ftqp.LearnedServos.load(file)
    assert sentence in str(refused.value) and "ftqp connect" in str(refused.value)


def test_the_file_of_another_arm_and_what_excludes_it_are_refused():
    with pytest.raises(
        ftqp.InputError, match=r"was estimated on panda with joints panda_joint1.*connect the"
    ):
        ftqp.Planner(ftqp.robots.load("iiwa14"), drive=ftqp.Drive(known=servos()))
    with pytest.raises(ftqp.InputError, match="bandwidth and known both say how the servos"):
        ftqp.Drive(known=servos(), bandwidth=94.0)
    with pytest.raises(ftqp.InputError, match="known is for drive 'position', but the drive is 'torque'"):
        ftqp.Drive(kind="torque", known=servos())


def test_the_file_names_every_parameter(tmp_path):
    servos().save(tmp_path / "arm.json")
    table = json.loads((tmp_path / "arm.json").read_text())["joints"]["panda_joint1"]
    assert set(PARAMETERS) < set(table) and table["lag"] == [0.042, 0.002]
