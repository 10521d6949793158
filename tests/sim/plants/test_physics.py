"""Arms in MuJoCo: pinocchio's equations of motion, ties of joints that follow others, and contacts."""

import numpy as np
import pinocchio as pin
import pytest
from tests.going import targets_along
from tests.telescope import telescope

import ftqp
from ftqp.model import catalog
from ftqp.sim.plants.plant import Arm

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

from ftqp.sim.plants.physics import Physics


@pytest.mark.parametrize("rotor", [0.0, 0.3])
@pytest.mark.parametrize("name", ["panda", "planar6", "srs7"])
def test_arm_agrees_with_pinocchio(name, rotor):
    model = catalog.load(name).model.copy()
    model.armature = np.full(model.nv, rotor)
    robot = ftqp.Robot.from_pinocchio(model)
    rng = np.random.default_rng(3)
    arm = Arm(robot)
    for _ in range(5):
        q, v = rng.normal(size=robot.nv), rng.normal(size=robot.nv)
        np.testing.assert_allclose(arm.tip(q), robot.pose(q), atol=1e-12)
        M, h = arm.dynamics(q, v)
        a = rng.normal(size=robot.nv)
        tau = pin.rnea(robot.model, robot.model.createData(), robot.configuration(q), v, a)
        np.testing.assert_allclose(M @ a + h, tau, atol=1e-9)


WITH_INERTIA = [name for name in catalog.names() if name != "planar" and catalog.load(name).has_inertia]


def differences(physics, model, robot, count=30):
    """Largest errors of M, h and the tip over random states; (3,)."""
    rng, data, worst = np.random.default_rng(7), model.createData(), np.zeros(3)
    for _ in range(count):
        q, v = rng.uniform(-2.0, 2.0, robot.nv), rng.normal(size=robot.nv)
        physics.reset(q, v)
        full = robot.configuration(q)
        upper = np.triu(pin.crba(model, data, full))
        M = upper + np.triu(upper, 1).T
        worst[0] = max(worst[0], np.abs(physics.mass_matrix() - M).max())
        worst[1] = max(
            worst[1], np.abs(physics.bias - pin.rnea(model, data, full, v, np.zeros(robot.nv))).max()
        )
        worst[2] = max(worst[2], np.abs(physics.tip() - robot.pose(q)).max())
    return worst


@pytest.mark.parametrize("name", WITH_INERTIA)
def test_inertia_bias_and_tip_are_those_of_pinocchio(name):
    robot = catalog.load(name)
    assert differences(Physics(robot.chain, 1e-3), robot.model, robot).max() < 1e-10


@pytest.mark.parametrize("name", WITH_INERTIA)
def test_load_counts_as_in_pinocchio(name):
    robot = catalog.load(name)
    load = ftqp.Payload(1.5, (0.02, -0.03, 0.1))
    physics = Physics(ftqp.TrueArm(payload=load).chain(robot), 1e-3)
    assert differences(physics, robot.with_payload(load).model, robot).max() < 1e-10


def inertia_and_bias(chain, robot):
    """M and h at one moving state."""
    physics = Physics(chain, 1e-3)
    physics.reset(robot.neutral, np.linspace(-1.0, 1.0, robot.nv))
    return physics.mass_matrix(), physics.bias.copy()


def test_scaled_masses_scale_inertia_and_bias_but_not_the_rotors(panda):
    M, h = inertia_and_bias(panda.chain, panda)
    M_true, h_true = inertia_and_bias(ftqp.TrueArm(mass_scale=1.2).chain(panda), panda)
    rotors = np.diag(panda.chain.armature)
    np.testing.assert_allclose(M_true - rotors, 1.2 * (M - rotors), rtol=0, atol=1e-12)
    np.testing.assert_allclose(h_true, 1.2 * h, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("rotors", "added"), [(0.1, [0.1] * 7), ({"panda_joint2": 0.3}, [0.0, 0.3] + [0.0] * 5)]
)
def test_rotors_add_to_the_inertia_of_their_own_joint_and_to_nothing_else(panda, rotors, added):
    M, h = inertia_and_bias(panda.chain, panda)
    M_true, h_true = inertia_and_bias(ftqp.TrueArm(rotors=rotors).chain(panda), panda)
    np.testing.assert_allclose(M_true - M, np.diag(added), rtol=0, atol=1e-12)
    np.testing.assert_allclose(h_true, h, rtol=0, atol=1e-11)
    np.testing.assert_allclose(ftqp.TrueArm(rotors=rotors).geared(panda).chain.armature, added)


