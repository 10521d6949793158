"""Who may talk to the server of a page: whoever knows its address, from the page itself."""

import hmac
import socket
from collections.abc import Sequence
from ipaddress import ip_address
from secrets import token_urlsafe
from typing import final
from urllib.parse import unquote, urlsplit

SECRET = 16
"""Random bytes of an address; nobody guesses them."""


@final
class Gate:
    """Looks at every request before it is answered, those for pages and those for connections.

    A page of another site that is open in the same browser must not reach this one: neither by asking for a
    connection (its ``Origin`` differs), nor by a name that it lets point to this machine (``Host`` is then
    that name). Another user of the machine does not know the token that stands in the address.

    Attributes:
        token: The first part of the path of every address that is answered.
    """

    def __init__(self, host: str) -> None:
        self.token = token_urlsafe(SECRET)
        self._host = host.lower()
        self._loopback = is_loopback(host)

    def refusal(self, path: str, hosts: Sequence[str], origins: Sequence[str]) -> str:
        """Why a request is not answered, in a sentence; empty where it is.

        ``hosts`` and ``origins`` are the values of its headers ``Host`` and ``Origin``; a browser sends the
        latter with every connection.
        """
        if len(hosts) != 1 or not self._knows(hosts[0]):
            return "This page is not served under that name; open the address that ftqp view has printed."
        if origins and (len(origins) != 1 or not _is_of(origins[0], hosts[0])):
            return "Another site may not use this page."
        given = _first(path)[0].encode("utf-8", "replace")
        if not hmac.compare_digest(given, self.token.encode()):
            return "The address is not complete; open the one that ftqp view has printed."
        return ""

    def behind(self, path: str) -> str:
        """The path of a request without the token."""
        return "/" + _first(path)[1]

    def _knows(self, host: str) -> bool:
        """Whether the header ``Host`` is a name of this server; no name that others give away is."""
        try:
            name = (urlsplit(f"//{host}").hostname or "").rstrip(".")
        except ValueError:
            return False
        if name in ("localhost", self._host):
            return True
        try:
            number = ip_address(name)
        except ValueError:
            own = socket.gethostname().lower()
            return not self._loopback and name in (own, f"{own}.local")
        return number.is_loopback or not self._loopback


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches the address."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _first(path: str) -> tuple[str, str]:
    """The first part of a path without its query, and all that follows it."""
    token, _, rest = unquote(path.partition("?")[0]).lstrip("/").partition("/")
    return token, rest


def _is_of(origin: str, host: str) -> bool:
    """Whether an origin is that of a page which was served under this name and port."""
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    return parts.scheme in ("http", "https") and parts.netloc.lower() == host.lower()
