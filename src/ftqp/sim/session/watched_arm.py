"""An arm of a session: what has failed of it, what was reported to its planner, and its picture."""

from typing import final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.control.planner.running_task import RunningTask
from ftqp.control.planner.ways.way_out import WayOut
from ftqp.control.task.soft_tasks import PoseTask, RelativeTask
from ftqp.core.checks import FloatArray, array, frozen
from ftqp.core.errors import InputError
from ftqp.core.pose import transform
from ftqp.faults.kinds import Fault
from ftqp.kernel.layout.enums import STOPPED, STOPPING
from ftqp.sim.further_measures import FurtherMeasures
from ftqp.sim.leader import Made
from ftqp.sim.log.description import further_about
from ftqp.sim.log.raw_rows import MICROSECONDS
from ftqp.sim.log.signals import PATH_CODES
from ftqp.sim.session.frame import DrawnArm, Frame, FurtherFact, Ghost, Twin, further_facts, placed
from ftqp.sim.session.session_arms import SessionArm

CARRIED = 0.2
"""Things of a scene are carried so fast [m/s]: an arm at rest can flee from that. A convention."""
APART = 1e-6
"""A joint farther from its command than this was repaired elsewhere than its planner thinks [rad or m]."""


def facts_at(planner: Planner, measures: FurtherMeasures, q: FloatArray) -> tuple[FurtherFact, ...]:
    """Soft tasks, kept points and things around at a posture, (nv,)."""
    if not len(measures) or not np.isfinite(q).all():
        return ()
    names = [one.name for one in measures.columns]
    return further_facts(further_about(planner, q), dict(zip(names, measures.at(q).tolist(), strict=True)))


