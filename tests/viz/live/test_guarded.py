"""A page and somebody who connects to it by a client of their own, as a stranger would."""

import logging
from contextlib import closing
from socket import create_connection
from time import monotonic, sleep
from urllib.error import HTTPError
from urllib.request import ProxyHandler, Request, build_opener

import msgspec
import pytest
from tests.viz.live.still_source import StillSource
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

import ftqp
from ftqp.sim.session.session_commands import Break, Pause
from ftqp.viz.live.live_page import Page
from ftqp.viz.live.server import HEADERS, PATIENCE, VERSION

CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [1.0, 2, 3], "look_at": [0, 0, 0],
    "up_direction": [0, 0, 1], "fov": 0.8, "near": 0.01, "far": 1000, "image_height": 480, "image_width": 640,
}  # fmt: skip
JUNK = (
    b"", b"nonsense", b"\xc1", b"\x91" * 5000, b"\x81\x90\x01", "text",
    *map(msgspec.msgpack.encode, (
        None, [], {}, {"type": "NoSuchMessage"}, {"type": ["x"]}, {"type": "GuiUpdateMessage"},
        {"type": "ViewerCameraMessage", "wxyz": [1]}, {**CAMERA, "fov": float("nan")},
        {"type": "ShareUrlRequest"}, {"type": "CommandTriggerMessage", "uuid": "x"},
    )),
)  # fmt: skip


@pytest.fixture(scope="module")
def served():
    source = StillSource(ftqp.robots.load("panda"))
    with Page(source, port=0) as page:
        yield source, page


def joined(page, address=None, origin="same", **more):
    """A connection as the page itself makes it, but for what a test changes."""
    url = (page.url if address is None else address).replace("http://", "ws://")
    here = f"http://127.0.0.1:{page.port}"
    more = {"subprotocols": [f"viser-v{VERSION}"]} | more
    return connect(url, origin=here if origin == "same" else origin, proxy=None, max_size=None, **more)


def sent(client, message):
    client.send(message if isinstance(message, bytes | str) else msgspec.msgpack.encode(message))


def controls(page):
    """Identities and states of the controls, by their labels."""
    found = {}
    for uuid, handle in page._server.gui._gui_input_handle_from_uuid.items():
        found.setdefault(handle._impl.props.label, (uuid, handle._impl))
    return found


def update(uuid, **updates):
    return {"type": "GuiUpdateMessage", "uuid": uuid, "updates": updates}


def until(what):
    end = monotonic() + 20.0
    while not what():
        assert monotonic() < end
        sleep(0.01)


def answered(url, **headers):
    """Status, headers and text of what is served there."""
    try:
        with build_opener(ProxyHandler({})).open(Request(url, headers=headers), timeout=20.0) as answer:
            return answer.status, answer.headers, answer.read()
    except HTTPError as error:
        with closing(error):
            return error.code, error.headers, error.read()


def test_the_page_and_its_buttons_work_for_whoever_knows_the_address(served):
    source, page = served
    status, headers, text = answered(page.url)
    assert status == 200 and b"<html" in text[:2000]
    assert all(headers[name] == value for name, value in HEADERS.items())
    with joined(page) as client:
        sent(client, CAMERA)
        until(lambda: page.browsers == 1)
        sent(client, update(controls(page)["time"][0], value="pause"))
        sent(client, update(controls(page)["joint3"][0], value="lock"))
        until(lambda: len(source.orders) == 2)
    assert source.orders == [Pause(True), Break("panda_joint3")]
    source.orders.clear()


def test_nobody_without_the_token_is_served_or_connected(served):
    _, page = served
    address = f"http://127.0.0.1:{page.port}"
    for wrong in (address, f"{address}/", f"{address}/index.html", f"{page.url[:-1]}", f"{address}/x/../"):
        status, _, text = answered(wrong)
        assert status == 403 and b"open the one that ftqp view has printed" in text
        with pytest.raises(InvalidStatus, match="403"), joined(page, wrong):
            pass


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "http://localhost:3000", "null", "http://127.0.0.1:1"]
)
def test_no_other_site_connects_although_it_knows_the_address(served, origin):
    _, page = served
    with pytest.raises(InvalidStatus, match="403"), joined(page, origin=origin):
        pass
    assert answered(page.url, Origin=origin)[0] == 403


def test_no_name_that_others_let_point_here_is_served_or_connected(served):
    _, page = served
    status, _, text = answered(page.url, Host=f"evil.example:{page.port}")
    assert status == 403 and b"not served under that name" in text
    url = page.url.replace("127.0.0.1", "evil.example")
    with (
        create_connection(("127.0.0.1", page.port)) as here,
        pytest.raises(InvalidStatus, match="403"),
        joined(page, url, origin=f"http://evil.example:{page.port}", sock=here),
    ):
        pass


def test_nothing_but_a_value_that_a_control_can_have_changes_it(served):
    source, page = served
    uuid, state = controls(page)["speed"]
    row = controls(page)["joint3"][0]
    before = (state.value, state.props, state.removed, list(state.update_cb))
    with joined(page) as client:
        sent(client, CAMERA)
        until(lambda: page.browsers == 1)
        for updates in (
            {"props": None}, {"update_cb": []}, {"removed": True}, {"value": 2.0, "removed": True}, {"no": 1},
            {}, {"sync_cb": None}, {"value": 99.0}, {"value": float("nan")}, {"value": "x"}, {"value": [1]},
            {"gui_api": 1},
        ):  # fmt: skip
            sent(client, update(uuid, **updates))
        sent(client, update(row, value="explode"))
        sent(client, update("nobody", value=1.0))
        sent(client, update(row, value="free"))
        until(lambda: source.orders)
    assert (state.value, state.props, state.removed, list(state.update_cb)) == before
    assert source.orders == [Break("panda_joint3", "free_swinging")]
    source.orders.clear()


def test_junk_is_dropped_without_a_word_and_the_page_lives_on(served, capfd, caplog, recwarn):
    source, page = served
    caplog.set_level(logging.DEBUG, logger="asyncio")
    with joined(page) as client:
        sent(client, CAMERA)
        for message in JUNK:
            sent(client, message)
        sent(client, update(controls(page)["joint2"][0], value="lock"))
        until(lambda: source.orders)
    assert source.orders.pop() == Break("panda_joint2")
    assert capfd.readouterr() == ("", "")
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]
    assert not list(recwarn)


def test_a_client_that_sends_nothing_but_junk_is_sent_away(served, capfd):
    source, page = served
    with joined(page) as client, pytest.raises(ConnectionClosed, match="1008"):
        for _ in range(PATIENCE + 1):
            sent(client, b"junk")
        while True:
            client.recv(timeout=20.0)
    assert source.orders == [] and capfd.readouterr() == ("", "")
    with joined(page) as other:
        sent(other, update(controls(page)["time"][0], value="resume"))
        sent(other, CAMERA)
        until(lambda: page.browsers >= 1)


def test_errors_in_the_loop_of_a_server_cost_one_line(caplog, capfd):
    caplog.set_level(logging.WARNING, logger="ftqp")
    with Page(StillSource(ftqp.robots.load("panda")), port=0) as page:  # one that has met none before
        loop = page._server._event_loop
        for _ in range(20):
            loop.call_soon_threadsafe(lambda: 1 / 0)
        until(lambda: caplog.messages)
        sleep(0.1)
    assert len(caplog.messages) == 1 and "ZeroDivisionError" in caplog.messages[0]
    assert "Traceback" not in capfd.readouterr().err
