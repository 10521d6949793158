"""Ctrl-C and SIGTERM end work, whatever a library makes of them on the way."""

import signal
import subprocess
import sys
import threading

import pytest

from ftqp.app.output.termination import Termination, no_interrupt_lost


@pytest.fixture(autouse=True)
def listening():
    """A process of pytest-xdist ignores Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("one", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_that_the_body_swallows_is_raised_at_its_end(one):
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), Termination(), no_interrupt_lost():
        try:
            signal.raise_signal(one)
        except KeyboardInterrupt:
            swallowed = True
    assert swallowed
    assert signal.getsignal(signal.SIGINT) is before


def test_interrupt_that_became_another_error_is_an_interrupt_again():
    with pytest.raises(KeyboardInterrupt) as raised, no_interrupt_lost():
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise TypeError("could not be coerced") from None
    assert isinstance(raised.value.__cause__, TypeError)


def test_errors_without_an_interrupt_are_left_as_they_are():
    with pytest.raises(TypeError, match="mine"), no_interrupt_lost():
        raise TypeError("mine")


def test_threads_that_hear_no_signals_are_left_alone():
    ended = []

    def body():
        with no_interrupt_lost():
            ended.append(True)

    thread = threading.Thread(target=body)
    thread.start()
    thread.join()
    assert ended


def _ended(code: str) -> tuple[int, str]:
    """A process that runs ``code`` and hears Ctrl-C: how it ended, and what it said."""
    listen = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    done = subprocess.run([sys.executable, "-c", listen + code], capture_output=True, text=True, check=False)
    return done.returncode, done.stderr


def test_interrupt_while_the_command_is_loaded_ends_it_as_later() -> None:
    code = """
import sys
class Finder:
    def find_spec(self, name, path, target=None):
        if name == "typer":
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Finder())
from ftqp.__main__ import main
main()
"""
    assert _ended(code) == (130, "interrupted\n")


def test_interrupt_is_an_exception_only_while_a_command_is_at_work() -> None:
    code = """
from ftqp.app.output.termination import Termination, end_on_interrupt
end_on_interrupt()
with Termination():
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        print("heard", file=__import__("sys").stderr, flush=True)
signal.raise_signal(signal.SIGINT)
"""
    assert _ended(code) == (130, "heard\ninterrupted\n")


def test_interrupt_that_is_ignored_stays_so() -> None:
    code = """
signal.signal(signal.SIGINT, signal.SIG_IGN)
from ftqp.app.output.termination import Termination, end_on_interrupt
end_on_interrupt()
with Termination():
    signal.raise_signal(signal.SIGINT)
signal.raise_signal(signal.SIGINT)
"""
    assert _ended(code) == (0, "")
