"""The tables [[scene]], [clearance] and [[tasks]]: what they make, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from tests.app.conftest import invoke

import ftqp
from ftqp.app.campaign.shown_trace import model_file, trace
from ftqp.app.output.words import further_sentences
from ftqp.app.scenario.setup import load
from ftqp.checker.checked_run import verdict
from ftqp.core.errors import ScenarioError
from ftqp.sim.log.metrics import summary as summary_of

HEAD = """
[robot]
name = "panda"
[path]
kind = "line"
displacement = [0.1, 0.13, 0.05]
duration = 1.0
[simulation]
duration = 1.2
"""
AROUND = """
[[scene]]
kind = "cylinder"
name = "post"
radius = 0.05
length = 1.2
place = [0.45, 0.3, 0.6]
[[scene]]
kind = "box"
size = [0.4, 0.4, 0.03]
place = [0.7, -0.2, 0.1]
rpy = [0.0, 0.0, 0.7853981633974483]
[[scene]]
kind = "half_space"
point = [0.0, 0.0, -0.05]
[[scene]]
kind = "sphere"
radius = 0.05
place = [-0.5, 0.5, 0.5]
[[scene]]
kind = "sphere"
radius = 0.06
place = [-0.5, -0.5, 0.5]
[[scene]]
kind = "capsule"
a = [0.6, -0.6, 0.3]
b = [0.6, -0.6, 0.9]
radius = 0.02
[[scene]]
kind = "hull"
corners = [[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.2]]
place = [0.5, 0.5, 0.0]
[clearance]
keep = 0.015
"""


@pytest.fixture
def made(tmp_path):
    def make(text, *overrides):
        (tmp_path / "scene.toml").write_text(HEAD + text)
        return load(str(tmp_path / "scene.toml"), overrides)

    return make


def test_a_scene_is_made_of_its_tables(made):
    planner = made(AROUND).planner
    assert list(planner.scene) == ["post", "box", "half space", "sphere", "sphere 2", "capsule", "hull"]
    assert planner.clearance.keep == 0.015
    np.testing.assert_allclose(planner.scene["box"].place[:2, 0], [np.sqrt(0.5)] * 2)
    assert made("[clearance]").planner.distances(ftqp.robots.load("panda").neutral)
    assert made("").planner.scene is None


def test_a_run_keeps_how_near_the_arm_came_and_is_judged_by_it(made, tmp_path):
    setup = made(AROUND)
    setup.simulation(log=tmp_path / "log.npy").run()
    log = ftqp.load_log(tmp_path / "log.npy")
    names = [name for name in log.names if name.startswith("clearance.")]
    assert names == [f"clearance.{name}" for name in (*setup.planner.scene, "itself")]
    near = log["clearance.post"]
    assert 0.0149 < near.min() < 0.016 < near[0]
    summary = json.loads(json.dumps(summary_of(log)))
    assert summary["clearance"]["post"]["min_distance"] == pytest.approx(float(near.min()))
    assert "the arm stayed 15 mm away from post at the nearest" in further_sentences(summary)
    shown = trace(setup, log)
    assert len(shown.bodies) == 11 and len(shown.things) == 7 and shown.keep == 0.015
    assert "touched" not in verdict(model_file(setup), shown).laws
    q = shown.q.copy()
    q[-200:, 0] += 0.3  # into the post
    assert "touched" in verdict(model_file(setup), replace(shown, q=q)).laws


def test_bodies_of_the_arm_can_be_given_in_the_file(made):
    text = '[[robot.capsules]]\na = [0, 0, 0]\nb = [0, 0, 0.1]\nradius = 0.05\nframe = "{}"\n'
    arm = made(text.format("panda_hand_tcp")).robot
    assert [(one.frame, one.radius) for one in arm.capsules] == [("panda_hand_tcp", 0.05)]
    with pytest.raises(ScenarioError, match=r"robot: .*'panda_hant'"):
        made(text.format("panda_hant"))
    with pytest.raises(ScenarioError, match=r"robot: a capsule has no frame"):
        made("[[robot.capsules]]\na = [0, 0, 0]\nb = [0, 0, 0.1]\nradius = 0.05\n")
    with pytest.raises(ScenarioError, match=r"scene: capsule has the frame 'panda_hand'"):
        made(
            '[[scene]]\nkind = "capsule"\na = [0, 0, 0]\nb = [0, 0, 0.1]\nradius = 0.05\nframe = "panda_hand"'
        )


LINK = """<link name="{0}"><inertial><mass value="1"/><inertia ixx="1e-2" ixy="0" ixz="0" iyy="1e-2" iyz="0"
izz="1e-2"/></inertial>{1}</link>"""
JOINT = """<joint name="j{0}" type="revolute"><parent link="l{1}"/><child link="l{0}"/>
<origin xyz="{2} 0 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="2" effort="50"/></joint>"""
BLADE = """<collision><origin xyz="0 0.1 0"/><geometry>
<mesh filename="blade.obj" scale="0.1 0.1 0.1"/></geometry></collision>"""


