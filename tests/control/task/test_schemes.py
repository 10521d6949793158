"""Recipes have the coefficients of their formulas, and are found by name."""

import numpy as np
import pytest
from tests.arm_at import arm_at

import ftqp
from ftqp.control.task import schemes
from ftqp.core.errors import InputError

generator = np.random.default_rng(0)
n = 5
B = generator.normal(size=(n, n))
M, h = B @ B.T + n * np.eye(n), generator.normal(size=n)
q, v, rest, x, y = generator.normal(size=(5, n))


def objective(criterion, x):
    """The objective as the module of ``Scheme`` states it, up to a constant."""
    c = criterion
    tau = M @ x + h
    value = 0.5 * c.norm * x @ x + x @ (c.norm_v * v + c.norm_q * (q - rest))
    value += 0.5 * c.inertia * x @ M @ x + x @ (c.inertia_v * M @ v + c.inertia_h * h)
    return value + 0.5 * c.torque * tau @ tau


k = 8.0 * v + 16.0 * (q - rest)
ACCELERATION = {
    "mvn": lambda a: 0.5 * (a + 4.0 * v) @ (a + 4.0 * v),
    "man": lambda a: 0.5 * a @ a,
    "mke": lambda a: 0.5 * (a + 4.0 * v) @ M @ (a + 4.0 * v),
    "mtn": lambda a: 0.5 * (M @ a + h) @ (M @ a + h),
    "iiwt": lambda a: 0.5 * (M @ a + h) @ np.linalg.solve(M, M @ a + h),
    "rmp": lambda a: 0.5 * (a + k) @ (a + k),
    "dlsm": lambda a: 0.5 * (0.995 * (M @ a + h) @ (M @ a + h) + 0.005 * (a + k) @ (a + k)),
    "dlsm_mvn": lambda a: 0.5 * (0.995 * (M @ a + h) @ (M @ a + h) + 0.005 * (a + 4.0 * v) @ (a + 4.0 * v)),
}
VELOCITY = {
    "mvn": lambda u: 0.5 * u @ u,
    "man": lambda u: 0.5 * (u - v) @ (u - v),
    "mke": lambda u: 0.5 * u @ M @ u,
    "rmp": lambda u: 0.5 * (u + 4.0 * (q - rest)) @ (u + 4.0 * (q - rest)),
    "iiwt": lambda u: 0.5 * (M @ (u - v) + h) @ np.linalg.solve(M, M @ (u - v) + h),  # dt = 1
}


@pytest.mark.parametrize("name", ACCELERATION)
def test_acceleration_level_minimises_the_formula_of_the_recipe(name):
    criterion = schemes.by_name(name).at("acceleration")
    formula = ACCELERATION[name]
    assert formula(x) - formula(y) == pytest.approx(
        objective(criterion, x) - objective(criterion, y), rel=1e-12
    )


@pytest.mark.parametrize("name", VELOCITY)
def test_velocity_level_minimises_the_formula_of_the_recipe(name):
    criterion = schemes.by_name(name).at("velocity")
    formula = VELOCITY[name]
    assert formula(x) - formula(y) == pytest.approx(
        objective(criterion, x) - objective(criterion, y), rel=1e-12
    )


def test_every_recipe_is_known_by_name_and_convex_at_both_levels():
    recipes = {*ACCELERATION, "mvn_manipulability"}
    assert set(schemes.names()) == recipes | set(schemes.closed_forms())
    for name in recipes:
        scheme = schemes.by_name(name)
        assert scheme.name == name
        scheme.at("acceleration"), scheme.at("velocity")


def test_reference_scales_divide_their_criterion():
    scheme = schemes.dlsm(alpha=0.5, tau_ref=2.0, a_ref=4.0).at("acceleration")
    assert (scheme.torque, scheme.norm) == (0.5 / 4.0, 0.5 / 16.0)


def test_nothing_is_mvn_and_a_scheme_is_itself():
    assert schemes.by_name(None) == schemes.mvn()
    mine = schemes.mke() + schemes.man()
    assert schemes.by_name(mine) is mine


def test_table_with_parameters_is_the_recipe_called_with_them():
    assert schemes.by_name({"name": "rmp", "mu": 2.0}) == schemes.rmp(mu=2.0) != schemes.rmp()


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("mvm", r"'mvm' is not a scheme \(did you mean 'mvn'\?\); there are mvn, man, mke, mtn, iiwt, rmp"),
        ({"name": "rmp", "mi": 1.0}, r"'mi' is not a parameter of scheme 'rmp'.*; it has mu, nu"),
        ({"name": "man", "gain": 1.0}, "'gain' is not a parameter of scheme 'man'; it has none"),
        ({"mu": 1.0}, "expected a name, {name = ..., ...} or an ftqp.Scheme"),
        (7, "scheme is 7, expected a name"),
        (
            {"name": "dlsm", "alpha": 1.0},
            r"alpha is 1, expected a share in \[0, 1\); for torque alone use mtn",
        ),
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
