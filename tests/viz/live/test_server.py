"""Who serves the live page and to whom, what it shows of a loop of one's own, and recordings of it."""

import re
import socket
from urllib.request import urlopen

import msgspec
import numpy as np
import pytest
from tests.viz.live.stepped_source import SteppedSource
from tests.viz.live.still_source import StillSource
from tests.viz.live.tape import messages_of, turns_of
from tests.waiting import until
from websockets.sync.client import connect

import ftqp
from ftqp.core.errors import InputError
from ftqp.core.pose import skew, transform
from ftqp.sim.session.session_commands import Break, Pause
from ftqp.viz.live.live_page import Page
from ftqp.viz.live.scene import frame_names
from ftqp.viz.live.server import VERSION, close_server, open_server, picture_ticks, recording
from ftqp.viz.live.watched import View

CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [1.0, 2, 3], "look_at": [0, 0, 0],
    "up_direction": [0, 0, 1], "fov": 0.8, "near": 0.01, "far": 1000, "image_height": 480, "image_width": 640,
}  # fmt: skip


def test_a_port_in_use_gives_the_next_free_one():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        server = open_server(port=port)
        try:
            assert port < server.get_port() <= port + 99
        finally:
            close_server(server)


@pytest.mark.parametrize(
    ("host", "port", "sentence"),
    [
        ("127.0.0.1", 70000, "port is 70000, expected 0 to 65535"),
        ("127.0.0.1", -1, "port is -1, expected 0 to 65535"),
        ("203.0.113.7", 8080, r"cannot listen at '203\.0\.113\.7'.*--host 127\.0\.0\.1"),
        ("no such host", 8080, "cannot listen at 'no such host'"),
    ],
)
def test_an_address_that_cannot_be_listened_at_is_refused_in_one_sentence(host, port, sentence):
    with pytest.raises(InputError, match=sentence):
        open_server(host, port)


def test_only_this_machine_is_served_in_silence_and_no_browser_can_ask_for_a_public_address(caplog, capfd):
    server = open_server(port=0)
    try:
        assert server.get_host() == "127.0.0.1"
        asked = {message.__name__ for message in server._websock_server._incoming_handlers}
        assert "GuiUpdateMessage" in asked and not {name for name in asked if "Share" in name}
        for _ in range(3):
            socket.create_connection(("127.0.0.1", server.get_port()), timeout=10).close()
        with socket.create_connection(("127.0.0.1", server.get_port()), timeout=10) as open_one:
            open_one.sendall(b"nonsense\r\n\r\n")
            open_one.recv(10)
    finally:
        close_server(server)
    assert caplog.text == "" and capfd.readouterr() == ("", "")


def sent(client, message):
    client.send(msgspec.msgpack.encode(message))


def test_what_is_clicked_becomes_a_command():
    source = StillSource(ftqp.robots.load("panda"))
    with Page(source, port=0) as page:
        controls = page._server.gui._gui_input_handle_from_uuid
        named = {handle._impl.props.label: uuid for uuid, handle in controls.items()}
        url = page.url.replace("http://", "ws://")
        with connect(url, proxy=None, max_size=None, subprotocols=[f"viser-v{VERSION}"]) as client:
            sent(client, CAMERA)
            until(lambda: page.browsers == 1)
            for label, value in (("time", "pause"), ("joint3", "lock")):
                sent(client, {"type": "GuiUpdateMessage", "uuid": named[label], "updates": {"value": value}})
            until(lambda: len(source.orders) == 2)
    assert source.orders == [Pause(True), Break("panda_joint3")]


PANDA = ftqp.robots.load("panda")


def test_a_loop_shows_its_steps_and_what_its_planner_believes():
    planner = ftqp.Planner(PANDA, dt=1e-3)
    planner.reset(PANDA.neutral)
    target = ftqp.Target(PANDA.pose(PANDA.neutral))
    with ftqp.view(planner, port=0) as shown:
        with urlopen(shown.url) as answer:
            assert b"<html" in answer.read(2000).lower()
        assert "iframe" in shown._repr_html_() and shown.url in shown._repr_html_()
        planner.report(ftqp.Locked(2))
        step = planner.step(PANDA.neutral, None, target)
        shown.show(step)
        assert np.array_equal(shown.frame().q, step.q) and shown.frame().belief[2] == 1
        before = shown.frame()
        shown.show(PANDA.neutral + 0.1)  # too early for another picture
        assert shown.frame() is before


def test_the_way_that_an_arm_is_to_go_is_a_ghost_and_stays_one_while_it_is_the_same():
    q = PANDA.neutral
    way = np.stack([q, q + 0.3, q + 0.5])
    with View(PANDA, port=0) as shown:
        shown.show(q, way=way)
        (ghost,) = ways = shown.frame().ways
        assert ghost.kind == "way round" and ghost.price == f"{0.5 * 7**0.5:.1f} rad"
        assert np.allclose(ghost.joints[-1], PANDA.pose(way[-1]))
        assert np.allclose(ghost.tips[[0, -1]], [PANDA.pose(way[k])[:3, 3] for k in (0, -1)])
        named = [
            node for node in shown._page._server.scene._handle_from_node_name if node.endswith("ways/0/tip")
        ]
        assert len(named) == 1
        shown._due = 0.0
        shown.show(q + 0.1, way=way.copy())
        assert shown.frame().ways is ways
        shown._due = 0.0
        shown.show(q + 0.2)
        assert shown.frame().ways == ()
        with pytest.raises(ftqp.InputError, match="way has shape"):
            shown.show(q, way=way[:, :6])


