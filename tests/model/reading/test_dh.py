"""Arms from Denavit-Hartenberg tables against the product of their matrices."""

import numpy as np
import pinocchio as pin
import pytest

from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_x, rotation_z, transform
from ftqp.model.robot import Robot
from ftqp.model.serial import Inertial

TABLE = np.random.default_rng(3).uniform(-1.5, 1.5, (5, 4))
LIMITS = {"q_min": -3.0, "q_max": 3.0, "v_max": 1.0}


def matrices(q: np.ndarray, convention: str, prismatic: tuple[int, ...] = ()) -> list[np.ndarray]:
    frames = [np.eye(4)]
    for i, (theta, d, a, alpha) in enumerate(TABLE):
        slide = q[i] if i in prismatic else 0.0
        turn = transform(rotation_z(theta + q[i] - slide), np.array([0.0, 0.0, d + slide]))
        twist = transform(rotation_x(alpha), np.array([a, 0.0, 0.0]))
        frames.append(frames[-1] @ (turn @ twist if convention == "standard" else twist @ turn))
    return frames[1:]


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("prismatic", [(), (2,), (0, 4)])
def test_tip_is_the_product_of_the_matrices(convention: str, prismatic: tuple[int, ...]) -> None:
    robot = Robot.from_dh(TABLE, convention, limits=LIMITS, prismatic=prismatic)
    q = np.random.default_rng(1).uniform(-1.0, 1.0, 5)
    assert robot.chain.prismatic.nonzero()[0].tolist() == list(prismatic)
    assert np.abs(robot.pose(q) - matrices(q, convention, prismatic)[-1]).max() < 1e-12


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_masses_are_given_in_the_frames_of_the_table(convention: str) -> None:
    masses = [
        Inertial(mass=1.0 + i, com=np.array([0.1, -0.2, 0.3]), inertia=np.diag([1.0, 1.1, 1.2]))
        for i in range(5)
    ]
    robot = Robot.from_dh(TABLE, convention, limits=LIMITS, inertials=masses)
    q = np.linspace(-1.0, 1.0, 5)
    total = sum(m.mass for m in masses)
    expected = sum(
        m.mass * (T[:3, :3] @ m.com + T[:3, 3]) for m, T in zip(masses, matrices(q, convention), strict=True)
    )
    assert robot.has_inertia
    com = pin.centerOfMass(robot.model, robot.model.createData(), q)
    assert np.abs(np.asarray(com) - expected / total).max() < 1e-12


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"table": []}, "expected rows"),
        ({"table": [[0.0, 1.0]]}, r"table has shape \(1, 2\)"),
        ({"table": "table"}, "expected rows"),
        ({"table": [[0.0, float("nan"), 0.0, 0.0]]}, "contains NaN"),
        ({"convention": "standart"}, "did you mean 'standard'"),
        ({"joints": ["a", "a", "b", "c", "d"]}, "4 different names, expected 5"),
        ({"prismatic": [7]}, "0-based indices below 5"),
        ({"inertials": [None]}, "1 entries, expected 5"),
        ({"tool": np.zeros((4, 4))}, "tool has a rotation part that is not a rotation"),
    ],
)
def test_wrong_tables_are_named(keywords: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Robot.from_dh(**{"table": TABLE, "limits": LIMITS, **keywords})  # type: ignore[arg-type]
