"""A page and a client that says what a browser says."""

from time import monotonic, sleep

import msgspec
from tests.viz.live.still_source import StillSource
from websockets.sync.client import connect

import ftqp
from ftqp.sim.session.session_commands import Break, Pause
from ftqp.viz.live.live_page import Page
from ftqp.viz.live.server import VERSION

CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [1.0, 2, 3], "look_at": [0, 0, 0],
    "up_direction": [0, 0, 1], "fov": 0.8, "near": 0.01, "far": 1000, "image_height": 480, "image_width": 640,
}  # fmt: skip


def sent(client, message):
    client.send(msgspec.msgpack.encode(message))


def until(what):
    end = monotonic() + 20.0
    while not what():
        assert monotonic() < end
        sleep(0.01)


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