def test_a_robot_is_shown_in_any_configuration_and_has_no_clock():
    with View(PANDA, PANDA.neutral + 0.1, port=0) as shown:
        assert np.allclose(shown.frame().q, PANDA.neutral + 0.1)
        inputs = shown._page._server.gui._gui_input_handle_from_uuid.values()
        assert not {"time", "joint1"} & {getattr(one, "label", None) for one in inputs}


def test_what_stands_around_the_arm_of_a_planner_is_drawn():
    scene = ftqp.Scene()
    scene.add("wall", ftqp.Box(size=(0.5, 0.06, 0.7), place=(0.6, 0.0, 0.35)))
    planner = ftqp.Planner(PANDA, dt=1e-3, scene=scene)
    planner.reset(PANDA.neutral)
    with ftqp.view(planner, port=0) as shown:
        (wall,) = (one for one in shown.frame().further if one.name == "wall")
        assert wall.solid.kind == "box" and wall.solid.extent == (0.25, 0.03, 0.35)
        to = planner.distances(PANDA.neutral)
        assert wall.value == pytest.approx(min(float(d) for pair, d in to.items() if "wall" in pair))


def test_what_is_neither_planner_nor_robot_is_refused():
    with pytest.raises(ftqp.InputError, match="a planner or a robot, got ndarray"):
        ftqp.view(np.zeros(7))


LOCK = 20
"""The frame before which the third joint locks."""


@pytest.fixture(scope="module")
def frames():
    source = SteppedSource(seconds=0.05, overrides=["faults=[]", "path.duration=3"])
    made = []
    for k in range(40):
        if k == LOCK:
            source.put(Break("panda_joint3", "locked", {"mode": "instant"}))
        made.append(source.frame())
    return source, made


@pytest.fixture(scope="module")
def page(frames):
    source, made = frames
    return recording(made, source.stage().robot, path=source.stage().path, title="<script>alert(1)</script>")


def pose(page, node):
    """The last pose of a node in its parent."""
    _, messages = messages_of(page)
    told = {m["type"]: m for _, m in messages if m.get("name") == node}
    x, y, z = (
        told["SetOrientationMessage"]["wxyz"][1:] if "SetOrientationMessage" in told else (0.0, 0.0, 0.0)
    )
    w = np.sqrt(max(1.0 - x * x - y * y - z * z, 0.0))
    T = np.eye(4)
    T[:3, :3] = np.eye(3) + 2.0 * (
        w * skew(np.array([x, y, z])) + skew(np.array([x, y, z])) @ skew(np.array([x, y, z]))
    )
    T[:3, 3] = told["SetPositionMessage"]["position"] if "SetPositionMessage" in told else 0.0
    return T


def test_the_locked_joint_stands_after_its_lock_and_its_neighbours_do_not(frames, page):
    _, made = frames
    lock = made[LOCK].t - made[0].t
    for joint, stands in ((1, False), (2, True), (3, False)):
        times, turned = turns_of(page, frame_names("/arm-1", range(-1, 6))[joint])
        assert len(np.unique(turned[times < lock - 1e-9], axis=0)) > 10
        after = len(np.unique(turned[times > lock + 1e-9], axis=0))
        assert after == 0 if stands else after > 10


def test_the_last_tip_pose_is_that_of_the_last_frame(frames, page):
    source, made = frames
    chain, T = source.stage().robot.chain, np.eye(4)
    for node in frame_names("/arm-1", range(-1, 6)):
        T = T @ pose(page, node)
    T = T @ transform(chain.tip_rotation, chain.tip_translation)
    assert np.allclose(T, made[-1].tip, atol=2e-5)
    assert not np.allclose(T, made[-2].tip, atol=2e-5)


def test_no_address_is_fetched_and_the_title_is_escaped(page):
    assert not re.findall(r"""(?:src|href)\s*=\s*["']?\s*(?:https?:)?//""", page)
    assert "<script>alert(1)" not in page
    assert "<title>&lt;script&gt;alert(1)&lt;/script&gt;</title>" in page
    assert "viser 1." in page


def test_a_long_run_is_thinned_to_a_minute_of_pictures_unless_all_are_asked_for():
    t = 0.001 * np.arange(600_001)
    thinned = picture_ticks(t, fps=30.0)
    assert len(thinned) == 1800
    assert thinned[0] == 0
    assert thinned[-1] == 600_000
    assert len(picture_ticks(t, fps=30.0, longest=None)) == 18_001
    assert np.allclose(np.diff(t[picture_ticks(t[:5001], fps=30.0)])[:-1], 1.0 / 30.0, atol=1.1e-3)
    assert list(picture_ticks(t[:1])) == [0]
