"""A goal that the straight way does not reach any more after a lock, but another posture does."""

from pathlib import Path
from typing import Final

import numpy as np

from ftqp.app.demo.story_part import SCENARIO, StoryPart, ridden
from ftqp.app.output import words
from ftqp.app.output.console import say
from ftqp.app.scenario.setup import Setup, load
from ftqp.control.following.goto import GoTo
from ftqp.core.checks import FloatArray
from ftqp.core.pose import rotation_vector

START: Final = (-1.357, 1.367, -0.62, -1.33, 1.568, 1.828, -1.273)
"""Where the joints of a Panda begin [rad]."""
POSITION, ORIENTATION = (0.6, -0.068, 0.835), (0.197, 0.7611, 0.1018, 0.6096)
"""The goal of the tip [m], and its quaternion x, y, z, w. It is the first of the goals of
`benchmarks/peers_in_physics.py`, drawn at random, that six joints reach, but not straight on."""
JOINT, BRAKES_AT, DRIVEN, RESTS, PERIOD = "panda_joint1", 0.2, 9.7, 2.3, 0.002
"""Which joint's brake closes, and when; how long the straight way takes, and how long both may rest after it;
the sampling period [s]."""


def goal_story(folder: Path) -> StoryPart:
    """ftqp, not told, on its way to the goal, and a rival that is told and goes straight on."""
    setup = _setup()
    say(f"and a goal across the workspace; the brake of {JOINT} closes soon after the start ...")
    leads = _led(setup)
    path, planner = setup.path, setup.planner
    rival = ridden(setup, True, duration=DRIVEN + RESTS)
    goal = path.sample(np.array([path.duration])).pose[0]
    own, straight = (_off(setup, q, goal) for q in (leads, rival.q[-1]))
    found = ", ".join(planner.faults) or "nothing"
    lines = [
        f"A goal across the workspace; the brake of {JOINT} closes {BRAKES_AT:g} s after the start. Six "
        "joints reach the goal, but not straight on:",
        f"ftqp, not told, finds out ({found}), looks for another posture, goes there, and ends {_said(own)};",
        f"resolved rates, told at once, go straight on and end {_said(straight)}.",
        "A planner of motions that is told can find such a way, too. Eight such goals, with pink and placo:",
        "benchmarks/results/peers_in_physics.md",
    ]
    return StoryPart(lines=lines, facts={"goal": {"ftqp, not told": own, "resolved rates, told": straight}})


def _setup() -> Setup:
    """The scenario of the demo with another start, another brake and the goal in place of the circle."""
    goal = f'kind="point_to_point", position={list(POSITION)}, orientation={list(ORIENTATION)}'
    return load(
        SCENARIO,
        [
            f"planner.dt={PERIOD}", f"start.q={list(START)}", f"faults.0.joint={JOINT}",
            f"faults.0.at={BRAKES_AT}", f"path={{{goal}, duration={DRIVEN}}}",
        ],
    )  # fmt: skip


def _led(setup: Setup) -> FloatArray:
    """Where the joints end that ftqp leads to the goal, (nv,) [rad]."""
    planner, plant, sensors = setup.planner, setup.plant, setup.sensors
    (event,) = setup.schedule
    planner.reset(setup.q)
    plant.reset(setup.q, np.zeros(setup.robot.nv))
    if sensors is not None:
        sensors.reset()
    goto = GoTo(planner, pose=setup.path.sample(np.array([setup.path.duration])).pose[0])
    breaks = round(event.at / PERIOD)
    for k in range(round((DRIVEN + RESTS) / PERIOD)):
        if k == breaks:
            plant.fail(event.fault)
        q = plant.q
        if sensors is not None:
            sensors.measure(plant.q, plant.v)
            q = sensors.q
        plant.advance(goto.step(q, None))
    return plant.q.copy()


def _said(end: dict[str, float]) -> str:
    return f"{words.length(end['off'])} and {end['turned']:.1f} degrees off"


def _off(setup: Setup, q: FloatArray, goal: FloatArray) -> dict[str, float]:
    """How far the tip is from the goal [m, degrees]."""
    T = setup.robot.pose(q)
    turned = np.linalg.norm(rotation_vector(goal[:3, :3] @ T[:3, :3].T))
    return {"off": float(np.linalg.norm(T[:3, 3] - goal[:3, 3])), "turned": float(np.degrees(turned))}
