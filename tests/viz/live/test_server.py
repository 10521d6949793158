"""The server of a page: its port, its address, what it prints, and a client that says what a browser says."""

import socket
from time import monotonic, sleep

import msgspec
import pytest
from tests.viz.live.still_source import StillSource
from websockets.sync.client import connect

import ftqp
from ftqp.core.errors import InputError
from ftqp.sim.session.session_commands import Break, Pause
from ftqp.viz.live.live_page import Page
from ftqp.viz.live.server import VERSION, close_server, free_port, open_server

CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [1.0, 2, 3], "look_at": [0, 0, 0],
    "up_direction": [0, 0, 1], "fov": 0.8, "near": 0.01, "far": 1000, "image_height": 480, "image_width": 640,
}  # fmt: skip


def test_a_port_in_use_gives_the_next_free_one():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert port < free_port("127.0.0.1", port) <= port + 99


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
