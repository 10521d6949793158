"""At which places an arm can do without each joint."""

import numpy as np
import pytest

from ftqp.analysis.survival.survival_map import STEPS, survival_map
from ftqp.core.errors import InputError
from ftqp.model import catalog

PANDA = catalog.load("panda")
POSE, POSITION = (survival_map(PANDA, rows, places=40) for rows in ("pose", "position"))


def test_fewer_rows_survive_more_and_the_last_joint_never_matters_to_a_position() -> None:
    assert POSITION.per_joint["panda_joint7"] == 1.0
    assert all(POSITION.per_joint[joint] >= POSE.per_joint[joint] for joint in PANDA.joints)
    for found in (POSE, POSITION):
        assert found.any_joint <= min(found.per_joint.values())
        assert (found.survived <= found.lines[:, None]).all() and found.lines.max() <= 6


def test_structural_joint_is_survived_nowhere() -> None:
    arm = catalog.load("iiwa14")
    assert survival_map(arm, places=30).per_joint[arm.joints[3]] == 0.0


def test_longer_lines_survive_less_and_the_same_seed_gives_the_same_map() -> None:
    longer = survival_map(PANDA, "position", places=40, way=0.4)
    assert longer.lines.sum() < POSITION.lines.sum() and longer.any_joint <= POSITION.any_joint
    again = survival_map(PANDA, "position", places=40)
    assert (again.survived == POSITION.survived).all()
    assert not np.allclose(survival_map(PANDA, "position", places=40, seed=1).q, POSITION.q)


def test_planar_places_are_survived_where_the_closed_form_says_so() -> None:
    arm = catalog.load("planar", lengths=(1.0, 1.0, 1.0), continuous=True).with_limits(v_max=np.inf)
    found = survival_map(arm, places=60, way=0.3)
    same = []
    for place in range(60):
        q1, q2, q3 = found.q[place]
        p = found.places[place, :2]
        ends = p + 0.3 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        lines = p + np.linspace(0.0, 1.0, STEPS + 1)[:, None, None] * (ends - p)
        far = np.linalg.norm(lines, axis=2)
        possible = (far < 3.0).all(axis=0)
        A, B = 2.0 * abs(np.cos(q2 / 2.0)), 2.0 * abs(np.cos(q3 / 2.0))
        rest = np.linalg.norm(lines - [np.cos(q1), np.sin(q1)], axis=2)
        kept = np.array(
            [
                ((rest > 0.0) & (rest < 2.0)).all(axis=0),
                ((np.abs(A - 1.0) < far) & (far < A + 1.0)).all(axis=0),
                ((np.abs(1.0 - B) < far) & (far < 1.0 + B)).all(axis=0),
            ]
        )
        if found.lines[place] == possible.sum():
            same.append(found.survived[place] == (kept & possible).sum(axis=1))
    assert len(same) > 30 and np.mean(same) > 0.97


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [({"places": 0}, "places is 0"), ({"way": -1.0}, "way is -1"), ({"rows": "tool"}, "tool")],
)
def test_bad_input_is_refused(settings: dict, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        survival_map(PANDA, **settings)
