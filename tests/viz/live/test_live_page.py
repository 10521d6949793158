"""What the page does with frames and clicks, without a browser."""

import asyncio
import re
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from tests.viz.live.still_source import StillSource

import ftqp
from ftqp.control.planner.status import STATUSES
from ftqp.sim.session.session_commands import Aim, Break, Pause, Repair, Reset, Seek, Speed, Tell, Use
from ftqp.viz.live import colours
from ftqp.viz.live.live_page import Page
from ftqp.viz.live.panel import short_names
from ftqp.viz.live.plots import History, failure_map, joint_table, status_head
from ftqp.viz.live.stage import HeatMap

NASTY = ("<script>alert(1)</script>", '"><img src=x onerror=alert(2)>')
"""Names of joints that would do something in a page."""
BROWSER = SimpleNamespace(client_id=0)
"""Who clicks."""


def nasty_arm():
    return ftqp.Robot.from_dh([[0, 0.1, 0.4, 0], [0, 0, 0.3, 0]], joints=list(NASTY), acceleration=5.0)


def controls(page):
    """The controls of a page by their labels."""
    found = {}
    for handle in page._server.gui._gui_input_handle_from_uuid.values():
        label = getattr(handle._impl.props, "label", None)
        found.setdefault(label, handle)
    return found


def use(handle, value):
    """What the server does when somebody in a browser changes a control."""
    handle._impl.value = value
    for callback in handle._impl.update_cb:
        asyncio.run(callback(SimpleNamespace(client=BROWSER, client_id=0, target=handle)))


def shown(page):
    """The data of the head of a page, by name."""
    content = page._panel._head.content
    return dict(re.findall(r'data-(\w+)="([^"]*)"', content))


@pytest.fixture(scope="module")
def panda():
    source = StillSource(
        ftqp.robots.load("panda"), robots=("panda", "iiwa14"), scenarios=("panda-circle",),
        schemes=("mvn", "man"), backends=("active_set", "daqp"),
    )  # fmt: skip
    with Page(source, port=0) as page:
        yield source, page


def test_every_button_of_every_joint_is_the_order_that_it_says(panda):
    source, page = panda
    rows = controls(page)
    for label, name in zip(short_names(source.robot.joints), source.robot.joints, strict=True):
        for word, order in (
            ("lock", Break(name, "locked")),
            ("free", Break(name, "free_swinging")),
            ("weak", Break(name, "degraded")),
            ("repair", Repair(name)),
        ):
            use(rows[label], word)
            assert source.orders[-1] == order


@pytest.mark.parametrize(
    ("label", "value", "order"),
    [
        ("time", "pause", Pause(True)),
        ("time", "resume", Pause(False)),
        ("time", "reset", Reset()),
        ("speed", 0.3, Speed(0.3)),
        ("report failure", "never", Tell("never", 0.5)),
        ("robot", "iiwa14", Use(robot="iiwa14")),
        ("scenario", "panda-circle", Use(scenario="panda-circle")),
        ("scheme", "man", Use(scheme="man")),
        ("backend", "daqp", Use(backend="daqp")),
    ],
)
def test_a_change_of_a_control_is_an_order(panda, label, value, order):
    source, page = panda
    use(controls(page)[label], value)
    assert source.orders[-1] == order


def test_the_handle_of_the_target_leads_the_tip_and_its_end_gives_the_path_back(panda):
    source, page = panda
    box, target = controls(page)["drag the target"], source.frame().target
    handle = page._scene.handles.tip.control  # it is there from the start, and leads nothing yet
    assert box.value and not any(isinstance(order, Aim) for order in source.orders)
    assert np.allclose(handle.position, target[:3, 3])
    grab = partial(SimpleNamespace, target=handle)
    asyncio.run(handle._impl_aux.update_cb[0](grab(phase="start")))
    assert not any(isinstance(order, Aim) for order in source.orders)
    handle._impl.position[:] = [0.4, 0.1, 0.5]
    asyncio.run(handle._impl_aux.update_cb[0](grab(phase="update")))
    assert isinstance(source.orders[-1], Aim)
    assert np.allclose(source.orders[-1].pose[:3, 3], [0.4, 0.1, 0.5])
    assert np.allclose(source.orders[-1].pose[:3, :3], target[:3, :3], atol=1e-9)
    use(box, False)
    assert source.orders[-1] == Aim(None)
    assert page._scene.handles.tip is None
    use(box, True)
    assert source.orders[-1] == Aim(None) and page._scene.handles.tip is not None
    use(controls(page)["time"], "to path")
    assert source.orders[-1] == Aim(None)


def test_names_of_joints_lose_what_all_begin_with():
    assert short_names(["panda_joint1", "panda_joint2"]) == ["joint1", "joint2"]
    assert short_names(["j1", "j12"]) == ["j1", "j12"]
    assert short_names(["left_joint1", "right_joint1"]) == ["left_joint1", "right_joint1"]
    assert short_names(["elbow"]) == ["elbow"]


def test_another_arm_leaves_no_node_and_no_control_behind():
    source = StillSource(ftqp.robots.load("panda"))
    with Page(source, port=0) as page:
        nodes, inputs = page.nodes(), len(page._server.gui._gui_input_handle_from_uuid)
        for name in ("modular11", "planar6", "panda", "panda"):
            source.become(ftqp.robots.load(name))
            assert page.refresh()
            assert shown(page)["stage"] == str(source.number)
        assert page.nodes() == nodes
        assert len(page._server.gui._gui_input_handle_from_uuid) == inputs


def test_a_replay_has_a_slider_over_its_time_and_no_buttons_that_break():
    source = StillSource(ftqp.robots.load("panda"), live=False, duration=20.0)
    with Page(source, port=0) as page:
        found = controls(page)
        assert not {"joint1", "robot", "report failure", "drag the target"} & set(found)
        use(found["t [s]"], 7.5)
        assert source.orders == [Seek(7.5)]
        source.facts |= {"t": 12.0, "tick": 12000}
        page._panel.show(source.frame())
        assert found["t [s]"].value == 12.0
        assert source.orders == [Seek(7.5)]


@pytest.mark.parametrize("status", [s.name for s in STATUSES])
def test_every_status_has_a_colour_and_its_sentence_is_in_the_head(panda, status):
    assert status in colours.STATUS
    source, _ = panda
    source.facts["status"] = [s.name for s in STATUSES].index(status)
    head = status_head(source.frame(), "t", source.robot.joints, "")
    source.facts["status"] = 0
    assert f'data-status="{status}"' in head
    assert colours.hexadecimal(colours.STATUS[status]) in head


def test_names_are_text_wherever_they_are_shown():
    source = StillSource(nasty_arm(), title=NASTY[0])
    source.facts |= {"message": NASTY[1], "truth": np.array([1, 1]), "belief": np.array([1, 1])}
    heat = HeatMap(
        joints=NASTY, times=np.array([0.0, 1.0]), codes=np.zeros((2, 2), dtype=np.int64), words={0: NASTY[0]},
        colours={0: '"><script>'}, coverage=1.0,
    )  # fmt: skip
    frame = source.frame()
    texts = [
        status_head(frame, NASTY[0], NASTY, History(frame).ribbon()),
        joint_table(frame, NASTY),
        failure_map(heat),
    ]
    for text in texts:
        assert "<script" not in text
        assert "<img" not in text
        assert "&lt;script&gt;" in text
    with Page(source, port=0) as page:
        assert page.refresh()