def test_links_are_judged_by_their_meshes_where_the_file_has_some(tmp_path):
    (tmp_path / "blade.obj").write_text(
        "v 0 0 0\nv 4 0 0\nv 0 2 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    links = [LINK.format(f"l{k}", BLADE if k == 2 else "") for k in range(5)]
    joints = [JOINT.format(k, k - 1, 0.0 if k == 1 else 0.4) for k in range(1, 5)]
    (tmp_path / "arm.urdf").write_text(f'<robot name="arm">{"".join([*links, *joints])}</robot>')
    (tmp_path / "run.toml").write_text(
        '[robot]\nurdf = "arm.urdf"\ntip = "l4"\n[start]\nq = [0.3, 0.4, 0.5, 0.6]\n[planner]\n'
        'task = { rows = ["x", "y"] }\n[path]\nkind = "line"\ndisplacement = [0.0, 0.05, 0.0]\n'
        'duration = 0.5\n[[scene]]\nkind = "sphere"\nradius = 0.05\nplace = [0.0, -1.0, 0.0]\nname = "ball"\n'
    )
    setup = load(str(tmp_path / "run.toml"))
    setup.simulation(log=tmp_path / "log.npy").run()
    shown, arm = trace(setup, ftqp.load_log(tmp_path / "log.npy")), model_file(setup)
    (blade,) = arm.links
    assert blade.joint == 1 and blade.reach > 0.4 and "touched" not in verdict(arm, shown).laws
    # Capsules that leave the blade out: they stay clear of a ball that the blade goes through.
    at = setup.robot.pose(shown.q[-1], "j2") @ [0.2, 0.15, 0.02, 1.0]
    pose = np.eye(4)
    pose[:3, 3] = at[:3]
    ball = replace(shown.things[0], pose=pose, extent=(0.0, 0.01, 0.0))
    ends, none = [[0.0, 0.0, 5.0]] * 2, np.zeros((0, 3))
    thin = [replace(body, radius=1e-3, ends_at_zero=ends, corners_at_zero=none) for body in shown.bodies]
    small = replace(shown, bodies=thin, things=[ball], watched=[(thin[1].name, "ball")], keep=0.0)
    assert "touched" in verdict(arm, small).laws
    assert "touched" not in verdict(replace(arm, links=()), small).laws


CIRCLE = '[robot]\nname = "panda"\n[path]\nkind = "circle"\nradius = 0.05\nduration = 1.0\n'
ELBOW = """kind = "position"
frame = "panda_joint4"
rows = "z"
target = [0.0, 0.0, 0.7]
weight = 5.0
name = "elbow"
"""


def scenario(folder, *tables):
    file = folder / "several.toml"
    file.write_text(CIRCLE + "".join(f"[[tasks]]\n{table}\n" for table in tables), encoding="utf-8")
    return load(str(file))


def test_tables_reach_the_planner_and_survive_being_written(tmp_path):
    axis = 'kind = "axis"\nframe = "panda_joint6"\ntowards = [1.0, 0.0, 0.0]'
    joints, mass = 'kind = "joints"\njoints = { panda_joint7 = 0.5 }', 'kind = "centre_of_mass"\nrows = "xy"'
    table = '[[constraints]]\nframe = "panda_joint4"\nabove = [0.0, 0.0, 0.3]\nname = "table"'
    table += '\n[[constraints]]\nname = "cell"\nframe = "panda_joint4"\n'
    table += "inside = [[-inf, -0.5, 0.1], [inf, inf, 2.0]]"
    table += '\n[[constraints]]\nframe = "panda_joint6"\nalong = [0.0, 0.0, 1.0]\nwithin = 2.0\nname = "cup"'
    setup = scenario(tmp_path, ELBOW, axis, joints, mass, 'kind = "posture"\n' + table)
    assert setup.planner.constraints["table"].given.above[2] == 0.3
    cell, cup = (setup.planner.constraints[name].given for name in ("cell", "cup"))
    assert cell.shape == "box" and [side.name for side in cell.sides] == ["y low", "z low", "z high"]
    assert cup.shape == "cone" and cup.within == 2.0
    tasks = setup.planner.tasks
    assert list(tasks) == ["elbow", "panda_joint6 axis", "JointTask", "CentreOfMass", "PostureTask"]
    assert tasks["elbow"].weight == 5.0 and tasks["elbow"].target.tolist() == [0.0, 0.0, 0.7]
    np.testing.assert_array_equal(tasks["PostureTask"].target, setup.q)
    again = tmp_path / "again.toml"
    again.write_text(setup.toml, encoding="utf-8")
    assert load(str(again)).content == setup.content
    plain = load(str(again), ["tasks=[]"])
    ends = [one.simulation().run().q[-1] for one in (setup, plain)]
    assert np.abs(ends[0] - ends[1]).max() > 1e-3


@pytest.mark.parametrize("command", [["coverage"], ["converge"], ["plan", "-o", "plan.npz"]])
def test_a_command_that_looks_at_no_plane_refuses_them(tmp_path, command, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plane = 'kind = "posture"\n[[constraints]]\nframe = "panda_joint4"\nabove = [0.0, 0.0, 0.3]'
    scenario(tmp_path, plane)
    done = invoke(command[0], "several.toml", *command[1:])
    said = " ".join(str(getattr(done, "stderr", done.output)).split()) + str(done.exception)
    assert done.exit_code != 0 and f"which ftqp {command[0]} does not look at" in said
