"""Who is answered: whoever knows the address, under a name of this machine, from the page itself."""

import pytest

from ftqp.viz.live.page_access import Gate

HERE = "127.0.0.1:8080"


def refused(gate, path=None, host=HERE, origin=None):
    origins = [] if origin is None else [origin]
    return gate.refusal(f"/{gate.token}" if path is None else path, [host], origins)


@pytest.mark.parametrize("ending", ["", "/", "/index.html", "?a=b", "/?websocket=ws://127.0.0.1:8080/x"])
def test_whoever_knows_the_address_is_answered(ending):
    gate = Gate("127.0.0.1")
    assert refused(gate, f"/{gate.token}{ending}", origin=f"http://{HERE}") == ""


def test_the_token_is_taken_off_the_path():
    gate = Gate("127.0.0.1")
    assert gate.behind(f"/{gate.token}/a/b.js?x=1") == "/a/b.js"
    assert gate.behind(f"/{gate.token}") == gate.behind(f"/{gate.token}/") == "/"


def test_every_server_has_a_token_of_its_own_that_nobody_guesses():
    tokens = {Gate("127.0.0.1").token for _ in range(50)}
    assert len(tokens) == 50 and min(map(len, tokens)) >= 22


def test_an_address_without_the_token_or_with_another_one_is_refused():
    gate = Gate("127.0.0.1")
    wrong = ("/", "", "/index.html", f"/{gate.token[:-1]}", f"/{gate.token}x", f"/x/{gate.token}",
             f"/?{gate.token}", f"/{Gate('127.0.0.1').token}", "/%ff%fe", "/é", "/\x00")  # fmt: skip
    assert all("address is not complete" in refused(gate, path) for path in wrong)


@pytest.mark.parametrize("name", ["127.0.0.1", "127.0.0.1:9", "localhost:8080", "LOCALHOST", "[::1]:8080"])
def test_loopback_names_are_ours_at_any_port_as_a_tunnel_may_end_elsewhere(name):
    assert refused(Gate("127.0.0.1"), host=name) == ""


@pytest.mark.parametrize(
    "name",
    ["evil.example", "evil.example:8080", "127.0.0.1.evil.example", "localhost.evil.example", "192.168.0.7",
     "", "[::1", "user@evil.example", "127.0.0.1@evil.example"],
)  # fmt: skip
def test_names_that_others_let_point_here_are_refused(name):
    assert "not served under that name" in refused(Gate("127.0.0.1"), host=name)


@pytest.mark.parametrize(("name", "known"), [("192.168.0.7:8080", True), ("evil.example:8080", False)])
def test_page_that_is_open_to_the_network_is_served_under_numbers_only(name, known):
    assert (refused(Gate("0.0.0.0"), host=name) == "") is known


def test_name_that_the_page_was_opened_under_is_known():
    assert refused(Gate("arm.lab"), host="arm.lab:8080") == ""
    assert refused(Gate("arm.lab"), host="other.lab:8080") != ""


@pytest.mark.parametrize(
    "origin",
    ["http://evil.example", "null", "", "http://127.0.0.1:3000", "http://localhost:8080", "ftp://127.0.0.1:8080",
     "http://[", "file://", "http://127.0.0.1:8080.evil.example"],
)  # fmt: skip
def test_other_sites_are_refused(origin):
    assert refused(Gate("127.0.0.1"), origin=origin) == "Another site may not use this page."


@pytest.mark.parametrize(
    ("hosts", "origins"), [([], []), ([HERE, HERE], []), ([HERE], [f"http://{HERE}"] * 2)]
)
def test_headers_that_are_missing_or_double_are_refused(hosts, origins):
    gate = Gate("127.0.0.1")
    assert gate.refusal(f"/{gate.token}", hosts, origins) != ""
