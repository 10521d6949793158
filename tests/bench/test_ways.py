"""Ways of calling: what is timed, what is not, and that a paced step comes out of sleep."""

import pytest
from bench import ways
from bench.ways import PERIOD, WAYS, Metronome, took


class Clock:
    """A clock that moves when it is told to, and notes how long it was asked to sleep."""

    def __init__(self) -> None:
        self.time = 0.0
        self.slept: list[float] = []

    def now(self) -> float:
        return self.time

    def wait(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.time += seconds


@pytest.mark.parametrize("way", WAYS)
def test_only_the_step_is_timed_and_the_arm_is_measured_after_each(
    way: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[int | str] = []
    time = 0
    monkeypatch.setattr(ways, "perf_counter_ns", lambda: time)

    def step(k: int) -> None:
        nonlocal time
        time += k
        done.append(k)

    def between() -> None:
        nonlocal time
        time += 1000
        done.append("measured")

    assert took(way, step, between, (7, 8)) == [7, 8]
    assert done == [7, "measured", 8, "measured"]


def test_paced_steps_are_a_period_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    monkeypatch.setattr(ways, "Metronome", lambda period: Metronome(period, clock.now, clock.wait))
    times: list[float] = []
    took("paced", lambda k: times.append(clock.time), lambda: None, range(6))
    assert times == pytest.approx([PERIOD * k for k in range(1, 7)])