def test_rotors_are_not_scaled_with_the_masses_and_add_to_those_of_the_model():
    xarm = catalog.load("xarm7")
    chain = ftqp.TrueArm(rotors=0.1, mass_scale=1.5).chain(xarm)
    np.testing.assert_allclose(chain.armature, xarm.chain.armature + 0.1, atol=1e-15)


def test_load_of_an_arm_with_scaled_masses_keeps_its_own_mass(panda):
    load = ftqp.Payload(2.0, (0.0, 0.0, 0.1), np.diag([0.01, 0.01, 0.02]))
    adds = (
        inertia_and_bias(panda.with_payload(load).chain, panda)[0] - inertia_and_bias(panda.chain, panda)[0]
    )
    heavy = ftqp.TrueArm(mass_scale=1.2), ftqp.TrueArm(mass_scale=1.2, payload=load)
    bare, carrying = (inertia_and_bias(true.chain(panda), panda)[0] for true in heavy)
    np.testing.assert_allclose(carrying - bare, adds, rtol=0, atol=1e-12)


def test_equations_stay_those_of_pinocchio_after_lock_and_release(panda):
    physics = Physics(panda.chain, 1e-3)
    physics.reset(panda.neutral, np.full(7, 0.3))
    physics.fix(2)
    physics.resist(4, 50.0, 3.0)
    for _ in range(20):
        physics.step()
    physics.release(2)
    physics.resist(4, 0.0, 0.0)
    assert differences(physics, panda.model, panda).max() < 1e-10


def test_impulse_of_a_fixed_joint_keeps_the_momentum_of_the_others(panda):
    physics = Physics(panda.chain, 1e-3)
    v = np.linspace(-0.5, 1.0, 7)
    physics.reset(panda.neutral, v)
    M = physics.mass_matrix()
    physics.fix(3)
    assert physics.v[3] == 0.0
    others = [0, 1, 2, 4, 5, 6]
    np.testing.assert_allclose((M @ physics.v)[others], (M @ v)[others], atol=1e-12)


def test_joint_outside_its_end_stop_comes_back_without_rebound(panda):
    physics = Physics(panda.chain, 2.5e-4)
    physics.reset(panda.neutral, np.zeros(7))
    physics.stop_at(6, -0.5, 0.5)
    physics.q[6], physics.v[6] = 0.49, 2.0
    speeds = []
    for _ in range(200):
        physics.tau[:] = physics.bias
        physics.step()
        speeds.append(physics.v[6])
    assert 0.5 - 1e-3 < physics.q[6] < 0.5 + 1e-3
    assert min(speeds) > -0.05


