"""The server of a page: its port, its address, and what it prints."""

import socket

import pytest

from ftqp.core.errors import InputError
from ftqp.viz.live.server import close_server, free_port, open_server


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


def test_only_this_machine_is_served_and_nothing_is_printed(capfd):
    server = open_server(port=0)
    try:
        assert server.get_host() == "127.0.0.1"
        with socket.create_connection(("127.0.0.1", server.get_port()), timeout=10):
            pass
    finally:
        close_server(server)
    assert capfd.readouterr() == ("", "")


def test_no_browser_can_ask_for_a_public_address():
    server = open_server(port=0)
    try:
        asked = {message.__name__ for message in server._websock_server._incoming_handlers}
        assert "GuiUpdateMessage" in asked
        assert not {name for name in asked if "Share" in name}
    finally:
        close_server(server)


def test_a_connection_that_is_dropped_at_once_is_no_news(caplog, capfd):
    server = open_server(port=0)
    try:
        for _ in range(3):
            socket.create_connection(("127.0.0.1", server.get_port()), timeout=10).close()
        with socket.create_connection(("127.0.0.1", server.get_port()), timeout=10) as open_one:
            open_one.sendall(b"nonsense\r\n\r\n")
            open_one.recv(10)
    finally:
        close_server(server)
    assert caplog.text == ""
    assert capfd.readouterr().err == ""
