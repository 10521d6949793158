"""Joint servos: first order, rate-limited, with set points that add up."""

from types import SimpleNamespace

import numpy as np
import pytest

from ftqp.core.errors import InputError
from ftqp.faults.kinds import FreeSwinging, Locked
from ftqp.model import catalog
from ftqp.sim.plants.servo_plant import ServoPlant

DT = 0.1


@pytest.fixture(scope="module")
def puma():
    return catalog.load("puma560")


@pytest.fixture
def plant(puma):
    made = ServoPlant(puma, DT)
    made.reset(puma.neutral, np.zeros(6))
    return made


def command(v):
    v = np.asarray(v, dtype=float)
    return SimpleNamespace(q=np.full(6, np.nan), v=v)


def test_joint_comes_to_its_set_point_in_first_order(plant, puma):
    plant.advance(command([0.1, 0, 0, 0, 0, 0]))
    np.testing.assert_allclose(plant.q[0] - puma.neutral[0], 0.01 * (1.0 - 0.9**10), rtol=1e-12)
    assert plant.setpoint[0] == pytest.approx(0.01)
    for _ in range(40):
        plant.advance(command(np.zeros(6)))
    np.testing.assert_allclose(plant.q, puma.neutral + np.array([0.01, 0, 0, 0, 0, 0]), atol=1e-12)


def test_rate_limit_lets_the_set_point_run_ahead(plant, puma):
    for _ in range(5):
        plant.advance(command([10.0, 0, 0, 0, 0, 0]))
    assert plant.v[0] == puma.limits.v_max[0]
    np.testing.assert_allclose(plant.q[0] - puma.neutral[0], 0.5 * puma.limits.v_max[0])
    assert plant.setpoint[0] == pytest.approx(5.0)


def test_locked_joint_stands_and_its_set_point_waits(plant, puma):
    plant.fail(Locked("j2"))
    plant.advance(command(np.ones(6)))
    assert plant.q[1] == puma.neutral[1] and plant.v[1] == 0.0 and plant.setpoint[1] == puma.neutral[1]
    assert plant.q[0] > puma.neutral[0]


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda r: ServoPlant(r, DT, time_constant=0.0), "time constant of the servos is 0"),
        (lambda r: ServoPlant(r, DT, substeps=0), "substeps is 0, expected a whole number >= 1"),
        (lambda r: ServoPlant(r, 1.0, time_constant=0.1, substeps=2), "2 substeps of 0.5 s are unstable"),
        (
            lambda r: ServoPlant(r, DT).fail(FreeSwinging("j2")),
            "plant 'servo' knows locked joints only, but j2",
        ),
    ],
)
def test_wrong_servo_is_one_clear_sentence(puma, make, sentence):
    with pytest.raises(InputError, match=sentence):
        make(puma)
