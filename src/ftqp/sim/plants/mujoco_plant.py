"""An arm in the physics of MuJoCo: motors behind servos, brakes, free joints, end stops, friction, load."""

from collections.abc import Iterator
from typing import Any, final

import numpy as np

from ftqp.control.scene.placed_shapes import Scene
from ftqp.control.scene.solid_shapes import WORDS, Hull
from ftqp.core.checks import FloatArray, array, instance, positive, seen, whole_number
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Degraded, Fault, FreeSwinging, Locked, not_served
from ftqp.model.followers import coupled_places, is_led
from ftqp.model.frames import mount_of
from ftqp.model.robot import Robot
from ftqp.sim.plants.joint_servo import GainServo, JointServo
from ftqp.sim.plants.physics import Geom, Physics, quaternion
from ftqp.sim.plants.plant import Command, Motors, Plant
from ftqp.sim.plants.troubled_plant import HiddenFault, Jammed, Misread, Runaway, Weakened
from ftqp.sim.plants.true_arm import TrueArm

CREEP = 1e-4
"""How far a closed brake creeps in 10 s under the largest load, at most [rad or m]."""


@final
class MujocoPlant(Plant):
    """The arm as rigid bodies with motors: it obeys torques, and only through them commands.

    What a fault does:

    * locked: the motor is off. ``ramp`` closes a brake, which is dry friction of its own torque: once it has
      closed the joint stops within some ms, whatever deceleration the fault names, and slips where the brake
      is too weak.
      ``instant`` stops the joint by an impulse, which the other joints feel, and fixes it.
    * free-swinging: the motor is off; the fault's friction is added to the joint's own, end stops remain.
    * degraded: the motor has what is left of its torque, and the end stops move in to what is left of the
      range. Speed and acceleration are a servo's and not reduced.

    The arm closes the brakes that the planner asks for. What else befalls a joint: see ``suffer``.

    Args:
        robot: the arm as its planner and its servos know it.
        dt: sampling period of the commands [s].
        servo: what the arm takes and how it follows; None is a position servo.
        true: how the true arm differs; None: not at all, but for end stops a little beyond the limits.
        substeps: time steps of the physics in ``dt``, >= 1; stiff servos and friction need more.
        seed: of how late commands come where they do, >= 0.
        scene: what stands around the arm as it stands now, with which ``robot.capsules`` collide; None is
            nothing.

    Raises:
        InputError: a robot without inertia, an unknown joint, a value out of its range.
        MissingPackage: MuJoCo is not installed.

    Source: docs/mujoco-plant.md.
    """

    __slots__ = (
        "_brakes", "_closes_in", "_closing", "_coulomb", "_delivered", "_dt", "_high", "_is_odd", "_latest",
        "_led", "_limit", "_low", "_misread", "_physics", "_pushed", "_read", "_rng", "_robot", "_seed",
        "_servo", "_started", "_stuck", "_substeps", "_viscous",
    )  # fmt: skip

    def __init__(
        self,
        robot: Robot,
        dt: float,
        servo: JointServo | GainServo | None = None,
        true: TrueArm | None = None,
        *,
        substeps: int = 4,
        seed: int = 0,
        scene: Scene | None = None,
    ) -> None:
        instance("robot", robot, Robot, "an ftqp.Robot, for example planner.robot")
        instance("servo", servo, JointServo | GainServo | None, "a servo, ftqp.JointServo(robot, 'torque')")
        instance("true", true, TrueArm | None, "an ftqp.TrueArm or None")
        instance("scene", scene, Scene | None, "an ftqp.Scene or None")
        robot.refuse_floating("plant 'mujoco', whose motors would hold it, needs")
        if not robot.has_inertia:
            raise InputError(
                f"{robot.name} has no inertia, so torques do not move it; give the model its masses or take "
                "plant 'kinematic'"
            )
        whole_number("substeps", substeps, 1)
        self._robot = robot
        self._servo: JointServo | GainServo = JointServo(robot) if servo is None else servo
        true = TrueArm() if true is None else true
        self._substeps, self._latest, self._seed = substeps, int(true.jitter * substeps), seed
        self._rng = np.random.default_rng(seed)
        self._dt = positive("dt", dt, "s")
        step = self._dt / substeps
        geoms = [] if scene is None else [*_bodies(robot), *_things(scene)]
        self._physics = Physics(true.chain(robot), step, geoms)
        self._closes_in = round(true.brake_delay / step)
        self._closing: dict[int, int] = {}
        self._coulomb, self._viscous = true.friction(robot)
        self._low, self._high = true.stops(robot)
        self._led = is_led(robot.chain)  # joints without a motor, and without end stops of their own
        self._low[self._led], self._high[self._led] = -np.inf, np.inf
        self._brakes = true.brakes(robot, np.diag(self._physics.mass_matrix()))
        self._limit = np.where(self._led, 0.0, robot.limits.tau_max)
        self._delivered, self._pushed = np.ones(robot.nv), np.zeros(robot.nv)
        self._misread: dict[int, Misread] = {}
        self._read = np.zeros((2, robot.nv))
        self._stuck = np.zeros(robot.nv)
        self._is_odd = False
        self.reset(robot.neutral, np.zeros(robot.nv))

    @property
    def q(self) -> FloatArray:
        return seen(self._physics.q)

    @property
    def v(self) -> FloatArray:
        return seen(self._physics.v)

    @property
    def tau(self) -> FloatArray:
        """Torques of the motors in the last time step, (nv,) [N m or N]; belongs to the plant."""
        return seen(self._physics.tau)

    @property
    def demand(self) -> FloatArray:
        """What the servos asked of the motors in the last time step, that of ``tau``; belongs to the plant.

        It is what a healthy motor would give: (nv,) [N m or N].
        """
        return seen(self._servo.demand)

    @property
    def motors(self) -> Motors:
        """Both; they belong to the plant."""
        return Motors(self.tau, self.demand)

    @property
    def carried(self) -> FloatArray:
        """Torques of brakes, end stops and dry friction in the last step, (nv,); belongs to the plant."""
        return seen(self._physics.carried)

    @property
    def contact_force(self) -> float:
        """The largest force between the arm and what stands around it in the last time step [N]."""
        return self._physics.contact_force

    @property
    def dt(self) -> float:
        """The period of the commands that it takes [s]."""
        return self._dt

    @property
    def drive(self) -> str:
        """What the arm takes."""
        return self._servo.drive

    @property
    def tolerance(self) -> float:
        """How far a closed brake creeps in 10 s under the largest load, at most [rad or m]."""
        return CREEP

    @property
    def failure(self) -> str | None:
        """What MuJoCo has to say against its own motion, with time and joint, or None."""
        return self._physics.failure

    def reset(self, q: FloatArray, v: FloatArray) -> None:
        q = coupled_places(self._robot.chain, self._robot.angles(q))
        self._physics.reset(q, array("v", v, (self._robot.nv,), "(nv,)"))
        self._limit[:] = np.where(self._led, 0.0, self._robot.limits.tau_max)
        for i in range(self._robot.nv):
            self._work(i)
        self._servo.reset(q)
        self._rng, self._started = np.random.default_rng(self._seed), False

    def fail(self, fault: Fault) -> None:
        i = self._motor_of(fault.joint)
        match fault:
            case Locked(mode="instant"):
                self._work(i)
                self._limit[i] = 0.0
                self._physics.fix(i)
            case Locked():
                self._work(i)
                self._limit[i] = 0.0
                self._close(i)
            case FreeSwinging():
                self._work(i)
                self._limit[i] = 0.0
                self._physics.resist(i, self._coulomb[i] + fault.friction, self._viscous[i] + fault.damping)
            case Degraded():
                self._work(i)
                self._limit[i] *= fault.torque
                low = self._low[i] if fault.q_min is None else max(fault.q_min, self._low[i])
                high = self._high[i] if fault.q_max is None else min(fault.q_max, self._high[i])
                self._physics.stop_at(i, low, high)
            case _:
                not_served(fault, "plant 'mujoco'")

    def repair(self, joint: str | int) -> None:
        self._work(self._motor_of(joint))

    def push(self, force: Any) -> None:
        """From now on something pushes the end effector, until the next call or reset.

        Args:
            force: Along the axes of the base, (3,) [N]; zeros end it.

        Raises:
            InputError: It has another shape, or is not finite.
        """
        self._physics.push(array("force", force, (3,)))

    def suffer(self, fault: HiddenFault) -> None:
        """From now on the joint of ``fault`` does what it says, and no longer what befell it before.

        Args:
            fault: What happens, and to which joint.

        Raises:
            InputError: No hidden fault, unknown joint, or an encoder of a servo that a torque arm has not.
        """
        instance("fault", fault, HiddenFault, "Runaway, Weakened, Jammed or Misread; fail takes others")
        i = self._motor_of(fault.joint)
        if isinstance(fault, Misread) and self.drive == "torque":
            raise InputError(
                "an arm that takes torques has no servo that could misread an encoder; give the fault to the "
                "sensors"
            )
        self._work(i)
        self._is_odd = True
        match fault:
            case Runaway():
                self._delivered[i] = 0.0
                self._pushed[i] = fault.direction * self._robot.limits.tau_max[i]
                self._servo.strays[i] = 1.0
            case Weakened():
                self._delivered[i] = fault.share
            case Jammed():
                brake = (
                    self._brakes[i] if fault.share is None else fault.share * self._robot.limits.tau_max[i]
                )
                self._physics.resist(i, self._coulomb[i] + brake, self._viscous[i])
                self._servo.strays[i] = 1.0
            case Misread():
                self._misread[i] = fault
                self._stuck[i] = self.q[i]

    def _motor_of(self, joint: str | int) -> int:
        """The joint whose motor moves it: itself, or the one that it follows."""
        return int(self._robot.chain.lead[self._robot.joint(joint)])

    def _close(self, i: int) -> None:
        """Let the brake of joint i close, which takes its time."""
        if not self._closes_in:
            self._brake(i)
        elif i not in self._closing:
            self._closing[i] = self._closes_in

    def _close_on(self) -> None:
        """Let brakes close that are due in this time step."""
        for i in [*self._closing]:
            self._closing[i] -= 1
            if self._closing[i] <= 0:
                del self._closing[i]
                self._brake(i)

    def _brake(self, i: int) -> None:
        """Close the brake of joint i and switch its motor off."""
        self._limit[i] = self._pushed[i] = 0.0
        self._physics.resist(i, self._coulomb[i] + self._brakes[i], self._viscous[i])

    def _work(self, i: int) -> None:
        """Let joint i be healthy."""
        self._limit[i] = 0.0 if self._led[i] else self._robot.limits.tau_max[i]
        self._delivered[i], self._pushed[i] = 1.0, 0.0
        self._servo.strays[i] = 0.0
        self._misread.pop(i, None)
        self._closing.pop(i, None)
        self._is_odd = bool(self._misread or (self._delivered != 1.0).any() or self._servo.strays.any())
        self._physics.release(i)
        self._physics.resist(i, self._coulomb[i], self._viscous[i])
        self._physics.stop_at(i, self._low[i], self._high[i])

    def advance(self, command: Command) -> None:
        servo, physics, limit = self._servo, self._physics, self._limit
        late = int(self._rng.integers(self._latest + 1)) if self._latest and self._started else 0
        self._started = True
        brakes = command.brakes
        if brakes.any():
            for i in np.flatnonzero(brakes & (limit > 0.0)):
                self._close(int(i))
        tau, q, v = physics.tau, physics.q, physics.v
        for at in range(self._substeps):
            if at == late:
                servo.take(command)
            if self._closing:
                self._close_on()
            if self._is_odd:
                read = self._as_read()
                servo.torques(read[0], read[1], limit, tau)
                tau *= self._delivered
                tau += self._pushed
            else:
                servo.torques(q, v, limit, tau)
            physics.step()

    def _as_read(self) -> FloatArray:
        """The state that the servos read, (2, nv)."""
        read = self._read
        read[0], read[1] = self._physics.q, self._physics.v
        for i, fault in self._misread.items():
            if fault.frozen:
                read[0, i], read[1, i] = self._stuck[i], 0.0
            read[0, i] += fault.bias
        return read


