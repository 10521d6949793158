"""What a run says of itself beside its rows is checked before it is believed."""

import pytest

from ftqp.sim.log.run_facts import strange_fact

GOOD = {"rotors": [0.1, 0.2], "rotors_error": [0.01, 0.01], "friction": [0.0, 0.3], "payload": None}


def test_what_was_learned_of_an_arm_passes():
    assert strange_fact({"joints": ["a", "b"], "learned": GOOD}) is None
    load = {"mass": 0.5, "com": [0.0, 0.0, 0.1]}
    assert strange_fact({"joints": ["a", "b"], "learned": {**GOOD, "payload": load}}) is None
    assert strange_fact({"joints": ["a", "b"], "learned": None}) is None


@pytest.mark.parametrize(
    "wrong",
    ["much", {**GOOD, "rotors": [0.1]}, {**GOOD, "friction": ["a", "b"]}, {**GOOD, "payload": {"mass": 1.0}}],
)
def test_what_cannot_be_learned_is_named(wrong):
    said = strange_fact({"joints": ["a", "b"], "learned": wrong})
    assert said is not None and said.startswith("what was learned is")
