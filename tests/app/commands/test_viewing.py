"""``ftqp view``: one sentence for bad input, an address for a page that answers, whole files after all."""

import json
import os
import signal
import socket
import subprocess
import sys
from time import sleep
from urllib.request import urlopen

import pytest
from tests.app.conftest import invoke

from ftqp.app.commands.viewing import is_loopback


def asked(*arguments):
    return invoke("view", *arguments, "--no-browser")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.npy").write_text("this is no database")
    (tmp_path / "there.html").write_text("x")
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "verdicts.json").write_text("[" * 100_000)
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "neither a file nor a bundled scenario"),
        (["{}/empty"], "holds neither a run (log.npy) nor a coverage report (verdicts.json)"),
        (["{}/text.npy"], "is not a log of ftqp"),
        (["{}/bad"], "is not the list of verdicts of a coverage report"),
        (["{}/bad", "--scheme", "mke"], "--scheme is for scenarios"),
        (["--speed", "0"], "speed is 0, expected a factor above 0 and at most 100"),
        (["--speed", "nan"], "speed is nan"),
        (["--meshes", "pretty"], "it has collision, visual, none"),
        (["--record", "{}/there.html"], "exists, and nothing is overwritten"),
        (["--backend", "abacus"], "abacus"),
        (["iiwa-moving-base-locked"], "has a moving base"),
        (["--port", "99999"], "99999"),
        (["a" * 300 + ".npy"], "does not exist"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(folder, arguments, said):
    result = asked(*(argument.replace("{}", str(folder)) for argument in arguments))
    text = " ".join(result.output.split())
    assert result.exit_code == 2, text
    assert said in text and "Traceback" not in text


def viewed(port, file, seconds):
    """A page that is shown for some seconds, then interrupted: its exit code and both of its streams."""
    command = [sys.executable, "-m", "ftqp", "view", "planar6-square", "--json", "--no-browser"]
    process = subprocess.Popen(
        [*command, "--port", str(port), "--record", str(file)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        told = json.loads(process.stdout.readline())
        assert told["port"] > port and told["kind"] == "live" and told["title"] == "planar6-square"
        assert told["url"] == f"http://127.0.0.1:{told['port']}"
        with urlopen(told["url"], timeout=60.0) as answer:
            assert b"<html" in answer.read(2000).lower()
        sleep(seconds)
        process.send_signal(signal.SIGINT)
        rest, errors = process.communicate(timeout=120.0)
    finally:
        process.kill()
    return process.returncode, rest, errors.replace("\n", "")


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for another process")
def test_page_answers_at_the_next_free_port_and_ctrl_c_leaves_a_recording(tmp_path):
    file = tmp_path / "shown.html"
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        for seconds in (0.5, 5.0, 30.0):  # until the arm moves, on a busy machine
            code, rest, errors = viewed(taken.getsockname()[1], file, seconds)
            assert (code, rest) == (130, ""), errors
            if "nothing moved" not in errors:
                break
    assert f"recording: {file}" in errors
    assert file.stat().st_size > 100_000


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "0.0.0.0", "192.168.0.7", "pc"])
def test_only_this_machine_is_no_reason_to_warn(host):
    assert is_loopback(host) is (host in ("127.0.0.1", "localhost", "::1"))
