"""The tables ``[[tasks]]``: they reach the planner, and what is wrong of them is told."""

import numpy as np
import pytest
from tests.app.conftest import invoke

from ftqp.app.scenario.setup import load

HEAD = '[robot]\nname = "panda"\n[path]\nkind = "circle"\nradius = 0.05\nduration = 1.0\n'
ELBOW = """kind = "position"
frame = "panda_joint4"
rows = "z"
target = [0.0, 0.0, 0.7]
weight = 5.0
name = "elbow"
"""


def scenario(folder, *tables):
    file = folder / "several.toml"
    file.write_text(HEAD + "".join(f"[[tasks]]\n{table}\n" for table in tables), encoding="utf-8")
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
