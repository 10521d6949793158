"""ftqp's whole step with several tasks: a Panda that looks and keeps its elbow up, two arms with a bar."""

from collections.abc import Callable
from functools import partial

from bench.worker import Case, Variant, serve
from steps.own import driven, versions

import ftqp

HANDS = ("left_hand", "right_hand")
ELBOW, EYE = "panda_joint4", "panda_joint6"


def variants(case: Case, way: str) -> dict[str, Callable[[], Variant]]:
    """The task of the tip alone, and beside others."""
    if case.robot == "dual_panda":
        kp = case.gain if case.level == "velocity" else case.kp
        grip = ftqp.RelativeTask(HANDS[1], HANDS[0], level=0, kp=kp)
        return {"ftqp": partial(_planner, case, way, [grip], HANDS)}
    beside, before = (
        [
            ftqp.PositionTask(ELBOW, rows="z", level=level, weight=0.1),
            ftqp.AxisTask(EYE, towards=(0.6, 0.1, 0.0), level=level, weight=0.1),
        ]
        for level in (3, 2)
    )
    return {
        "ftqp, tip alone": partial(_planner, case, way, [], (case.tip,)),
        "ftqp": partial(_planner, case, way, beside, (case.tip,)),
        "ftqp, level 2": partial(_planner, case, way, before, (case.tip,)),
    }


def _planner(case: Case, way: str, others: list[ftqp.Task], tips: tuple[str, ...]) -> Variant:
    robot = ftqp.Robot.from_urdf(case.urdf, tips=tips, acceleration=case.a_max, neutral=case.q)
    gains = {"kp": case.gain} if case.level == "velocity" else {"kp": case.kp, "kv": case.kv}
    planner = ftqp.Planner(
        robot,
        dt=case.dt,
        level={"velocity": "velocity", "torque": "acceleration"}[case.level],
        scheme=ftqp.schemes.mvn(),
        tasks=[ftqp.Task("pose", **gains), *others],
    )
    planner.reset(case.q)
    return driven(planner, way, case.q, case.poses)


if __name__ == "__main__":
    serve(variants, versions)
