"""A kind of task and a kind of constraint that only one file and one line know, used everywhere, as JSON.

Run as a process of its own: the kinds go into their tables before anything else of ftqp reads those.
"""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ftqp.control.task import keep
from ftqp.control.task.own_task import OwnConstraint, OwnTask
from ftqp.core.setting import REQUIRED, setting


@dataclass(frozen=True, slots=True, kw_only=True)
class Distance(OwnTask):
    """Two frames are so far from each other."""

    frame: str = setting(REQUIRED, "a frame of the model")
    to: str = setting(REQUIRED, "another one")
    distance: float = setting(0.5, "how far they are to be from each other, > 0", unit="m", above=0.0)
    unit: ClassVar[str] = "m"
    about: ClassVar[str] = "how far the distance of two frames is from what is asked"

    @property
    def count(self) -> int:
        return 1

    def _between(self, robot: Any, q: Any) -> Any:
        return robot.pose(q, self.frame)[:3, 3] - robot.pose(q, self.to)[:3, 3]

    def filling(self, robot: Any) -> Any:
        def fill(state: Any, J: Any, b: Any) -> None:
            kp, kv = self.gains(state.level)
            way = self._between(robot, state.q)
            d = np.linalg.norm(way)
            rows = robot.jacobian(state.q, self.frame)[:3] - robot.jacobian(state.q, self.to)[:3]
            J[0] = way @ rows / d
            b[0] = kp * (self.distance - d) - kv * (J[0] @ state.v)

        return fill

    def error(self, robot: Any, q: Any) -> float:
        return abs(float(np.linalg.norm(self._between(robot, q))) - self.distance)

    def place(self, robot: Any, q: Any) -> Any:
        return robot.pose(q, self.frame)[:3, 3]


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedOf(OwnConstraint):
    """A joint is no faster than this."""

    joint: str = setting(REQUIRED, "the joint")
    speed: float = setting(0.1, "its largest speed, > 0", unit="rad/s", above=0.0)
    unit: ClassVar[str] = "rad"
    about: ClassVar[str] = "how far the joint is from zero"

    @property
    def count(self) -> int:
        return 1

    def filling(self, robot: Any) -> Any:
        i = robot.joint(self.joint)

        def fill(state: Any, C: Any, l: Any, u: Any) -> None:
            C[0, i] = 1.0
            ticks = 2 * state.dt
            l[0], u[0] = (-self.speed - state.v[i]) / ticks, (self.speed - state.v[i]) / ticks

        return fill

    def distance(self, robot: Any, q: Any) -> float:
        return float(abs(q[robot.joint(self.joint)]))


SCENARIO = """
[robot]
name = "panda"
[planner]
dt = 0.001
task = { rows = "position" }
[path]
kind = "circle"
radius = 0.1
duration = 2.0
[[faults]]
kind = "locked"
joint = "panda_joint7"
at = 1.0
[[tasks]]
kind = "distance"
frame = "panda_joint4"
to = "panda_hand_tcp"
distance = 0.47
level = 0
[[constraints]]
kind = "speed_of"
joint = "panda_joint1"
speed = 0.05
[[constraints]]
frame = "panda_joint4"
above = [0.0, 0.0, 0.2]
"""


def refused(call: Any) -> str:
    try:
        call()
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return "SILENT"


def main(folder: Path) -> dict[str, Any]:
    keep.KINDS = {**keep.KINDS, "distance": Distance}
    keep.CONSTRAINT_KINDS = {**keep.CONSTRAINT_KINDS, "speed_of": SpeedOf}
    from tests.viz.live.stepped_source import SteppedSource
    from typer.testing import CliRunner

    import ftqp
    from ftqp.app.commands.cli import app
    from ftqp.sim.session.session_commands import Break

    file, out = folder / "own.toml", folder / "run"
    file.write_text(SCENARIO, encoding="utf-8")
    runner, found = CliRunner(), {}
    found["check"] = runner.invoke(app, ["check", str(file)]).output
    found["wrong"] = refused(lambda: Distance(frame="a", to="b", weight=-1.0))
    wrong = folder / "wrong.toml"
    wrong.write_text(SCENARIO.replace("distance = 0.47", "distanc = 0.47"), encoding="utf-8")
    found["wrong key"] = runner.invoke(app, ["check", str(wrong)]).output
    found["run"] = runner.invoke(app, ["run", str(file), "--out", str(out)]).output
    page = folder / "report.html"
    found["report"] = runner.invoke(app, ["report", str(out), "-o", str(page)]).output
    found["names it"] = "The task Distance was" in page.read_text(encoding="utf-8")
    found["summary"] = json.loads((out / "summary.json").read_text())
    log = ftqp.load_log(out)
    found["columns"] = [name for name in log.units if name.startswith(("task_error", "distance"))]
    found["units"] = [log.units[name] for name in found["columns"]]
    found["metadata"] = [log.metadata["tasks"], log.metadata["constraints"]]
    found["error"] = float(log["task_error.Distance"][-1])
    found["fastest"] = float(np.abs(log["v"][:, 0]).max())
    robot = ftqp.robots.load("panda")
    apart = Distance(frame="panda_joint4", to="panda_hand_tcp", distance=0.489, level=0)
    slow = SpeedOf(joint="panda_joint1")
    planner = ftqp.Planner(robot, tasks=[ftqp.Task("position"), apart], constraints=[slow])
    planner.reset(robot.neutral)
    step = planner.step(robot.neutral, None, ftqp.Target(pose=robot.pose(robot.neutral)))
    found["step"] = [step.status.name, step.tasks["Distance"].failed, list(planner.constraints)]
    reports = [one.tasks["Distance"].error.tolist() for one in (step, step.copy())]
    found["own error"] = [*reports, [apart.error(robot, robot.neutral)]]
    targets = ftqp.Targets(np.repeat(robot.pose(robot.neutral)[None], 3, axis=0))
    batch = lambda: ftqp.batch.rollout(planner, robot.neutral[None], np.zeros((1, 7)), targets)  # noqa: E731
    found["batch"] = refused(batch)
    found["library"] = refused(planner.deployable)
    tasks = [ftqp.Task("position"), apart]
    found["ahead"] = refused(lambda: ftqp.Planner(robot, tasks=tasks, n_minus_one=ftqp.NMinusOne()))
    unknown = Distance(frame="nose", to="panda_joint7")
    found["frame"] = refused(lambda: ftqp.Planner(robot, tasks=[ftqp.Task(), unknown]))
    source = SteppedSource(str(file), seconds=0.1)
    source.put(Break(ftqp.Locked("panda_joint6")))
    found["page"] = [[one.name, one.value, one.place is not None] for one in source.frame().further]
    return found


if __name__ == "__main__":
    print(json.dumps(main(Path(sys.argv[1]))))
