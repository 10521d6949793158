"""A virtual environment of its own for each peer, made once and used again."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

INSTALL_SECONDS = 900
"""Longest an installation may take before the peer is left out [s]."""

DEFAULT = Path.home() / ".cache" / "ftqp-bench"
"""Where the environments are, unless told otherwise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Peer:
    """A program to compare with.

    Attributes:
        name: What it is called, and its environment's folder.
        module: The worker that runs it.
        packages: What pip installs, the peer first.
    """

    name: str
    module: str
    packages: tuple[str, ...]


PEERS = (
    Peer(name="placo", module="steps.peer_placo", packages=("placo==0.10.*",)),
    Peer(name="pink", module="steps.peer_pink", packages=("pin-pink>=4", "daqp", "proxsuite", "quadprog")),
    Peer(name="mink", module="steps.peer_mink", packages=("mink>=1", "daqp", "quadprog")),
)


class NotInstalled(Exception):
    """A peer could not be installed; the message says why."""


def python_of(peer: Peer, folder: Path) -> Path:
    """The Python of the peer's environment, which is made when it is not there yet.

    Raises:
        NotInstalled: The environment or a package could not be made.
    """
    home = folder / peer.name
    python = home / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    stamp = home / "installed.json"
    wanted = json.dumps({"packages": peer.packages, "python": sys.version.split()[0]})
    if stamp.is_file() and stamp.read_text() == wanted and python.exists():
        return python
    folder.mkdir(parents=True, exist_ok=True)
    _run([sys.executable, "-m", "venv", "--clear", str(home)], peer)
    pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    _run([*pip, *peer.packages], peer)
    stamp.write_text(wanted)
    return python


def _run(command: list[str], peer: Peer) -> None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=INSTALL_SECONDS, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NotInstalled(f"{peer.name} could not be installed: {error}") from error
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if "ERROR" in line] or done.stderr.splitlines()[-1:]
        why = "; ".join(said[-2:]) or f"exit status {done.returncode}"
        raise NotInstalled(f"{peer.name} could not be installed: {why}")
