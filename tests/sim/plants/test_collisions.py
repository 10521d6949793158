"""An arm in MuJoCo collides with what stands around it, where the planner's distances say so."""

import numpy as np
import pytest

import ftqp

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


def test_what_is_no_scene_is_refused():
    with pytest.raises(ftqp.InputError, match=r"scene is 'a table', expected an ftqp\.Scene or None"):
        ftqp.MujocoPlant(PANDA, 1e-3, scene="a table")
