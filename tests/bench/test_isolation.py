"""Whatever work does in a process apart, the one who asked gets a word and goes on."""

import os
import signal
import time
from typing import Any

import numpy as np
from bench.isolation import Apart

from ftqp import InputError


def double(value: float) -> float:
    return 2.0 * value


def refuse() -> None:
    raise InputError("this is not for me")


def leave(code: int) -> None:
    os._exit(code)


def crash() -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def stop() -> None:
    raise SystemExit(3)


def hang() -> None:
    time.sleep(600.0)


def unsendable() -> Any:
    return lambda: None


class Poison:
    """Pickled well, and raises where it is read."""

    def __reduce__(self) -> Any:
        return (int, ("poison",))


def poison() -> Any:
    return Poison()


def test_a_process_apart_answers_and_survives_whatever_work_does() -> None:
    with Apart(60.0) as apart:
        assert apart.ask(double, 21.0).answer == 42.0
        for work, arguments, words in (
            (refuse, (), "this is not for me"),
            (stop, (), "SystemExit: 3"),
            (unsendable, (), "returned what cannot be sent"),
            (poison, (), "sent what cannot be read"),
            (leave, (7,), "exit code 7"),
            (crash, (), "SIGSEGV"),
        ):
            ended = apart.ask(work, *arguments)
            assert ended.answer is None and words in ended.reason, work
        np.testing.assert_array_equal(apart.ask(np.ones, 3).answer, np.ones(3))


def test_work_that_hangs_is_ended_within_its_time() -> None:
    before = time.monotonic()
    with Apart(1.0) as apart:
        ended = apart.ask(hang)
    assert ended.reason == "gave no answer within 1 s and was ended"
    assert time.monotonic() - before < 60.0