def _bodies(robot: Robot) -> Iterator[Geom]:
    """The bodies of an arm that move."""
    for one in robot.capsules:
        joint, T = mount_of(robot, one.frame or "universe")
        a, b = (T[:3, :3] @ end + T[:3, 3] for end in (one.a, one.b))
        size = {"size": (one.radius, 0.0, 0.0)}
        if joint >= 0 and one.corners is not None:
            yield Geom(joint, "hull", {}, one.corners @ T[:3, :3].T + T[:3, 3])
        elif joint >= 0 and np.any(a != b):
            yield Geom(joint, "capsule", size | {"fromto": [*a, *b]})
        elif joint >= 0:
            yield Geom(joint, "sphere", size | {"pos": a})


def _things(scene: Scene) -> Iterator[Geom]:
    """What stands in a scene: half edges, or a radius and half a length."""
    for placed in scene.values():
        word = next(word for word, kind in WORDS.items() if isinstance(placed.shape, kind))
        x, y, z = placed.shape.extent
        T = placed.place
        pose = {"pos": T[:3, 3], "quat": quaternion(T[:3, :3])}
        if isinstance(placed.shape, Hull):
            yield Geom(-1, word, pose, placed.shape.corners)
            continue
        size = {"box": (x, y, z), "half_space": (0.0, 0.0, 1.0)}.get(word, (y, x, 0.0))
        yield Geom(-1, word, pose | {"size": size})
    for *place, radius in scene.balls.tolist():
        yield Geom(-1, "sphere", {"pos": place, "size": (radius, 0.0, 0.0)})
