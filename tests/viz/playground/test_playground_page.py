"""The playground in a real browser: no server, a click on a joint, and errors that the page says itself."""

import json
import re

import numpy as np
import pytest

import ftqp
from ftqp.app.commands.cli import app
from ftqp.model.serial import Inertial
from ftqp.viz.playground.playground_page import KNOTS, Played, playground_page

BODY = Inertial(mass=150.0, com=np.array([0.0, 0.0, -0.3]), inertia=np.diag([20.0, 15.0, 18.0]))
PANDA = ftqp.robots.load("panda")
CIRCLE = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), radius=0.1, axes=("x", "y"), duration=4.0)


def played(robot=PANDA, path=None, **given):
    planner = ftqp.Planner(robot, **given)
    made = {"kernel": "0" * 24, "wasm": b"wasm", "arm": b"arm", "loader": "export class Planner {}"}
    return Played(title="<one>", planner=planner, q=robot.neutral, path=path, **made)


def content_of(page):
    found = re.search(r'<script id="ftqp-playground" type="application/json">(.*?)</script>', page, re.S)
    return json.loads(found[1])


def test_a_page_says_what_is_in_it_and_has_no_address():
    page = playground_page(played(path=CIRCLE))
    content = content_of(page)
    assert content["title"] == "<one>" and content["joints"] == list(PANDA.joints)
    assert {"head", "table", "curve"} == set(content["texts"])
    assert [act for act in content["acts"].values() if act[0] == "joint"] == [["joint", i] for i in range(7)]
    assert len(content["path"]["rows"]) == 4 * -(-(KNOTS + 1) * 19 * 8 // 3)
    ours = page[page.index("<title>") : page.index("</script>", page.index('type="module"'))]
    assert "http" not in ours.replace("http://www.w3.org", "")


def test_an_arm_that_floats_is_refused_in_a_sentence():
    with pytest.raises(ftqp.InputError, match="shows a base that stands"):
        playground_page(played(PANDA.on_free_base(BODY)))


@pytest.fixture(scope="module")
def tab(opened, tmp_path_factory):
    pytest.importorskip("numba", reason="needs numba, which the extra 'build' brings")
    pytest.importorskip("ziglang", reason="needs ziglang, which the extra 'build' brings")
    from typer.testing import CliRunner

    file = tmp_path_factory.mktemp("playground") / "panda.html"
    done = CliRunner().invoke(app, ["build", "panda-circle", "--page", str(file), "--set", "path.duration=4"])
    assert done.exit_code == 0, done.output
    tab = opened(file.as_uri(), offline=True)
    tab.wait_for_selector("#ftqp-status")
    return tab


def data(tab):
    return tab.evaluate("({...document.querySelector('#ftqp-status').dataset})")


def until(tab, condition):
    tab.wait_for_function(f"(d => {condition})(document.querySelector('#ftqp-status').dataset)")


@pytest.mark.slow
def test_a_click_on_a_joint_locks_it_and_the_page_says_both_errors(tab):
    until(tab, "+d.tick > 300 && d.status === 'OK'")
    assert float(data(tab)["error"]) < 1e-5
    tab.get_by_role("button", name="lock", exact=True).nth(2).click()
    until(tab, "d.faults === 'panda_joint3:locked' && +d.unreported > 1e-3")
    said = data(tab)
    assert said["status"] == "OK" and float(said["error"]) < 1e-5


@pytest.mark.slow
def test_the_tip_goes_where_the_target_is_dragged(tab):
    drag = """([place]) => { const page = JSON.parse(document.getElementById('ftqp-playground').textContent);
        PlannerWorker.last.postMessage({type: 'send', message: {type: 'TransformControlsUpdateMessage',
            name: page.nodes.handle, wxyz: page.pose.slice(0, 4), position: place}}); }"""
    place = (PANDA.pose(PANDA.neutral)[:3, 3] + [-0.05, 0.05, 0.02]).tolist()
    tab.evaluate(drag, [place])
    now = int(data(tab)["tick"])
    until(tab, f"+d.tick > {now + 1500}")
    assert float(data(tab)["error"]) < 1e-4
    tab.get_by_role("button", name="reset", exact=True).click()
    until(tab, "d.faults === '' && +d.tick < 500 && d.status === 'OK'")
