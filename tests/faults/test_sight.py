"""What is said to be noticed is what the evidence adds up to."""

import numpy as np
import pytest

from ftqp.faults.sight import Sight


def sight(deviation=1e-3, known=True, shaken=0.0):
    return Sight(
        level=17.0, kappa=0.094, block=0.005, late=0.03, deviation=np.array([deviation]),
        shaken=np.array([shaken]), is_known=np.array([known]), units=("mrad",),
    )  # fmt: skip


def looks_until(z_of, most=10_000):
    """Looks until the CUSUM of the monitor passes its level, shifts as they are tested."""
    G = 0.0
    for k in range(1, most):
        z = z_of(k)
        shift = min(max(abs(z), 3.0), 8.0)
        G = max(G + 0.094 * (shift * abs(z) - 0.5 * shift * shift), 0.0)
        if G > 17.0:
            return k
    return None


@pytest.mark.parametrize("within", [0.06, 0.1, 0.3, 2.0])
def test_the_least_deviation_decides_just_within_the_time(within):
    z = sight().least(within)[0] / 1e-3
    looks = round((within - 0.03) / 0.005)
    assert looks_until(lambda k: 1.001 * z) <= looks
    late = looks_until(lambda k: 0.97 * z)
    assert late is None or late >= looks


@pytest.mark.parametrize("speed", [0.02, 0.1, 1.0])
def test_a_lock_shows_when_the_evidence_passes_the_level(speed):
    looks = looks_until(lambda k: speed * 0.005 * k / 1e-3)
    assert sight().lock_after(0, speed) == pytest.approx(0.005 * looks + 0.03)


def test_a_lock_shows_later_where_other_joints_shake_it():
    looks = looks_until(lambda k: 0.005 * k / np.hypot(1e-3, 5e-3))
    assert sight(shaken=5e-3).lock_after(0, 1.0) == pytest.approx(0.005 * looks + 0.03)
    assert sight(shaken=5e-3).lock_after(0, 1.0) > sight().lock_after(0, 1.0)


def test_a_joint_that_is_not_to_move_shows_nothing():
    assert sight().lock_after(0, 0.0) == np.inf


def test_the_sentence_says_what_shows_and_what_does_not():
    said = sight().sentence(0, "elbow", 0.0)
    assert (
        said.startswith("elbow: ")
        and "mrad off" in said
        and "while it stands still, as now, nothing shows" in said
    )
    assert "with 0.5 rad/s." in sight().sentence(0, "elbow", -0.5)
    assert "Nothing is noticed of elbow yet" in sight(known=False).sentence(0, "elbow", 0.5)
