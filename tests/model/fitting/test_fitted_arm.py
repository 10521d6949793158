"""What an arm has beside its model is found, with errors that are true, and what is not shown is said."""

from typing import Any

import numpy as np
import pytest
from tests.model.fitting.conftest import Truth

import ftqp


@pytest.fixture(scope="module")
def found(panda: ftqp.Robot, log: ftqp.TorqueLog) -> ftqp.FittedArm:
    return ftqp.fitted_arm(panda, log)


def test_rotors_and_friction_are_found_to_a_tenth(found: ftqp.FittedArm, truth: Truth) -> None:
    for name in ("rotors", "coulomb", "viscous"):
        shown = ~found.not_shown[name]
        assert shown.sum() >= 6
        wrong = np.abs(getattr(found, name) / getattr(truth, name) - 1.0)
        assert wrong[shown].max() < 0.1, name


def test_a_load_is_found_to_a_twentieth_and_its_centre_to_5_mm(found: ftqp.FittedArm, truth: Truth) -> None:
    payload = found.payload
    assert payload is not None
    assert payload.mass == pytest.approx(truth.payload.mass, rel=0.05)
    np.testing.assert_allclose(payload.com, truth.payload.com, atol=5e-3)


def test_gains_and_offsets_of_the_log_are_found_where_they_are_told(
    found: ftqp.FittedArm, truth: Truth
) -> None:
    assert np.abs(found.gains - truth.gains)[~found.not_shown["gains"]].max() < 0.02
    assert np.abs(found.offsets - truth.offsets)[~found.not_shown["offsets"]].max() < 5e-3


def test_the_truth_lies_within_three_standard_errors(found: ftqp.FittedArm, truth: Truth) -> None:
    for name in ("rotors", "coulomb", "viscous", "gains", "offsets"):
        z = (getattr(found, name) - getattr(truth, name)) / found.errors[name]
        assert np.abs(z).max() < 3.5, name


def test_what_a_joint_that_stands_has_is_not_shown(panda: ftqp.Robot, motion: Any, truth: Truth) -> None:
    from tests.model.fitting.conftest import recorded

    q, v, a = motion.q.copy(), motion.v.copy(), motion.a.copy()
    q[:, 2], v[:, 2], a[:, 2] = q[0, 2], 0.0, 0.0
    still = ftqp.ExcitingMotion(t=motion.t, q=q, v=v, a=a)
    found = ftqp.fitted_arm(panda, recorded(panda, still, truth))
    for name in ("rotors", "coulomb", "viscous"):
        assert found.not_shown[name][2], name
        assert not found.not_shown[name][[1, 3]].any(), name
    assert found.fitted.chain.armature[2] == panda.chain.armature[2]
    with pytest.warns(DeprecationWarning, match="not_shown now"):
        assert found.untold is found.not_shown


def test_a_motion_that_excites_nothing_is_refused(panda: ftqp.Robot) -> None:
    t = np.arange(0.0, 5.0, 0.002)
    rest = np.tile(panda.neutral, (len(t), 1))
    with pytest.raises(ftqp.InputError, match=r"no joint of the log moves by 0.01 rad"):
        ftqp.fitted_arm(panda, ftqp.TorqueLog(t=t, q=rest, tau=np.ones_like(rest)))


def test_a_log_of_another_arm_is_refused(panda: ftqp.Robot, log: ftqp.TorqueLog) -> None:
    with pytest.raises(
        ftqp.InputError, match=r"panda does not explain the log: of the .* N m of panda_joint2"
    ):
        turned = log.tau.copy()
        turned[:, 1] *= -1.0
        ftqp.fitted_arm(panda, ftqp.TorqueLog(t=log.t, q=log.q, tau=turned))
    with pytest.raises(ftqp.InputError, match=r"the log is of another arm, or in degrees"):
        ftqp.fitted_arm(panda, ftqp.TorqueLog(t=log.t, q=np.rad2deg(log.q), tau=log.tau))
    with pytest.raises(ftqp.InputError, match=r"has 6 joints, but panda has 7"):
        ftqp.fitted_arm(panda, ftqp.TorqueLog(t=log.t, q=log.q[:, :6], tau=log.tau[:, :6]))


@pytest.mark.parametrize(
    ("unknowns", "message"),
    [(("rotor",), "'rotor' is not an? unknown of an arm"), ((), "no log or no unknown was given")],
)
def test_kinds_that_are_none_are_refused(
    panda: ftqp.Robot, log: ftqp.TorqueLog, unknowns: tuple[str, ...], message: str
) -> None:
    with pytest.raises(ftqp.InputError, match=message):
        ftqp.fitted_arm(panda, log, unknowns=unknowns)