@final
class WatchedArm:
    """One arm and its planner in a session; ``failed`` is what has really failed, by joint."""

    def __init__(self, player: SessionArm) -> None:
        self._player = player
        self._robot = player.planner.robot
        self._measures = FurtherMeasures(player.planner)
        self.failed: dict[str, Fault] = {}
        self._drawn = DrawnArm(self._robot)
        self._made: Made | None = None
        self._placed: dict[str, FloatArray] = {}
        self._stood: dict[str, FloatArray] = {}
        self._going: dict[str, FloatArray] = {}
        self._ways: tuple[WayOut, ...] = ()
        self._ghosts: tuple[Ghost, ...] = ()

    def begin(self, q: FloatArray, v: FloatArray) -> None:
        """Tick 0: the healthy arm at (q, v), each (nv,), and nothing believed to have failed."""
        planner = self._player.planner
        for joint in (*self.failed, *planner.faults):
            planner.withdraw(joint)
        self.failed.clear()
        for name, target in self._placed.items():
            planner.tasks[name].target = target
        self._placed.clear()
        for name, place in self._stood.items():
            assert planner.scene is not None
            planner.scene.move(name, place)
        self._stood.clear()
        self._going.clear()
        self.forget_ways()
        self._player.reset(q, v, 2**31)

    def fail(self, fault: Fault) -> None:
        """Let a joint fail."""
        self._player.plant.fail(fault)
        self.failed[self._robot.joints[self._robot.joint(fault.joint)]] = fault

    def tell(self, fault: Fault) -> None:
        """Tell the planner."""
        self._player.planner.report(fault)

    def repair(self, joint: str) -> None:
        """Let a joint work again; a planner that did not know or has stopped begins where the arm is."""
        planner, plant, leader = self._player.planner, self._player.plant, self._player.leader
        plant.repair(joint)
        planner.withdraw(joint)
        self.failed.pop(joint, None)
        leader.resume()
        step = None if self._made is None else self._made.step
        if step is None:
            return
        i = self._robot.joint(joint)
        stopped = step.code in (STOPPING, STOPPED)
        if stopped or abs(step.reference.q[i] - plant.q[i]) > APART:
            planner.reset(plant.q, plant.v)
            if not leader.by_hand:
                leader.go_back()

    def resume(self) -> str:
        """Let a planner that has stopped go on from where the arm is, back to where its path begins."""
        planner, leader = self._player.planner, self._player.leader
        why = planner.stopped_because
        if why is None:
            return ""
        if not planner.resume():
            return why
        leader.resume()
        if not leader.by_hand:
            leader.go_back()
        return ""

    def follow(self, pose: FloatArray | None) -> None:
        """Let a hand lead, or give the path back."""
        self._player.leader.follow(pose)

    def look_for_ways(self) -> str:
        """Look for ways out of where the arm is; what was found, in a sentence."""
        planner = self._player.planner
        start = planner.view().command.q
        self._ways = planner.ways_out()
        self._ghosts = tuple(self._ghost(way, start) for way in self._ways)
        clear = sum(way.clear for way in self._ways)
        return f"{clear} of {len(self._ways)} ways out are clear; click a ghost or its button to take one."

    def forget_ways(self) -> None:
        """Ways out that were found are not shown any more."""
        self._ways = self._ghosts = ()

    def take_way(self, number: int) -> str:
        """Go a way out that was found, also after a stop; what is done, in a sentence."""
        if not 0 <= number < len(self._ways):
            raise InputError(
                f"there is no way out {number}; {len(self._ways)} are known, so look for them first"
            )
        way = self._ways[number]
        if not way.clear:
            raise InputError(f"this way is not clear: {way.sentence}")
        planner = self._player.planner
        why = planner.stopped_because
        if why is not None and not planner.resume():
            raise InputError(f"the arm does not go on: {why}")
        self._player.leader.take(way)
        self.forget_ways()
        return ""

    def place(self, name: str, position: FloatArray) -> None:
        """Put the target of a soft task, or something of the scene, elsewhere, until the arm begins anew."""
        scene = self._player.planner.scene
        stands = None if scene is None else scene.get(name)
        if stands is not None:
            self._going[name] = array(f"position of {name}", position, (3,), "(3,)")
            self._stood.setdefault(name, stands.place)
            return
        task = self._player.planner.tasks[name]
        position = array(f"position of {name}", position, (3,), "(3,)")
        before = task.target
        task.target = self._moved(task, before, position)
        self._placed.setdefault(name, before)

    def _moved(self, task: RunningTask, target: FloatArray, position: FloatArray) -> FloatArray:
        """A target elsewhere in the world, turned as it is."""
        match task.given:
            case PoseTask():
                turn = target[:3, :3]
            case RelativeTask():
                T = self._player.planner.robot.pose(self._player.plant.q, task.given.to)
                turn, position = target[:3, :3], T[:3, :3].T @ (position - T[:3, 3])
            case _:
                return position
        return transform(turn, array(f"target of {task.name}", position, (3,), "(3,)"))

    @property
    def unreported(self) -> tuple[str, ...]:
        """The joints that have failed without the planner's believing it."""
        return tuple(joint for joint in self.failed if joint not in self._player.planner.faults)

    @property
    def failure(self) -> str | None:
        """Why the simulation of the arm cannot go on, or None."""
        plant = self._player.plant
        if plant.failure is not None:
            return plant.failure
        wrong = ~(np.isfinite(plant.q) & np.isfinite(plant.v))
        if not wrong.any():
            return None
        return f"the position of {self._robot.joints[int(np.argmax(wrong))]} is not a number any more"

    @property
    def sentence(self) -> str:
        """What there is to say beside the status."""
        why = self._player.planner.stopped_because
        notice = None if self._made is None else self._made.step.notice
        fewer = self._player.planner.given_up
        said = [
            "" if notice is None else f"{notice}.",
            "" if fewer is None else f"{fewer[0].upper()}{fewer[1:]}.",
            ""
            if why is None
            else f"The planner has stopped the arm: {why}. Resume tries again, Reset begins anew.",
            self._player.leader.sentence if why is None else "",
        ]
        return " ".join(part for part in said if part)

    def plan_step(self, k: int) -> None:
        """The planner's step of tick k."""
        if self._going:
            self._carry_things()
        self._made = self._player.plan_step(k)

    def _carry_things(self) -> None:
        """Things of the scene go on to where they were asked to be."""
        scene, dt = self._player.planner.scene, self._player.planner.dt
        assert scene is not None
        for name, goal in tuple(self._going.items()):
            here = scene[name].place[:3, 3]
            way = goal - here
            far = float(np.linalg.norm(way))
            if far <= CARRIED * dt:
                scene.move(name, goal)
                del self._going[name]
                continue
            velocity = way * (CARRIED / far)
            scene.move(name, here + dt * velocity, np.concatenate([velocity, np.zeros(3)]))

    def move(self) -> None:
        """Let the arm move on."""
        assert self._made is not None
        self._player.plant.advance(self._made.step)

    def frame(self, k: int, rival: Twin | None = None) -> Frame:
        """The picture of tick k, beside a rival, between ``plan_step`` and ``move``."""
        assert self._made is not None
        player, step = self._player, self._made.step
        plant, planner, leader = player.plant, player.planner, player.leader
        return self._drawn.frame(
            tick=k,
            t=k * planner.dt,
            q=plant.q,
            v=plant.v,
            truth=self._drawn.codes(self.failed),
            belief=self._drawn.codes(planner.faults),
            target=placed(leader.target.pose),
            status=step.code,
            path_status=PATH_CODES[leader.standing.status],
            position_error=step.position_error,
            rotation_error=step.rotation_error,
            step_time_us=MICROSECONDS * self._made.elapsed,
            rival=rival,
            further=facts_at(self._player.planner, self._measures, plant.q),
            ways=self._ghosts,
        )

    def _ghost(self, way: WayOut, start: FloatArray) -> Ghost:
        """A way out as a picture needs it."""
        price = f"{way.time:.2g} s" if way.time >= 0.05 else "at once"
        if way.effort > 0.0:
            price += f", motors {100.0 * way.effort:.0f} %"
        if np.isfinite(way.clearance):
            price += f", {1e3 * way.clearance:.0f} mm clear"
        q, drawn = frozen(np.vstack([start, way.places])), self._drawn
        return Ghost(way.kind, way.clear, price, way.sentence, q, drawn.joints(q[-1]), drawn.tips(q))
