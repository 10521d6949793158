"""What goes with what: every combination works, or is refused with the table's own sentence."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest

import ftqp
from ftqp.control.task.compatibility import CHOICES, RULES, table
from ftqp.core.errors import InputError

PANDA = ftqp.robots.load("panda")
HOME = PANDA.pose(PANDA.neutral)
DT = 5e-3
PAGE = Path(__file__).parents[2] / "docs" / "compatibility.md"
VALUES = {
    "damping": {"none": None, "directional": ftqp.DirectionalDamping()},
    "scheme": {"criterion": "mvn", "closed form": "pseudoinverse"},
    "backend": {"active_set": "active_set", "dtrnn": "dtrnn", "external": "daqp"},
}
"""What stands for a value of the table."""


def broken(chosen):
    """The sentences of all rules that a combination breaks."""
    given = {name: VALUES[name][chosen[name]] for name in ("scheme", "backend")}
    return [
        rule.sentence(chosen[rule.excludes[0]], given)
        for rule in RULES
        if chosen[rule.of[0]] == rule.of[1] and chosen[rule.excludes[0]] in rule.excludes[1]
    ]


def steps(level, mode, priority, damping, scheme, backend, leader):
    """Three steps of a planner of these choices, copied."""
    task = ftqp.Task(mode=mode, priority=priority, damping=VALUES["damping"][damping])
    planner = ftqp.Planner(
        PANDA,
        DT,
        level=level,
        task=task,
        scheme=VALUES["scheme"][scheme],
        backend=VALUES["backend"][backend],
    )
    target = ftqp.Target(pose=HOME, twist=[0.02, 0.0, 0.01, 0.0, 0.0, 0.0])
    if leader == "path":
        follower = ftqp.PathFollower(planner, ftqp.paths.Line(HOME, (0.1, 0.0, 0.0), duration=2.0))
        reset, step = follower.reset, follower.step
    elif leader == "base":
        inertial = ftqp.InertialTask(planner)
        reset, step = inertial.reset, lambda q, v: inertial.step(q, v, target, tip=PANDA.pose(q))
    else:
        reset, step = planner.reset, lambda q, v: planner.step(q, v, target)
    q, v, done = PANDA.neutral.copy(), np.zeros(7), []
    reset(q)
    for _ in range(3):
        done.append(step(q, v).copy())
        q, v = done[-1].q, done[-1].v
    return done


def taking_long(chosen):
    """Whether code is compiled for it that no other test needs: the network for paths and for bases."""
    of = dict(zip(CHOICES, chosen, strict=True))
    return of["backend"] == "dtrnn" and of["leader"] in ("path", "base") and not broken(of)


@pytest.mark.parametrize(
    "chosen",
    [
        pytest.param(chosen, id="-".join(chosen), marks=[pytest.mark.slow] if taking_long(chosen) else [])
        for chosen in product(*CHOICES.values())
    ],
)
def test_every_combination_works_or_is_refused_with_the_sentence_of_the_table(chosen):
    sentences = broken(dict(zip(CHOICES, chosen, strict=True)))
    if sentences:
        with pytest.raises(InputError) as refused:
            steps(*chosen)
        assert str(refused.value) in sentences
        return
    for step in steps(*chosen):
        assert step.status in (ftqp.StepStatus.OK, ftqp.StepStatus.SCALED, ftqp.StepStatus.RELAXED)
        assert all(np.isfinite(x).all() for x in (step.q, step.v, step.a, step.tau))


def test_every_rule_speaks_of_choices_that_there_are_and_excludes_no_default_pair():
    defaults = {choice: values[0] for choice, values in CHOICES.items()}
    assert not broken(defaults)
    for rule in RULES:
        (choice, value), (other, values) = rule.of, rule.excludes
        assert value in CHOICES[choice] and set(values) < set(CHOICES[other]) and choice != other


def test_the_page_shows_the_table():
    assert table() in PAGE.read_text(encoding="utf-8")
