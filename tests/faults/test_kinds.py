"""A fault that makes no sense cannot be made."""

from dataclasses import fields

import numpy as np
import pytest

from ftqp.app.output.tables import keys as scenario_keys
from ftqp.core.errors import InputError
from ftqp.core.setting import keys_of
from ftqp.faults.kinds import KINDS, Degraded, FreeSwinging, Locked

BRAKING = "a finite number > 0 rad/s2 or m/s2"


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (
            lambda: Locked(0, mode="ramped"),
            "mode is 'ramped' (did you mean 'ramp'?), expected one of ramp, instant",
        ),
        (
            lambda: Locked(0, reset="moment"),
            "reset is 'moment' (did you mean 'momentum'?), expected one of kinematic, momentum, task",
        ),
        (lambda: Locked(0, deceleration=np.nan), f"deceleration is nan, expected {BRAKING}"),
        (lambda: FreeSwinging(0, damping=np.inf), "damping is inf, expected a finite number >= 0 N m s/rad"),
        (lambda: Degraded(0, torque=1.5), "torque is 1.5, expected a share of the healthy limit in (0, 1]"),
        (lambda: Degraded(0, q_min=1.0, q_max=1.0), "q_min 1 is not below q_max 1"),
    ],
)
def test_senseless_fault_is_refused_with_one_sentence(make, sentence):
    with pytest.raises(InputError) as error:
        make()
    assert str(error.value) == sentence


def test_fault_is_a_ramp_lock_without_friction_or_loss_unless_told():
    assert (Locked(0).mode, Locked(0).deceleration, Locked(0).reset) == ("ramp", None, "kinematic")
    assert FreeSwinging(0).damping == 0.0
    d = Degraded(0)
    assert (d.velocity, d.acceleration, d.torque, d.q_min, d.q_max) == (1.0, 1.0, 1.0, None, None)


def test_every_kind_has_a_table_in_scenarios_with_its_settings_and_a_word_for_messages():
    """A kind is added in ``KINDS``; scenarios and messages follow."""
    keys = {row["key"]: row for row in scenario_keys()}
    for name, kind in KINDS.items():
        assert kind.kind == name and kind.happens
        settings = {field.name for field in fields(kind)} - {"joint"}
        shared = {"joint", "at", "announced"}
        found = {key.partition(").")[2] for key in keys if key.startswith(f"faults({name}).")}
        assert found == settings | shared
        for field in fields(kind):
            if field.name in settings:
                assert keys[f"faults({name}).{field.name}"]["meaning"] == keys_of(kind)[field.name].says.about


def test_numbers_of_kinds_in_logs_stay_what_they_are():
    """Logs of earlier releases are read by them."""
    numbers = {name: kind.number for name, kind in KINDS.items()}
    assert {"locked": 1, "free_swinging": 2, "degraded": 3}.items() <= numbers.items()
    assert len(set(numbers.values())) == len(numbers)


def test_a_setting_may_be_what_its_table_says_and_nothing_beyond():
    """The ranges that ``ftqp check --keys`` prints are those that a fault is made with."""
    seen = 0
    for kind in KINDS.values():
        for name, key in keys_of(kind).items():
            for end, beyond, beside in (("above", 0.0, 0.01), ("least", -0.01, 0.0), ("most", 0.01, 0.0)):
                bound = getattr(key.says, end)
                if bound is None:
                    continue
                seen += 1
                assert getattr(kind(0, **{name: bound + beside}), name) == bound + beside
                with pytest.raises(InputError, match=name):
                    kind(0, **{name: bound + beyond})
    assert seen >= 9
