"""What the kernel minimises under a recipe is the recipe's formula, and recipes are found by name."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.arm_at import arm_at
from tests.kernel.session_ticks import Ticks, hessian

import ftqp
from ftqp.control.task import schemes
from ftqp.core.errors import InputError

DT = 0.002
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
POSTURE = np.array([0.0, -0.3, 0.1, -1.8, 0.1, 1.4, 0.7])


def half(vector):
    """1/2 |vector|^2."""
    return 0.5 * vector @ vector


def kappa(s):
    """What a repetitive motion adds to a."""
    return 8.0 * s.v + 16.0 * (s.q - s.posture)


def impulse(s, u):
    """The torque of the step from s.v to u, times dt."""
    return s.M @ (u - s.v) + s.dt * s.h


ACCELERATION = {
    "mvn": lambda a, s: half(a + 4.0 * s.v),
    "man": lambda a, s: half(a),
    "mke": lambda a, s: 0.5 * (a + 4.0 * s.v) @ s.M @ (a + 4.0 * s.v),
    "mtn": lambda a, s: half(s.M @ a + s.h),
    "iiwt": lambda a, s: 0.5 * (s.M @ a + s.h) @ np.linalg.solve(s.M, s.M @ a + s.h),
    "rmp": lambda a, s: half(a + kappa(s)),
    "dlsm": lambda a, s: 0.995 * half(s.M @ a + s.h) + 0.005 * half(a + kappa(s)),
    "dlsm_mvn": lambda a, s: 0.995 * half(s.M @ a + s.h) + 0.005 * half(a + 4.0 * s.v),
}
"""The formulas of the recipes at the acceleration level, of a and of q, v, posture, M, h, dt in s."""
VELOCITY = {
    "mvn": lambda u, s: half(u),
    "man": lambda u, s: half(u - s.v),
    "mke": lambda u, s: 0.5 * u @ s.M @ u,
    "mtn": lambda u, s: half(impulse(s, u)),
    "iiwt": lambda u, s: 0.5 * impulse(s, u) @ np.linalg.solve(s.M, impulse(s, u)),
    "rmp": lambda u, s: half(u + 4.0 * (s.q - s.posture)),
    "dlsm": lambda u, s: 0.995 * half(impulse(s, u)) + 0.005 * half(u + 4.0 * (s.q - s.posture)),
    "dlsm_mvn": lambda u, s: 0.995 * half(impulse(s, u)) + 0.005 * half(u),
}
"""The formulas of the recipes at the velocity level, of the next velocity u and of s."""


def quadratic(formula, n):
    """Hessian and gradient at zero of a quadratic formula, (n, n) and (n,)."""
    E, zero = np.eye(n), formula(np.zeros(n))
    one = np.array([formula(e) for e in E])
    two = np.array([[formula(e + f) for f in E] for e in E])
    return two - one[:, None] - one + zero, 0.5 * (one - np.array([formula(-e) for e in E]))


@pytest.mark.parametrize(
    ("level", "name"),
    [("acceleration", name) for name in ACCELERATION] + [("velocity", name) for name in VELOCITY],
)
def test_kernel_minimises_the_formula_of_the_recipe(level, name):
    """H and g of a tick of a moving Panda are Hessian and gradient of the formula."""
    robot = ftqp.robots.load("panda")
    ticks = Ticks(robot, DT, level=level, scheme=name, posture=POSTURE, torque_limits=False)
    ticks.reset(Q, V)
    ticks.tick(Q, V, ftqp.Target(pose=robot.pose(Q)))
    arm = arm_at(robot, Q, V)
    s = SimpleNamespace(q=Q, v=V, posture=POSTURE, M=arm.M, h=arm.h, dt=DT, limits=robot.limits)
    formula = {"acceleration": ACCELERATION, "velocity": VELOCITY}[level][name]
    H, g = quadratic(lambda x: formula(x, s), 7)
    assert np.abs(hessian(ticks.K) - H).max() <= 1e-9 * np.abs(H).max()
    assert np.abs(ticks.K.qp.g[:7] - g).max() <= 1e-9 * max(1e-12, np.abs(g).max())


def test_every_recipe_is_known_by_name_and_convex_at_both_levels():
    assert set(ACCELERATION) == set(VELOCITY)
    recipes = {*ACCELERATION, "mvn_manipulability"}
    assert set(schemes.names()) == recipes | set(schemes.closed_forms())
    for name in recipes:
        scheme = schemes.by_name(name)
        assert scheme.name == name
        scheme.at("acceleration"), scheme.at("velocity")


def test_table_with_parameters_is_the_recipe_called_with_them():
    assert schemes.by_name({"name": "rmp", "mu": 2.0}) == schemes.rmp(mu=2.0) != schemes.rmp()


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("mvm", r"'mvm' is not a scheme \(did you mean 'mvn'\?\); there are mvn, .*man, .*rmp, "),
        ({"name": "rmp", "mi": 1.0}, r"'mi' is not a parameter of scheme 'rmp'.*; it has mu, nu"),
        ({"name": "man", "gain": 1.0}, "'gain' is not a parameter of scheme 'man'; it has none"),
        ({"mu": 1.0}, "expected a name, {name = ..., ...} or an ftqp.Scheme"),
        (7, "scheme is 7, expected a name"),
        ({"name": "dlsm", "alpha": 1.0}, r"alpha is 1, expected a share in \[0, 1\); for torque alone use"),
        ({"name": "dlsm", "tau_ref": 0.0}, "tau_ref is 0, expected a finite number > 0 N m"),
        ({"name": "mvn", "gain": -1.0}, "gain is -1, expected a finite number >= 0 1/s"),
    ],
)
def test_wrong_scheme_is_refused_with_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        schemes.by_name(given)


def test_manipulability_is_a_term_for_other_schemes():
    assert schemes.mvn_manipulability(0.2).at("velocity") == (schemes.mvn() + schemes.manipulability(0.2)).at(
        "velocity"
    )
    with pytest.raises(InputError, match="add a scheme that has one, such as mvn"):
        schemes.manipulability().at("velocity")


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
def test_manipulability_draws_the_arm_away_from_a_singularity(level):
    """An iiwa held in place, its second joint locked near zero, ends with a larger sigma_min."""
    robot, q0 = ftqp.robots.load("iiwa14"), np.array([0.2, 0.3, 0.1, -0.3, 0.2, 0.3, 0.0])
    found = {}
    for name, scheme in (("mvn", None), ("mvn_manipulability", schemes.mvn_manipulability(0.5))):
        planner = ftqp.Planner(robot, 5e-3, level=level, scheme=scheme, task=ftqp.Task(rows="position"))
        planner.reset(q0)
        q, v, target = q0.copy(), np.zeros(7), ftqp.Target(pose=robot.pose(q0))
        for _ in range(600):
            step = planner.step(q, v, target)
            at, q, v = q, step.q.copy(), step.v.copy()
        J = arm_at(robot, at).J[:3]
        found[name] = 0.5 * np.linalg.slogdet(J @ J.T)[1]
        assert step.position_error < 1e-3
    assert found["mvn_manipulability"] > found["mvn"] + 0.02
