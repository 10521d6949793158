"""A whole scenario file: every key with its type, default, unit, range and meaning."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor
from pathlib import Path as File
from typing import Any, ClassVar, Literal

import numpy as np

from ftqp.app.schema.reading import Options, Table, options, settings_for
from ftqp.app.schema.robot_section import Quaternion, RobotTable, Vector, quaternion_rotation
from ftqp.control.drive.joint_drive import Drive, Noise
from ftqp.control.following.stall import StallEscape
from ftqp.control.moving_base.base_gain import Observer
from ftqp.control.moving_base.inertial_task import InertialTask, MovingBase
from ftqp.control.paths import KINDS as PATHS
from ftqp.control.paths import Line, Path, PointToPoint, Waypoints
from ftqp.control.paths.path import Repeated
from ftqp.control.planner.detector import Detector
from ftqp.control.planner.planner import Planner
from ftqp.control.scene.placed_shapes import Clearance, Scene
from ftqp.control.scene.solid_shapes import WORDS, Shape
from ftqp.control.task.keep import CONSTRAINT_KINDS, KEPT, KINDS
from ftqp.control.task.soft_tasks import SoftTask
from ftqp.control.task.task import EmergencyStop, Task
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.pose import transform
from ftqp.core.setting import REQUIRED, like, setting
from ftqp.faults.kinds import KINDS as FAULTS
from ftqp.faults.kinds import Fault
from ftqp.kernel.layout.rows import KEEPS
from ftqp.kernel.layout.scene_room import OBSTACLES, TERMS
from ftqp.kernel.layout.thresholds import TIME_SLACK
from ftqp.model.payload import Payload
from ftqp.model.robot import Robot
from ftqp.qp import Backend, Recorder
from ftqp.sim.base.disturbances import Disturbance, RandomMotion, Sinusoid, Step
from ftqp.sim.base.moving_world import Base, FreeBase, MovingWorld, Platform
from ftqp.sim.number_files import recorded_motion, waypoint_table
from ftqp.sim.plants.joint_servo import Gains, GainServo, JointServo
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.plants.plant import Plant
from ftqp.sim.plants.servo_plant import ServoPlant
from ftqp.sim.plants.troubled_plant import TROUBLES, HeldPlant, HiddenFault, Hold, Push
from ftqp.sim.plants.true_arm import TrueArm
from ftqp.sim.schedule import FaultEvent, first_tick
from ftqp.sim.sensors.joint_sensors import JointSensors

Named = dict[str, Any]
"""A name with settings that their owner checks; in a file the name alone will do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerTable(Table):
    """How the next command is chosen."""

    explained_by: ClassVar[type[Planner]] = Planner
    dt: float = setting(1e-3, unit="s", above=0.0, most=1.0)
    level: str = setting("acceleration", choices=("acceleration", "velocity"))
    drive: Options[Drive] = setting(options(Drive), short="kind")
    noise: Options[Noise] = setting(options(Noise))
    scheme: Named | None = setting(
        None,
        "a scheme or a table with its gains, see `ftqp schemes`; mvn, or rmp with a plan, if absent",
        short="name",
    )
    task: Options[Task] = setting(options(Task))
    bounds: Named = setting(
        {"name": "viability"}, "'viability', 'jin', 'one_step' or a table with the gains of jin", short="name"
    )
    backend: Named | None = setting(
        None,
        "a QP backend or a table with its settings, see `ftqp backends`; active_set if absent",
        short="name",
    )
    profile: str | None = setting(None, "a backend's TOML profile, in place of backend", file=True)
    posture: tuple[float, ...] | None = setting(None, unit="rad or m")
    plan: str | None = setting(
        None,
        "a file of `ftqp plan`: the arm starts as it does, and its postures lead the null space; "
        "scheme is rmp if absent",
        file=True,
    )
    branch_limits: dict[str, tuple[float, float]] | None = setting(None, unit="rad or m", infinite=True)
    torque_limits: bool = setting(True)
    emergency: Options[EmergencyStop] | None = setting(
        options(EmergencyStop), "the emergency stop; 'off' to have none", off=True
    )
    detector: Options[Detector] | bool | None = setting(
        None, "detects failures that nobody reports; false: only guards; position drives need no table for it"
    )
    stall: Options[StallEscape] | None = setting(
        options(StallEscape),
        "the escape of a stalled path, for reference = 'progress'; 'off' to have none",
        off=True,
    )
    bridges: bool = setting(
        False,
        "whether a blocked path goes on from another posture, to which the end effector leaves it, for "
        "reference = 'progress'",
    )
    leave: float | None = setting(
        None,
        "how far the end effector may leave a blocked path, to go on near it or from another posture, for "
        "reference = 'progress'; if absent, anywhere with bridges and not at all without",
        unit="m",
        least=0.0,
    )

    remember: float | None = setting(None, unit="s", above=0.0)

    def __post_init__(self) -> None:
        if self.backend is not None and self.profile is not None:
            raise InputError("has backend and profile, expected one of them")
        if self.scheme is None:
            object.__setattr__(self, "scheme", {"name": "mvn" if self.plan is None else "rmp"})


