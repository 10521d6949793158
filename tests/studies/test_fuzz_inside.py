"""Planners that are disturbed from inside keep their promises, and who watches sees one that is broken."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fuzz.inside import episode
from fuzz.inside.planners import Made
from fuzz.inside.watch import Watch
from fuzz.inside.world import World
from tests.scripts import told

import ftqp

# Timers raise at any line, also in callbacks of the garbage collection, where Python says so and goes on.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")

SEED = 14
CALM = {name: share for name, share in episode.GENERATORS.items() if name != "scribbles into the record"}
BUSY = {name: 1.0 for name in CALM}


@pytest.mark.parametrize("number", [0, 3])
def test_sample_of_disturbed_planners_keeps_every_promise(number: int) -> None:
    outcome = episode.run(SEED, number, ticks=200)
    assert outcome.wrong == [], outcome.sentence
    assert outcome.steps >= 200 and len(outcome.done) > 4


@pytest.mark.parametrize("number", range(2))
def test_calls_threads_signals_and_objects_in_any_order_change_nothing_in_part(number: int) -> None:
    outcome = episode.run(SEED, number, ticks=80, arms=("panda", "planar(4)"), generators=BUSY)
    assert outcome.wrong == [], outcome.sentence
    assert set(BUSY) <= set(outcome.done) and len(outcome.places) > 10


@pytest.mark.slow
@pytest.mark.parametrize("number", range(100))
def test_disturbed_planners_keep_every_promise(number: int) -> None:
    outcome = episode.run(SEED, number, generators=CALM)
    assert outcome.wrong == [], outcome.sentence


@pytest.fixture
def world():
    """A Panda with torques that has made some steps, one of its joints locked, and nothing wrong."""
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, 1e-3, drive="torque")
    made = Made(robot=robot, planner=planner, sentence="", drive="torque", viable=True, watched=False)
    q, T = robot.neutral, robot.pose(robot.neutral)
    world = World(
        made=made,
        rng=np.random.default_rng(1),
        watch=Watch(planner, "torque", True),
        target=ftqp.Target(pose=T),
        base=T,
        arm=(q.copy(), np.zeros(7)),
    )
    planner.reset(q)
    world.told = {"panda_joint2": ftqp.Locked(1)}
    planner.report(ftqp.Locked(1))
    for k in range(30):
        world.move_target(k)
        world.take(world.make())
    assert world.watch.wrong == []
    return world


def doctored(step, **changed):
    """A step that says something else."""
    parts = {name: getattr(step, name).copy() for name in ("q", "v", "a", "tau")}
    reference = {name: getattr(step.reference, name).copy() for name in ("q", "v")}
    for name, (joint, value) in changed.items():
        owner = reference if name.startswith("reference_") else parts
        owner[name.removeprefix("reference_")][joint] = value
    return SimpleNamespace(**parts, reference=SimpleNamespace(**reference), status=step.status)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({}, None),
        ({"q": (3, np.nan)}, "q is not finite"),
        ({"v": (3, np.inf)}, "v is not finite"),
        ({"a": (3, -np.inf)}, "a is not finite"),
        ({"tau": (3, np.nan)}, "tau is not finite"),
        ({"reference_v": (3, np.nan)}, "reference.v is not finite"),
        ({"q": (3, 0.1)}, "joint 3: the position that is sent is beyond the range by 0.17"),
        ({"q": (3, -2.3)}, "joint 3: the position that is sent jumps"),
        ({"q": (1, -0.7)}, "joint 1: the position that is sent jumps"),
        ({"reference_v": (3, 1.0)}, "joint 3: the acceleration is beyond its limit"),
        ({"reference_v": (3, 2.2)}, "joint 3: the speed is beyond its limit by 0.02"),
        ({"reference_q": (3, -2.3)}, "joint 3: the reference jumps"),
        ({"tau": (3, 88.0)}, "joint 3: what is sent is beyond the drive's limit by 1"),
        ({"v": (1, 1e-12)}, "a locked joint is told to move"),
    ],
)
def test_watch_sees_a_command_that_is_wrong(world, changed, said) -> None:
    made = world.make()
    good = world.watch.look(doctored(made, **changed), world.arm[1])
    assert good == (said is None)
    assert said is None or said in world.watch.wrong[0]


@pytest.mark.parametrize("name", ["q_min", "q_max", "v_max", "a_max", "tau_max"])
def test_watch_sees_a_limit_that_the_kernel_does_not_have_as_believed(world, name) -> None:
    step = world.make()
    world.planner._session.K.limits[name][2] *= 1.0 + 1e-15
    assert not world.watch.look(step, world.arm[1]) and f"limits ['{name}']" in world.watch.wrong[0]


@pytest.mark.parametrize(("joint", "code"), [(1, 0), (2, 2), (2, 3), (1, 3)])
def test_watch_sees_a_joint_that_has_failed_for_one_of_planner_and_kernel_only(world, joint, code) -> None:
    step = world.make()
    world.planner._session.K.faults.code[joint] = code
    assert not world.watch.look(step, world.arm[1]) and "codes" in world.watch.wrong[0]


def test_watch_sees_a_planner_that_believes_something_else_than_it_was_told(world) -> None:
    world.planner.report(ftqp.Locked(4))
    world.take(world.make())
    assert "the planner believes" in world.watch.wrong[0]


def test_an_array_that_was_handed_out_and_can_be_written_is_seen(world, monkeypatch) -> None:
    from fuzz.inside import scribbles

    class Forgetful:
        """What claims to be read-only and is not."""

        dtype, size, flags = np.dtype(float), 1, SimpleNamespace(writeable=False)

        def __init__(self):
            self.x = np.zeros(3)

        def tobytes(self):
            return self.x.tobytes()

        def resize(self, shape):
            raise ValueError

    monkeypatch.setattr(scribbles, "WAYS", (lambda x, rng: x.x.fill(1.0),))
    scribbles._into_array(world, "robot", "robot.q", Forgetful())
    assert any("was written" in sentence for sentence in world.watch.wrong)


@pytest.mark.slow
def test_script_counts_reports_and_replays(tmp_path: Path) -> None:
    given = ("--episodes=2", "--ticks=60", "--json", "--out", tmp_path)
    total = json.loads(told("studies/fuzz_inside.py", *given))["total"]
    assert total["episodes"] == 2 and total["steps"] >= 120 and total["failing"] == total["crashed"] == 0
    assert "python studies/fuzz_inside.py" in (tmp_path / "fuzz_inside.md").read_text(encoding="utf-8")
    told("studies/fuzz_inside.py", "--replay=1", "--ticks=60")