def test_broken_motion_is_told_with_time_and_joint_and_leaves_no_file(panda, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    physics = Physics(panda.chain, 1e-3)
    physics.reset(panda.neutral, np.zeros(7))
    assert physics.failure is None
    physics.step()
    physics.tau[4] = np.nan
    physics.step()
    assert physics.failure is not None
    assert "panda_joint5" in physics.failure
    assert "t = 0.00" in physics.failure
    assert not list(tmp_path.iterdir())
    physics.reset(panda.neutral, np.zeros(7))
    assert physics.failure is None


START = np.array([0.3, 0.2, 0.12, 0.5, -0.05, 0.2, 0.9, 0.3])


@pytest.mark.parametrize("joint", [None, "elbow", "lift"])
def test_an_arm_with_mimic_joints_follows_its_path_in_physics_also_when_one_locks(joint):
    robot = ftqp.Robot.from_urdf(telescope(), "tool")
    planner = ftqp.Planner(robot, task=ftqp.Task("position"), drive=ftqp.Drive(bandwidth=94.0))
    plant = ftqp.MujocoPlant(robot, 1e-3)
    planner.reset(START)
    plant.reset(START, np.zeros(8))
    path = ftqp.paths.Circle(robot.pose(START), radius=0.03, duration=3.0)
    targets = targets_along(path, 1600, 0.001)
    worst = tied = 0.0
    for k in range(1600):
        if k == 700 and joint is not None:
            plant.fail(ftqp.Locked(joint))
            planner.report(ftqp.Locked(joint))
        step = planner.step(plant.q, None, targets.at(k))
        plant.advance(step)
        image = robot.chain.ratio * plant.q[robot.chain.lead] + robot.chain.offset
        tied = max(tied, np.abs(image - plant.q).max())
        worst = max(worst, step.position_error)
        assert not plant.tau[[2, 4]].any()
    assert step.status is ftqp.StepStatus.OK and tied < 1e-6
    assert worst < (1e-4 if joint is None else 8e-3) and step.position_error < 1e-3
    if joint is not None:
        assert abs(plant.v[robot.joint(joint)]) < 1e-4


PANDA = ftqp.robots.load("panda")
SHAPES = {
    "ball": ftqp.Sphere(0.12, (0.45, 0.1, 0.5)),
    "box": ftqp.Box((0.3, 0.2, 0.4), (0.4, -0.3, 0.5), rpy=(0.3, 0.2, 0.7)),
    "post": ftqp.Cylinder(0.1, 0.9, (-0.3, 0.3, 0.5), rpy=(0.4, 0.0, 0.0)),
    "rod": ftqp.Capsule((-0.6, -0.6, 0.2), (0.1, -0.5, 0.9), 0.07),
    "wedge": ftqp.Hull(0.5 * np.eye(4)[:, :3], place=(0.3, -0.5, 0.3), rpy=(0.2, 0.1, 0.4)),
    "floor": ftqp.HalfSpace(point=(0.0, 0.0, 0.1), normal=(0.1, 0.0, 1.0)),
}


@pytest.mark.parametrize("kind", SHAPES)
def test_contacts_are_where_the_planner_sees_negative_distances(kind):
    scene = ftqp.Scene()
    scene.add(kind, SHAPES[kind])
    sees = ftqp.Planner(PANDA, scene=scene, clearance=ftqp.Clearance(self_pairs=False))
    plant = ftqp.MujocoPlant(PANDA, 1e-3, scene=scene)
    rng, seen = np.random.default_rng(7), []
    low, high = PANDA.limits.q_min, PANDA.limits.q_max
    while min(seen.count(True), seen.count(False)) < 10:
        q = rng.uniform(low, high)
        pairs = sees.distances(q)
        d = min(map(float, pairs.values()))
        if abs(d) < 2e-3:
            continue
        plant.reset(q, np.zeros(PANDA.nv))
        plant._physics.step()
        assert (plant.contact_force > 0.0) == (d < 0.0), (q, d)
        seen.append(d < 0.0)


def test_an_arm_that_knows_nothing_of_a_wall_pushes_against_it_and_one_that_does_stays_clear():
    wall = ftqp.Scene()
    wall.add("wall", ftqp.Box((0.1, 1.0, 1.0), (0.53, 0.0, 0.5)))
    line = ftqp.paths.Line(PANDA.pose(PANDA.neutral), (0.2, 0.0, 0.0), duration=1.0)
    pushed = []
    for scene in (None, wall):
        planner = ftqp.Planner(PANDA, 1e-3, scene=scene, drive="position", emergency=None)
        plant = ftqp.MujocoPlant(PANDA, 1e-3, scene=wall)
        planner.reset(PANDA.neutral)
        worst = 0.0
        for k in range(1200):
            at = line.sample(np.array([min(k * 1e-3, 1.0)]))
            target = ftqp.Target(pose=at.pose[0], twist=at.twist[0], acceleration=at.acceleration[0])
            step = planner.step(plant.q, plant.v, target)
            plant.advance(step)
            worst = max(worst, plant.contact_force)
        pushed.append(worst)
    assert pushed[0] > 1.0 and pushed[1] == 0.0


def test_a_scenario_s_scene_stands_in_its_physics_too(tmp_path):
    from ftqp.app.scenario.setup import load

    file = tmp_path / "cell.toml"
    file.write_text(
        '[robot]\nname = "panda"\n[planner]\ndrive = { kind = "position" }\n[path]\nkind = "circle"\n'
        'radius = 0.05\nduration = 2.0\n[simulation]\nplant = "mujoco"\n[[scene]]\nkind = "half_space"\n'
        "point = [0.0, 0.0, 0.2]\n"
    )
    plant = load(str(file)).plant
    q = PANDA.neutral.copy()
    q[1] = 1.7  # bent down to the floor
    plant.reset(q, np.zeros(7))
    plant._physics.step()
    assert plant.contact_force > 0.0