PerJoint = float | dict[str, float]
"""One number for all joints, or a table by joint name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MujocoTable(Table):
    """The arm in physics, and what is true of it and unknown to its planner."""

    bandwidth: float = like(JointServo, "bandwidth")
    takes_velocity: bool = like(JointServo, "takes_velocity")
    gains: Options[Gains] | None = setting(
        None, "servos with fixed gains a joint, in place of those that know the arm's model"
    )
    substeps: int = setting(4, "time steps of the physics in a control period, >= 1", least=1.0)
    step: float | None = setting(
        None, "time step of the physics, in place of substeps, about, > 0", unit="s", above=0.0
    )
    payload: Options[Payload] | None = like(TrueArm, "payload")
    mass_scale: float = like(TrueArm, "mass_scale")
    jitter: float = like(TrueArm, "jitter")
    rotors: PerJoint = like(TrueArm, "rotors")
    coulomb: PerJoint = like(TrueArm, "coulomb")
    viscous: PerJoint = like(TrueArm, "viscous")
    brake: dict[str, float] = like(TrueArm, "brake")
    brake_delay: float = like(TrueArm, "brake_delay")
    end_stops: float | None = like(TrueArm, "end_stops")

    def true_arm(self) -> TrueArm:
        """What is true of the arm."""
        return TrueArm(**settings_for(TrueArm, self))

    def plant(
        self,
        arm: Robot,
        dt: float,
        drive: str,
        seed: int,
        scene: Scene | None,
        troubles: "Sequence[TroubleTable]" = (),
    ) -> Plant:
        """The arm in physics, behind servos that take what a drive sends; MuJoCo is loaded here."""
        from ftqp.sim.plants.mujoco_plant import MujocoPlant
        from ftqp.sim.plants.troubled_plant import Trouble, TroubledPlant

        true = self.true_arm()
        substeps = self.substeps if self.step is None else max(1, round(dt / self.step))
        servo: JointServo | GainServo
        if self.gains is None:
            servo = JointServo(true.geared(arm), drive, **settings_for(JointServo, self))
        else:
            servo = GainServo(true.geared(arm), drive, self.gains.made(), dt / substeps)
        made = MujocoPlant(arm, dt, servo, true, substeps=substeps, seed=seed, scene=scene)
        befalls = [Trouble(one.at, one.what, one.duration, one.every) for one in troubles]
        return TroubledPlant(made, arm, dt, befalls) if befalls else made


@dataclass(frozen=True, slots=True, kw_only=True)
class TroubleTable(Table):
    """What befalls an arm in physics and nobody reports."""

    kind: Options[HiddenFault | Push] = setting(REQUIRED, "kind of trouble", kinds=TROUBLES)
    joint: str | int | None = setting(None, "a joint's name or its index from 0; a push has none", least=0.0)
    at: float = setting(REQUIRED, "when it happens, >= 0", unit="s", least=0.0)
    duration: float | None = setting(None, "for how long, > 0; for ever if absent", unit="s", above=0.0)
    every: float | None = setting(
        None, "after how long it comes again, > duration; not at all if absent", unit="s", above=0.0
    )

    def __post_init__(self) -> None:
        pushes = self.kind.of is Push
        if pushes == (self.joint is not None):
            raise InputError(
                "is a push and names a joint; leave joint out"
                if pushes
                else "names no joint; give joint, a name or an index from 0"
            )

    @property
    def what(self) -> HiddenFault | Push:
        """What befalls the arm."""
        return self.kind.made() if self.joint is None else self.kind.made(joint=self.joint)


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationTable(Table):
    """What stands for the world."""

    plant: str = setting(
        "kinematic",
        "the arm follows every command exactly, or through joint servos that lag, or as physics makes it",
        choices=("kinematic", "servo", "mujoco"),
    )
    servo: Options[ServoPlant] = setting(options(ServoPlant), "the servos of plant = 'servo'")
    mujoco: MujocoTable = setting(MujocoTable(), "the arm of plant = 'mujoco'")
    seed: int = setting(0, "seed of everything random, >= 0", least=0.0)
    feed_forward: str = setting(
        "sampled",
        "the path's acceleration at a tick, or its mean until the next one",
        choices=("sampled", "mean"),
    )
    holds: tuple[Options[Hold], ...] = setting((), "when all joints are held at once")
    troubles: tuple[TroubleTable, ...] = setting((), "what befalls an arm in physics and nobody reports")
    duration: float | None = setting(
        None, "end of the run, > 0; the path's duration if absent", unit="s", above=0.0
    )

    @property
    def takes_velocity(self) -> bool | None:
        """Whether the position servos of the plant take velocities, too; None of one without servos."""
        if self.plant == "servo":
            return bool(self.servo["takes_velocity"])
        if self.plant != "mujoco":
            return None
        gains = self.mujoco.gains
        return self.mujoco.takes_velocity if gains is None else bool(gains["takes_velocity"])

    def made_plant(
        self, arm: Robot, dt: float, level: str, drive: str, *, moving: bool, scene: Scene | None = None
    ) -> Plant:
        """The arm that is simulated."""
        plant: Plant
        if self.troubles and self.plant != "mujoco":
            raise InputError(f"troubles befall plant 'mujoco' only, and the plant is {self.plant!r}")
        if self.plant == "servo":
            plant = self.servo.made(arm, dt, drive=None if moving else drive)
        elif self.plant == "mujoco":
            plant = self.mujoco.plant(arm, dt, drive, self.seed, scene, self.troubles)
        else:
            plant = KinematicPlant(arm, dt, level)
        return HeldPlant(plant, arm, dt, [one.made() for one in self.holds]) if self.holds else plant


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultTable(Table):
    """What every fault of a scenario says: which joint, when it fails, when that is reported."""

    kind: Options[Fault] = setting(REQUIRED, "kind of fault", kinds=FAULTS)
    joint: str | int = setting(REQUIRED, "a joint's name or its index from 0", least=0.0)
    at: float = setting(REQUIRED, "when it happens, >= 0", unit="s", least=0.0)
    announced: float | Literal["never"] | None = setting(
        None, "when it is reported to the planner (a time >= at, or 'never'); at once if absent", least=0.0
    )

    def __post_init__(self) -> None:
        if isinstance(self.announced, float) and self.announced < self.at:
            raise InputError(f"is announced at {self.announced:g} s, before it happens at {self.at:g} s")

    def event(self) -> FaultEvent:
        """What fails, and when."""
        return FaultEvent(self.at, self.kind.made(joint=self.joint), announced=self.announced)


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionFile:
    """A recorded motion, read from a CSV file with a header.

    The columns are t [s] and the coordinates of the base; a free base has qx, qy, qz, qw for its attitude.
    """

    file: str = setting(REQUIRED, "a .csv file, relative to the scenario", file=True)


DISTURBANCES: Mapping[str, type[Any]] = {
    "step": Step, "sinusoid": Sinusoid, "random": RandomMotion, "recorded": MotionFile
}  # fmt: skip
CARRIERS: Mapping[str, type[Base]] = {"platform": Platform, "free": FreeBase}


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseTable(Table):
    """White noise of every measured pose."""

    position: float = setting(0.0, "of each axis, >= 0", unit="m", least=0.0)
    rotation: float = setting(0.0, "about each axis, >= 0", unit="rad", least=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseTable(Table):
    """What carries the arm."""

    disturbances: tuple[Options[Disturbance], ...] = setting((), "what moves the base", kinds=DISTURBANCES)
    sensing: str = like(MovingBase, "sensing")
    attitude: str = like(MovingBase, "attitude")
    gain: float = setting(1.0, "share of the error that a step removes, 0 < x < 2", above=0.0, below=2.0)
    observer: Options[Observer] | None = like(MovingBase, "observer")
    delay: float = like(MovingBase, "delay")
    end_point: bool | None = setting(
        None, "whether the end effector is measured; when the base is not, if absent"
    )
    noise: NoiseTable = setting(NoiseTable(), "noise of every measured pose")
    patience: float = like(MovingBase, "patience")
    anti_windup: bool = like(MovingBase, "anti_windup")
    kind: Options[Base] = setting(REQUIRED, "kind of base", kinds=CARRIERS)

    def world(self, planner: Planner, folder: File, seed: int) -> MovingWorld:
        """The base under the planner's arm, and the sensors; files are relative to ``folder``."""
        base, generator = self.kind.made(), np.random.default_rng(seed)
        return MovingWorld(
            InertialTask(planner, MovingBase(**settings_for(MovingBase, self)), gain=self.gain),
            base,
            [_disturbance(each, base, folder, generator) for each in self.disturbances],
            end_point=self.end_point,
            position_noise=self.noise.position,
            rotation_noise=self.noise.rotation,
            seed=int(generator.integers(2**63)),
        )


