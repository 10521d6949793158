"""The front page's episode in C: the library names the joint and finishes, bit by bit as Python does."""

import pytest
from tests.app.deployment.in_c import Finding, Library, numbers

import ftqp
from ftqp.app.deployment.headers import arm_file
from ftqp.app.scenario.setup import load

pytest.importorskip("mujoco", reason="needs mujoco, which the extra 'sim' brings")


class Beside:
    """A planner in Python whose steps are made by a library, too."""

    def __init__(self, arm):
        self.arm, self.news, self.steps = arm, [], 0

    def step(self, q, target, step):
        assert self.arm.step(q, target.packed) == step.code, self.steps
        self.arm.has_sent(step, self.steps)
        assert self.arm.call("brakes", None) == step.brakes.sum()
        if self.arm.call("watch", None) == 2:
            self.news.append(self.steps)
        self.steps += 1


@pytest.mark.slow
def test_the_episode_of_the_front_page_is_that_of_python_bit_by_bit(built, monkeypatch):
    setup = load("panda-unannounced")
    n = setup.robot.nv
    arm = Library(built, arm_file(setup.planner.deployable(), n))
    beside = Beside(arm)
    in_python, reset = ftqp.Planner.step, ftqp.Planner.reset

    def both_begin(planner, q, v=None):
        reset(planner, q, v)
        assert arm.call("reset", numbers(q), None if v is None else numbers(v)) == 0

    def both_step(planner, q, v, target, tau=None):
        step = in_python(planner, q, v, target)
        beside.step(q, target, step)
        return step

    assert arm.open() == 0
    monkeypatch.setattr(ftqp.Planner, "reset", both_begin)
    monkeypatch.setattr(ftqp.Planner, "step", both_step)
    result = setup.simulation(log="memory").run()
    assert result.completed and beside.steps == result.steps
    (finding,) = setup.planner.findings
    out = (Finding * n)()
    assert arm.call("detect", out, n) == 1 == len(beside.news)
    assert (out[0].joint, out[0].onset, out[0].detected_at) == (2, finding.onset, finding.detected_at)
    assert finding.kinds == frozenset({"locked"}) and out[0].kinds == 1
    assert arm.call("tau")[2] == 0.0, "the joint is counted on as locked"
