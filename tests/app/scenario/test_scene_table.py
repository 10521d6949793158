"""The tables [[scene]] and [clearance]: what they make, what a run keeps of them, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

import ftqp
from ftqp.app.campaign.shown_trace import model_file, trace
from ftqp.app.output.words import further_sentences
from ftqp.app.scenario.setup import load
from ftqp.checker.checked_run import verdict
from ftqp.core.errors import InputError, ScenarioError
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
    assert list(planner.scene) == ["post", "box", "half space", "sphere", "sphere 2", "capsule"]
    assert planner.clearance.keep == 0.015
    np.testing.assert_allclose(planner.scene["box"].place[:2, 0], [np.sqrt(0.5)] * 2)
    assert made("[clearance]").planner.distances(ftqp.robots.load("panda").neutral)
    assert made("").planner.scene is None


def test_a_run_keeps_how_near_the_arm_came_and_is_judged_by_it(made, tmp_path):
    setup = made(AROUND)
    setup.simulation(log=tmp_path / "log.sqlite").run()
    log = ftqp.load_log(tmp_path / "log.sqlite")
    names = [name for name in log.names if name.startswith("clearance.")]
    assert names == [f"clearance.{name}" for name in (*setup.planner.scene, "itself")]
    near = log["clearance.post"]
    assert 0.0149 < near.min() < 0.016 < near[0]
    summary = json.loads(json.dumps(summary_of(log)))
    assert summary["clearance"]["post"]["min_distance"] == pytest.approx(float(near.min()))
    assert "the arm stayed 15 mm away from post at the nearest" in further_sentences(summary)
    shown = trace(setup, log)
    assert len(shown.bodies) == 11 and len(shown.things) == 6 and shown.keep == 0.015
    assert "touched" not in verdict(model_file(setup), shown).laws
    q = shown.q.copy()
    q[-200:, 0] += 0.3  # into the post
    assert "touched" in verdict(model_file(setup), replace(shown, q=q)).laws


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[scene]]\nkind = "cone"\nradius = 0.1', r"scene\[0\] has kind 'cone'"),
        ('[[scene]]\nkind = "sphere"', r"scene\[0\].radius is missing"),
        (
            '[[scene]]\nkind = "box"\nsize = [100.0, 900.0, 10.0]',
            r"scene\[0\]: size is 900 m, .* millimetres",
        ),
        ('[[scene]]\nkind = "sphere"\nradius = -0.1', r"scene\[0\].radius"),
        ('[[scene]]\nkind = "sphere"\nradius = 0.1\nplase = [0, 0, 0]', r"scene\[0\].plase .*place"),
        (AROUND.replace('name = "post"', 'name = "sphere"'), "there is a 'sphere' in the scene"),
        (AROUND.replace('name = "post"', 'name = "panda_link5"'), "two things are called 'panda_link5'"),
        ("[clearance]\nkeep = 0.001", "expected stop < keep"),
        ("[clearance]\nkeep = 0.02\nstop = -1", r"clearance.stop"),
        ('[clearance]\nignore = [["panda_hand", "tabel"]]', "ignore has 'tabel'"),
    ],
)
def test_wrong_tables_are_refused_in_a_sentence(made, text, said):
    with pytest.raises(ScenarioError, match=said):
        made(text)


def test_commands_that_look_at_no_scene_refuse_one(made):
    with pytest.raises(InputError, match=r"has \[\[scene\]\], which ftqp converge does not look at"):
        made(AROUND).refuse_tables("ftqp converge", "constraints", "scene")
