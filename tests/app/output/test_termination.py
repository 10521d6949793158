"""Ctrl-C and SIGTERM end work, whatever a library makes of them on the way."""

import signal
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
