"""What a planner is told between its steps: it happens as a whole, or not at all.

A change is made in two parts. First everything that it needs is worked out, and may be refused; then one
immutable ``Wanted`` takes the place of the last, which is the instant at which the change has happened. What
the kernel and the planner's parts make of it is derived from it, as often as it takes: whoever is interrupted
meanwhile, by an exception at any line, leaves the rest to the next call.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ftqp.control.planner.braking_reserve import braking_reserve
from ftqp.control.planner.one_thread import OneThread, guarded
from ftqp.control.planner.planner_facts import PlannerFacts
from ftqp.control.planner.stages import Stage, Tick
from ftqp.control.planner.step import Step
from ftqp.control.planner.wanted import Fitting, Start, Wanted, warn_of_weight
from ftqp.core.checks import array, frozen, positive
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Fault, FreeSwinging, Locked
from ftqp.kernel.entry.orders import Orders
from ftqp.kernel.layout.record import load_chain
from ftqp.model.capsules import Capsule
from ftqp.model.payload import Payload


class PlannerChanges(PlannerFacts, ABC):
    """Starts, faults, loads and tools, each of which a planner is told as a whole."""

    __slots__ = ("_adopted", "_begin", "_fast", "_inside", "_orders", "_out", "_stages", "_step_arm", "_tick")
    _adopted: Wanted | None
    _begin: Tick | None
    _fast: Tick | None
    _inside: OneThread
    _orders: Orders
    _out: Step
    _stages: tuple[Stage, ...]
    _step_arm: Fitting
    _tick: Tick

    @guarded("reset")
    def reset(self, q: Any, v: Any = None) -> None:
        """Begin at (q, v): the latch of a stop, warm starts and the last command are forgotten, not faults.

        A start that is near a singularity of the task, that a motor cannot hold, or that leaves no redundancy
        gets one warning on the logger ``ftqp``.

        Args:
            q: Measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: Measured velocity, (nv,) [rad/s or m/s]; None is rest.

        Raises:
            InputError: A wrong shape, or a number that is not finite.
        """
        n = self.robot.nv
        q = frozen(self.robot.angles(q))
        v = frozen(np.zeros(n) if v is None else array("v", v, (n,), "(nv,)"))
        start = Start(q, v)
        self._change(lambda wanted: replace(wanted, start=start))

    @guarded("report")
    def report(self, fault: Fault) -> None:
        """Believe ``fault`` from the next step on, of any kind in ``ftqp.faults.kinds.KINDS``.

        Args:
            fault: The fault; it takes the place of another one of the same joint.

        Raises:
            InputError: An unknown joint, or not a fault.
        """
        told = self._fault_response
        self._change(
            lambda wanted: replace(wanted, belief=wanted.belief.reported(fault)),
            told and partial(told.told, fault),
        )

    def brake(self, joint: str | int) -> None:
        """Let the brake of a joint that swings freely be closed, and believe that it stands where it is.

        ``step.brakes`` names it from the next step on, on an arm that has a brake for each joint.

        Args:
            joint: Its name or 0-based index.

        Raises:
            InputError: An unknown joint, or one that does not swing freely.
        """
        i = self.robot.joint(joint)
        name = self.robot.joints[i]
        if not isinstance(self.faults.get(name), FreeSwinging):
            raise InputError(
                f"{name} is not believed to swing freely, so that no brake of it is asked for; report it as "
                "ftqp.Locked if it stands"
            )
        self._loop.ask_for_brake(i)
        self.report(Locked(name, mode="instant"))

    @guarded("withdraw")
    def withdraw(self, joint: str | int) -> None:
        """Believe the joint to be healthy again from the next step on.

        Args:
            joint: Its name or 0-based index; one that is healthy stays so.

        Raises:
            InputError: An unknown joint.
        """
        told = self._fault_response
        self._change(
            lambda wanted: replace(wanted, belief=wanted.belief.without(joint)),
            told and partial(told.forget, joint),
        )

    @guarded("carry")
    def carry(self, payload: Payload | None) -> None:
        """Count on this load at the tip from the next step on, in the place of the last one.

        State, faults and the solver's memory stay; ``planner.robot`` is then the loaded arm, which brakes
        earlier. A load that it cannot hold where it is gets one warning on the logger ``ftqp``. This takes
        some ten milliseconds: call it while the arm rests.

        Args:
            payload: The load, in the frame of the robot's own tip, whatever the tool is; None is none.

        Raises:
            InputError: This is no payload, or a robot without masses.
        """
        limited = self._given.limits_torque

        def loaded(wanted: Wanted) -> Wanted:
            fitting = wanted.fitting.carrying(payload)
            load = None if payload is None else fitting.load
            reserve = braking_reserve(fitting.unloaded, load) if limited else None
            return replace(wanted, fitting=fitting, reserve=reserve)

        self._change(loaded)
        if payload is not None:
            K, n = self._session.K, self.robot.nv
            q = K.state.q_command[:n] if K.state.is_reset else None
            warn_of_weight(self.robot, q, K.limits.tau_max[:n])

    @guarded("tool")
    def tool(self, T: Any) -> None:
        """Control another point from the next step on; targets are then poses of that point.

        State, faults and the solver's memory stay, and so do masses: a tool that weighs something is a
        payload, too. A target that is not moved along with the point is somewhere else for the arm.

        Args:
            T: Pose of the point in the frame of the robot's own tip, (4, 4) [m]; None is that tip.

        Raises:
            InputError: T is no pose, or a plan leads the planner, which is one of its own tip.
        """
        if self._leading is not None:
            raise InputError("the planner follows a plan of another tip; plan for robot.with_tip(T) instead")
        self._change(lambda wanted: replace(wanted, fitting=wanted.fitting.holding(T)))

    @guarded("attach")
    def attach(self, name: str, shapes: Capsule | Sequence[Capsule]) -> None:
        """Keep more bodies clear that move with the arm: a tool, a load that sticks out.

        From the next step on they are kept clear of the scene and of the arm, as its links are. Their weight
        counts only where ``carry`` was told of it, too.

        Args:
            name: What they are called together in statuses and certificates.
            shapes: Capsules, one or several; without a ``frame`` they are in that of the robot's own tip.

        Raises:
            InputError: These are no capsules, the name is taken, they touch the arm where it is neutral, or
                the planner keeps clear of nothing. Nothing changes then.
        """
        self._kept_clear().attach(name, shapes)

    @guarded("detach")
    def detach(self, name: str) -> None:
        """Forget bodies that were attached.

        Args:
            name: What they are called.

        Raises:
            InputError: Nothing of that name is attached.
        """
        self._kept_clear().detach(name)

    @property
    def speed(self) -> float:
        """How fast the arm is led, in (0, 1] of full speed; it may be changed at every step.

        A smaller number slows the path of a ``PathFollower`` down, and the way of a ``GoTo`` or a
        ``TargetFollower`` by as much, an operator's twist included. Targets that the user's own clock gives
        to ``step`` are not changed by it.
        """
        return self._wanted.speed

    @speed.setter
    @guarded("speed")
    def speed(self, share: float) -> None:
        if not 0.0 < positive("speed", share) <= 1.0:
            raise InputError(f"speed is {share:g}, expected a share of full speed in (0, 1]")
        self._change(lambda wanted: replace(wanted, speed=float(share)))

    def _believe(self, fault: Fault) -> None:
        """Believe a fault that the detector has found, and let it look at the other joints."""
        told = self._fault_response
        self._change(
            lambda wanted: replace(wanted, belief=wanted.belief.reported(fault)),
            told and partial(told.detector.believe, fault),
        )

    def _disbelieve(self, joint: str | int) -> None:
        """Believe that a joint is healthy, as the detector has found."""
        self._change(lambda wanted: replace(wanted, belief=wanted.belief.without(joint)))

    def _change(self, change: Callable[[Wanted], Wanted], then: Callable[[], None] | None = None) -> None:
        """Want something else, and let it happen; what an interrupted change has left comes first.

        Args:
            change: Makes of what was wanted what is wanted; a signal handler may have changed that meanwhile,
                so that it is asked again.
            then: What else the change brings about.
        """
        self._heal()
        wanted: Wanted | None = None
        while self._wanted is not wanted:
            before = self._wanted
            wanted = replace(change(before), then=then)
            self._begin = None  # until all of it has happened, steps look at what is wanted
            self._wanted = wanted if self._wanted is before else self._wanted  # from here on it has happened
        self._heal()

    def _heal(self) -> None:
        """Let what is wanted happen as far as it has not; once begun it may be begun again."""
        while self._adopted is not self._wanted:
            self._adopt(self._adopted, self._wanted)
        self._begin = self._fast

    def _adopt(self, before: Wanted | None, wanted: Wanted) -> None:
        """Derive from what is wanted all that differs from what it was."""
        K = self._session.K
        if before is not None and before.fitting is not wanted.fitting:
            self._mount(wanted.fitting)
        if before is None or before.belief is not wanted.belief:
            wanted.belief.write(self._orders, None if before is None else before.belief)
            self._orders.believed()
            for stage in self._stages:
                if stage.believe is not None:
                    stage.believe(wanted.belief)
            self._tick, self._fast = self._ticks()
        if before is None or before.belief is not wanted.belief or before.reserve is not wanted.reserve:
            self._orders.count_on(None if wanted.reserve is None else wanted.reserve.samples)
        if before is not None and before.belief is not wanted.belief and K.state.is_reset:
            self._hold_up(before, wanted)
        if before is not None and before.speed != wanted.speed:
            self._loop.speed = wanted.speed
        if wanted.start is not None and (before is None or before.start is not wanted.start):
            self._begin_at(wanted.start, wanted)
        if wanted.then is not None:
            wanted.then()
        self._adopted = wanted

    def _hold_up(self, before: Wanted, wanted: Wanted) -> None:
        """A joint that is said to have too little torque for the weight of the arm asks for its brake."""
        robot, was = wanted.fitting.robot, before.belief.faults
        for joint, fault in wanted.belief.faults.items():
            weak = "tau_max" in fault.shares and getattr(fault, fault.shares["tau_max"]) < 1.0
            if weak and was.get(joint) != fault and robot.has_inertia:
                self._loop.find_overload(robot.joint(joint))

    def _mount(self, fitting: Fitting) -> None:
        """Let the kernel see the arm as it is fitted; steps that are kept stay with the arm that they had."""
        if self._step_arm is not fitting:
            self._out.fill_in()
            if self._step_arm is None or self._step_arm.payload is not fitting.payload:
                self._session.K.learned.load[:] = 0.0  # it is what is told now
            self._step_arm = fitting
        load_chain(self._session.K, **fitting.unloaded.chain.constants())
        self._orders.carry(fitting.load)
        for stage in self._stages:
            if stage.mount is not None:
                stage.mount(fitting.robot)

    def _begin_at(self, start: Start, wanted: Wanted) -> None:
        """Forget everything but what is believed."""
        self._orders.start(start.q, start.v)
        for stage in self._stages:
            if stage.begin is not None:
                stage.begin(start, wanted)

    @abstractmethod
    def _ticks(self) -> tuple[Tick, Tick | None]:
        """The tick whose targets come with a step, and the same where nothing else has a part in it."""