def _disturbance(
    given: Options[Any], base: Base, folder: File, generator: np.random.Generator
) -> Disturbance:
    if given.of is MotionFile:
        return recorded_motion(folder / given["file"], base.coordinates)
    if given["coordinate"] not in base.coordinates:
        raise InputError(
            f"{given['coordinate']!r} is not a coordinate of this base; it has {', '.join(base.coordinates)}"
        )
    moved: Disturbance = given.made(**({"generator": generator} if given.of is RandomMotion else {}))
    return moved


@dataclass(frozen=True, slots=True, kw_only=True)
class WaypointFile:
    """A smooth curve through points of a file.

    A CSV file has a header of x, y, z [m] and if wanted t [s] and qx, qy, qz, qw; an NPZ file has the arrays
    positions (N, 3) and if wanted times (N,) and orientations (N, 4).
    """

    file: str = setting(REQUIRED, "a .csv or .npz file, relative to the scenario", file=True)
    relative: bool = setting(False, "whether the points count from the start position")
    duration: float | None = setting(None, "needed when the file has no times, > 0", unit="s", above=0.0)

    def path(self, origin: FloatArray, folder: File) -> Path:
        """The curve from the pose ``origin``, (4, 4)."""
        points = waypoint_table(folder / self.file)
        if self.duration is not None and points.times is not None:
            raise InputError(f"{self.file} has times, so duration cannot hold as well; leave it out")
        return Waypoints(
            origin,
            points.positions,
            orientations=points.orientations,
            times=points.times,
            duration=self.duration,
            relative=self.relative,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """A goal pose, straight to which the tip goes, turning about one axis."""

    duration: float = like(Line, "duration")
    position: Vector | None = setting(
        None, "position of the goal in W; the start position if absent", unit="m"
    )
    orientation: Quaternion | None = setting(
        None, "quaternion x, y, z, w of the goal in W; the start orientation if absent"
    )
    relative: bool = setting(False, "whether the goal counts from the start pose, along W's axes")
    law: Any = like(Line, "law")

    def path(self, origin: FloatArray, folder: File) -> Path:
        """The way to the goal from the pose ``origin``, (4, 4)."""
        position, rotation = origin[:3, 3], origin[:3, :3]
        if self.position is not None:
            position = np.array(self.position) + (position if self.relative else 0.0)
        if self.orientation is not None:
            turn = quaternion_rotation(self.orientation)
            rotation = turn @ rotation if self.relative else turn
        return PointToPoint(origin, transform(rotation, position), duration=self.duration, law=self.law)


WRITTEN: Mapping[str, type[Any]] = {**PATHS, "waypoints": WaypointFile, "point_to_point": Goal}
"""The kinds of path as files have them: those of ``ftqp.paths``, or what makes one of what is in a file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PathTable(Table):
    """What the tip follows."""

    reference: str | None = setting(
        None,
        "'progress': the path waits for the arm, needs task mode scaled; 'time': the clock; 'goal': the end "
        "effector goes to the path's end on its own way; by the task mode if absent",
        choices=("progress", "time", "goal"),
    )
    beyond_reach: bool = setting(False, "whether the path may lead farther than the stretched arm is long")
    laps: float | None = setting(
        None,
        "how many times the path is repeated, round and round where it is closed, else there and back, > 0; "
        "followed once if absent",
        above=0.0,
    )
    kind: Options[Any] = setting(REQUIRED, "kind of path", kinds=WRITTEN)

    def path(self, origin: FloatArray, folder: File) -> Path:
        """The path from the pose ``origin``, (4, 4); files are relative to ``folder``."""
        written = self.kind.of in (WaypointFile, Goal)
        once = self.kind.made().path(origin, folder) if written else self.kind.made(origin)
        return once if self.laps is None else Repeated(once, self.laps)


@dataclass(frozen=True, slots=True, kw_only=True)
class StartTable(Table):
    """The state at t = 0."""

    q: tuple[float, ...] | None = setting(
        None, "joint positions; the robot's neutral ones if absent", unit="rad or m"
    )
    v: tuple[float, ...] | None = setting(None, "joint velocities; at rest if absent", unit="rad/s or m/s")


@dataclass(frozen=True, slots=True, kw_only=True)
class LogTable(Table):
    """How the log of a long run is cut into files."""

    part: float | None = setting(
        None,
        "simulated time after which a new file begins, > 0; the log is one file if absent",
        unit="s",
        above=0.0,
    )
    keep: int | None = setting(
        None,
        "how many parts are kept, the newest included, >= 1; older ones are deleted, none if absent",
        least=1.0,
    )

    def __post_init__(self) -> None:
        if self.keep is not None and self.part is None:
            raise InputError("keeps parts of a log, but part, their length, is not given")


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingTable(Table):
    """Which QPs a run keeps where it is asked to: ``ftqp run --record-qps FILE``."""

    every: int = setting(1, "keep one of so many ticks, >= 1", least=1.0)
    begin: float = setting(0.0, "keep none before, >= 0", unit="s", least=0.0)
    end: float | None = setting(None, "keep none after; the end of the run if absent", unit="s", least=0.0)
    limit: int | None = setting(
        None, "keep the last so many; as many as fit into 256 MiB if absent", least=1.0
    )

    def __post_init__(self) -> None:
        if self.end is not None and self.end < self.begin:
            raise InputError(f"ends at {self.end:g} s, before it begins at {self.begin:g} s")

    def recorder(self, backend: Backend, dt: float) -> Recorder:
        """``backend`` with a copy kept of what is asked for; times become ticks of ``dt``."""
        first = first_tick(self.begin, dt)
        last = None if self.end is None else floor((self.end + TIME_SLACK) / dt)
        if last is not None and last < first:
            raise InputError(
                f"no tick of {dt:g} s lies between begin, {self.begin:g} s, and end, {self.end:g} s"
            )
        return Recorder(backend, every=self.every, limit=self.limit, first=first, last=last)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario(Table):
    """A whole scenario file."""

    description: str = setting("", "what a reader should know")
    robot: RobotTable = setting(REQUIRED, "the arm")
    planner: PlannerTable = setting(PlannerTable(), "how the next command is chosen")
    start: StartTable = setting(StartTable(), "the state at t = 0")
    path: PathTable = setting(REQUIRED, "what the end effector follows")
    tasks: tuple[Options[SoftTask], ...] = setting(
        (),
        "what other points and joints should do with what the end effector's task leaves",
        kinds=KINDS,
        count=(0, TERMS),
    )
    constraints: tuple[Options[Any], ...] = setting(
        (),
        "points of the arm that are kept on their side of a plane, and other constraints",
        kinds=CONSTRAINT_KINDS,
        usual=KEPT,
        count=(0, KEEPS),
    )
    scene: tuple[Options[Shape], ...] = setting(
        (), "what stands around the arm, from which it keeps clear", kinds=WORDS, count=(0, OBSTACLES)
    )
    clearance: Options[Clearance] | None = setting(
        None,
        "how far the arm keeps from itself and from the scene; as by default if there is one and this is "
        "absent",
    )
    base: BaseTable | None = setting(None, "what carries the arm; it stands if absent")
    faults: tuple[FaultTable, ...] = setting((), "what fails, and when it is reported to the planner")
    simulation: SimulationTable = setting(SimulationTable(), "what stands for the world")
    sensors: Options[JointSensors] | None = setting(
        None, "what is measured of the joints; the planner is given the truth if absent"
    )
    log: LogTable = setting(LogTable(), "how the log of a long run is cut into files")
    recording: RecordingTable = setting(RecordingTable(), "which QPs --record-qps keeps")
