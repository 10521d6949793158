"""What befalls an arm at set times begins, ends and comes again when it is to."""

from types import SimpleNamespace

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError, ScenarioError

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

from ftqp.app.scenario.setup import load
from ftqp.sim.plants.troubled_plant import Jammed, Push, Trouble, TroubledPlant

ARM = ftqp.robots.load("panda")
N, DT, JOINT = ARM.nv, 1e-3, 1


def speeds(*troubles, ticks=700):
    """The speed of a joint that is led at 0.3 rad/s, at every tick."""
    inner = ftqp.MujocoPlant(ARM, DT, ftqp.JointServo(ARM, "velocity"))
    plant = TroubledPlant(inner, ARM, DT, troubles)
    v = np.zeros(N)
    v[JOINT] = 0.3
    plant.reset(ARM.neutral, v)
    command = SimpleNamespace(q=ARM.neutral, v=v, tau=np.zeros(N), brakes=np.zeros(N, dtype=bool))
    found = []
    for _ in range(ticks):
        found.append(plant.v[JOINT])
        plant.advance(command)
    return np.array(found)


def test_brake_closes_opens_and_closes_again():
    v = speeds(Trouble(0.1, Jammed(JOINT), 0.1, 0.3))
    assert np.abs(v[:100] - 0.3).max() < 0.01
    for begin in (100, 400):
        assert np.abs(v[begin + 30 : begin + 100]).max() < 1e-3
        assert abs(v[begin + 250] - 0.3) < 0.02
    assert speeds(Trouble(0.1, Jammed(JOINT)))[-1] == pytest.approx(0.0, abs=1e-3)


def test_weak_brake_slips():
    v = speeds(Trouble(0.1, Jammed(JOINT, 0.02)))
    assert 0.05 < v[-1] < 0.3


def test_push_ends():
    still = speeds()
    v = speeds(Trouble(0.1, Push(force=(0.0, 0.0, -60.0)), 0.2))
    moved = np.abs(v - still)
    assert moved[:100].max() == 0.0 and moved[100:300].max() > 1e-3 and moved[600:].max() < 1e-4


def test_wrong_troubles_are_refused():
    with pytest.raises(InputError, match="expected more than its duration, which it has not"):
        Trouble(0.1, Jammed(0), every=1.0)
    with pytest.raises(InputError, match="expected more than its duration, 2 s"):
        Trouble(0.1, Jammed(0), 2.0, 1.0)
    push = '[{kind="push", at=1.0, joint=0}]'
    with pytest.raises(ScenarioError, match="is a push and names a joint; leave joint out"):
        load("panda-mujoco-brake", [f"simulation.troubles={push}"])
    with pytest.raises(ScenarioError, match="names no joint; give joint"):
        load("panda-mujoco-brake", ['simulation.troubles=[{kind="jammed", at=1.0}]'])
    jammed = 'simulation.troubles=[{kind="jammed", at=1.0, joint=0}]'
    with pytest.raises(ScenarioError, match="troubles befall plant 'mujoco' only"):
        load("panda-circle", [jammed])
