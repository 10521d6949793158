"""An episode from inside: a planner, some hundred ticks, and something done to it before most of them."""

import logging
import time
import warnings
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

import ftqp
from fuzz.inside import company, interruptions, planners, scribbles
from fuzz.inside.watch import Watch
from fuzz.inside.world import World
from fuzz.world import last_line

TICKS = 1000
GENERATORS = {
    "nothing": 0.40,
    "scribbles into the record": 0.33,
    "scribbles into what is handed out": 0.20,
    "calls": 0.02,
    "calls that are interrupted": 0.012,
    "steps that are interrupted": 0.02,
    "a thread inside a step": 0.004,
    "a thread beside a call": 0.003,
    "two threads at once": 0.0006,
    "objects that raise": 0.01,
    "objects that call": 0.0014,
}
"""What is done before a step, and how often."""
CALMER = 0.3
"""Share of the episodes in which the record is left alone, so that calls meet an arm that works."""
IDLE = ("STOPPED", "STOPPING", "INVALID_INPUT", "FALLBACK")
STAYS = 15
"""An arm that has stopped for so many ticks, or has no usable command, begins anew with a good record."""


@final
@dataclass(slots=True, kw_only=True)
class Outcome:
    """What came of an episode.

    Attributes:
        number: Its number.
        sentence: What it was about.
        steps: How many steps were made and judged.
        beyond: Commands beyond limits.
        infinite: Commands that are not finite.
        disagreements: Of belief and kernel, or of what was promised of a call.
        shut: How often the gate was shut.
        seconds: How much processor time it took [s].
        done: How often each thing was done.
        statuses: How many steps claimed what.
        places: Lines of ftqp at which something was raised or done.
        wrong: What was wrong, in words.
    """

    number: int
    sentence: str = ""
    steps: int = 0
    beyond: int = 0
    infinite: int = 0
    disagreements: int = 0
    shut: int = 0
    seconds: float = 0.0
    done: dict[str, int] = field(default_factory=dict)
    statuses: dict[str, int] = field(default_factory=dict)
    places: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)


def run(
    seed: int,
    number: int,
    *,
    ticks: int = TICKS,
    arms: tuple[str, ...] = planners.ROBOTS,
    generators: dict[str, float] | None = None,
) -> Outcome:
    """Draw, run and judge an episode.

    Args:
        seed: Of the run.
        number: Of the episode; timers and threads aside, the same numbers give the same episode.
        ticks: How long it is.
        arms: The robots to draw from.
        generators: What is done before a step, and how often; None is ``GENERATORS``.
    """
    logging.getLogger("ftqp").setLevel(logging.CRITICAL)
    with warnings.catch_warnings(), np.errstate(all="ignore"), interruptions.Signals() as signals:
        warnings.simplefilter("ignore")
        rng = np.random.default_rng([seed, number])
        return _Run(number, rng, ticks, planners.drawn(rng, arms), signals, generators).run()


class _Run:
    """One episode as it runs."""

    def __init__(
        self, number: int, rng: Any, ticks: int, made: Any, signals: Any, generators: dict[str, float] | None
    ) -> None:
        robot, planner = made.robot, made.planner
        self.outcome, self.signals, self.ticks = (
            Outcome(number=number, sentence=made.sentence),
            signals,
            ticks,
        )
        shares = dict(GENERATORS if generators is None else generators)
        if generators is None and rng.random() < CALMER:
            shares["nothing"] += shares.pop("scribbles into the record")
        odds = np.array(list(shares.values()))
        self.what = [list(shares)[k] for k in rng.choice(len(shares), ticks, p=odds / odds.sum()).tolist()]
        T = robot.pose(robot.neutral)
        watch = Watch(planner, made.drive, made.viable)
        self.world = World(made=made, rng=rng, watch=watch, target=ftqp.Target(pose=T), base=T,
                           arm=(robot.neutral.copy(), np.zeros(robot.nv)))  # fmt: skip
        self.fields = scribbles.fields(planner._session)
        self.stopped = 0

    def run(self) -> Outcome:
        """Everything."""
        world, outcome, watch = self.world, self.outcome, self.world.watch
        began = time.process_time()
        world.planner.reset(world.made.robot.neutral)
        self.good = [x.copy() for _, x in self.fields]
        for k in range(self.ticks):
            try:
                if k % 8 == 0:
                    world.move_target(k)
                world.take(self.tick(self.what[k] if k > 3 else "nothing"))
                self.go_on()
            except Exception as error:  # whatever it is, it was not promised
                watch.say_disagreement(last_line(error))
                break
            if len(watch.wrong) > 5:
                break
        outcome.seconds = time.process_time() - began
        outcome.steps, outcome.done, outcome.places = world.steps, world.done, sorted(world.places)
        outcome.beyond, outcome.infinite = watch.beyond, watch.infinite
        outcome.disagreements, outcome.wrong = watch.disagreements, watch.wrong
        outcome.shut = int(world.planner._session.K.gate.shut)
        return outcome

    def tick(self, what: str) -> Any:
        """Do something, and make the step after it."""
        world = self.world
        world.done[what] = world.done.get(what, 0) + 1
        match what:
            case "scribbles into the record":
                scribbles.into_record(world, self.fields)
            case "scribbles into what is handed out":
                scribbles.into_what_is_handed_out(world)
            case "calls":
                told = world.drawn_call()
                told.call()
                told.happened(world)
            case "calls that are interrupted":
                interruptions.interrupted(world, self.signals, world.drawn_call())
            case "steps that are interrupted":
                return interruptions.interrupted_step(world, self.signals)
            case "a thread inside a step":
                return company.thread_inside(world)
            case "a thread beside a call":
                company.thread_beside_a_call(world, world.drawn_call())
            case "two threads at once":
                return company.threads_at_once(world)
            case "objects that raise":
                return company.objects(world)
            case "objects that call":
                return company.objects_that_call(world)
        return world.make()

    def go_on(self) -> None:
        """Count what was claimed; an arm that stays where it is shows nothing more, and begins anew."""
        name = self.world.step.status.name
        statuses = self.outcome.statuses
        statuses[name] = statuses.get(name, 0) + 1
        self.stopped = self.stopped + 1 if name in IDLE else 0
        if self.stopped > STAYS:
            world, self.stopped = self.world, 0
            for (_, x), good in zip(self.fields, self.good, strict=True):
                x[...] = good
            q, v = world.drawn_start()
            world.planner.reset(q, v)
            world.begin(q, v)
