"""Rotors, friction, load, gains and offsets: what each adds to torques, and how it is found from a log."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, final
from warnings import warn

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray, frozen, instance
from ftqp.core.errors import InputError, unknown
from ftqp.model.chain import frame_id
from ftqp.model.fitting.torque_log import Pieces, TorqueLog, pieces_of
from ftqp.model.payload import Payload
from ftqp.model.robot import Robot

HALF = 0.5
"""A rotor that takes half of the torque limit at the acceleration limit is a large one, and so on. What is
usual is only where the fit begins, and by how much it is kept from what the motion says."""
RUBS = 0.3
"""The same of friction, as a share of the torque limit."""
GAIN = 0.1
"""A motor whose torque constant is off by so much [1] is far off; ..."""
OFFSET = 0.05
"""... and so is an encoder by so much [rad or m]."""
GRAVITY = 9.81
"""Of the planet, to weigh a load by the strongest joint [m/s2]."""


@final
@dataclass(frozen=True, slots=True)
class Unknown:
    """A kind of unknown."""

    about: str  # What it is, in words
    unit: str  # Its unit where joints turn
    # How large it may well be, from the arm, the torques where it has no limits, and the reach
    usual: Callable[["Sizes"], Any]
    # What one unit of each adds to the torques, (S, nv, p), from the arm, the pieces of the motion, and the
    # torques (S, nv) that all unknowns so far make
    columns: Callable[[Robot, Pieces, FloatArray], FloatArray]
    size: int = 0  # How many there are, one a joint (0) or so many of the whole arm
    worth: float = 0.15  # What an error of this share of ``usual`` is still worth telling


class Sizes(NamedTuple):
    """What is large for an arm, each (nv,) but for the last two."""

    tau: FloatArray  # Torques [N m or N]
    v: FloatArray  # Speeds [rad/s or m/s]
    a: FloatArray  # Accelerations [rad/s2 or m/s2]
    load: float  # A mass that the strongest joint can just hold half of at full reach [kg]
    length: float  # The arm's characteristic length [m]


def sizes_of(robot: Robot, pieces: Pieces) -> Sizes:
    """What is large for this arm; where it has no torque limit, what the motion shows."""
    shown = np.maximum(np.abs(pieces.tau).max(axis=0), 1e-3)
    tau = np.where(np.isfinite(robot.limits.tau_max), robot.limits.tau_max, shown)
    v = np.where(np.isfinite(robot.limits.v_max), robot.limits.v_max, 1.0)
    a = np.where(np.isfinite(robot.limits.a_max), robot.limits.a_max, 10.0)
    reach = 6.0 * robot.length
    turning = ~robot.chain.prismatic
    strongest = float((tau * turning).max()) or float(tau.max())
    return Sizes(tau, v, a, HALF * strongest / (GRAVITY * reach), robot.length)


def _each(x: FloatArray) -> FloatArray:
    """A column a joint: (S, nv, nv) with x on the diagonals."""
    result: FloatArray = x[:, :, None] * np.eye(x.shape[1])
    return result


def torques(robot: Robot, pieces: Pieces) -> FloatArray:
    """What the model asks for, viscous friction included and dry friction not, (S, nv) [N m or N]."""
    model, data = robot.model, robot.model.createData()
    return np.array(
        [
            pin.rnea(model, data, robot.configuration(q), v, a) + robot.viscous * v
            for q, v, a in zip(pieces.q, pieces.v, pieces.a, strict=True)
        ]
    )


def _loads(robot: Robot, pieces: Pieces, _: FloatArray) -> FloatArray:
    """Mass, first moments (3) and moments of inertia (6) of a body at the end effector, along its axes."""
    model, data = robot.model, robot.model.createData()
    frame = model.frames[frame_id(model, robot.tip)]
    body, to_joint = frame.parentJoint - 1, _to_joint(frame.placement)
    found = []
    for q, v, a in zip(pieces.q, pieces.v, pieces.a, strict=True):
        whole = pin.computeJointTorqueRegressor(model, data, robot.configuration(q), v, a)
        found.append(whole[:, 10 * body : 10 * body + 10] @ to_joint)
    return np.array(found)


def _to_joint(placement: Any) -> FloatArray:
    """The linear map of (m, m c, I) about a frame to those about the joint that it moves with, (10, 10)."""
    result = np.zeros((10, 10))
    R, p = np.array(placement.rotation), np.array(placement.translation)
    for k in range(10):
        unit = np.eye(10)[k]
        m, first, moments = unit[0], R @ unit[1:4], R @ symmetric(unit[4:]) @ R.T
        mixed = np.outer(p, first) + np.outer(first, p)
        moments = moments + 2.0 * (p @ first) * np.eye(3) - mixed + m * (p @ p * np.eye(3) - np.outer(p, p))
        first = first + m * p
        xx, xy, yy, xz, yz, zz = (moments[i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)))
        result[:, k] = [m, *first, xx, xy, yy, xz, yz, zz]
    return result


def symmetric(six: FloatArray) -> FloatArray:
    """The matrix of pinocchio's order xx, xy, yy, xz, yz, zz, (3, 3)."""
    xx, xy, yy, xz, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _turned(robot: Robot, pieces: Pieces, _: FloatArray) -> FloatArray:
    """How the torques change with the positions."""
    model, data = robot.model, robot.model.createData()
    found = []
    for q, v, a in zip(pieces.q, pieces.v, pieces.a, strict=True):
        pin.computeRNEADerivatives(model, data, robot.configuration(q), v, a)
        found.append(np.array(data.dtau_dq))
    return np.array(found)


LOAD = "load"
KINDS: dict[str, Unknown] = {
    "rotors": Unknown(
        "rotor inertia", "kg m2", lambda s: HALF * s.tau / s.a, lambda robot, at, made: _each(at.a)
    ),
    "coulomb": Unknown(
        "dry friction", "N m", lambda s: RUBS * s.tau, lambda robot, at, made: _each(np.sign(at.v))
    ),
    "viscous": Unknown(
        "viscous friction", "N m s/rad", lambda s: RUBS * s.tau / s.v, lambda robot, at, made: _each(at.v)
    ),
    "gains": Unknown(
        "gain of the torques", "1", lambda s: GAIN + 0.0 * s.tau,
        lambda robot, at, made: _each(made), worth=0.3,
    ),
    "offsets": Unknown("encoder offset", "rad", lambda s: OFFSET + 0.0 * s.tau, _turned, worth=0.3),
    LOAD: Unknown(
        "load at the end effector", "kg, kg m, kg m2",
        lambda s: s.load * s.length ** np.array([0.0, 1, 1, 1, 2, 2, 2, 2, 2, 2]), _loads, size=10,
    ),
}  # fmt: skip
"""The kinds of unknowns, by name; each adds its columns to one regression."""


SLOWEST = 0.02
"""Joints slower than this [rad/s or m/s] do not show the sign of their friction, which may be anything where
they stick."""
ROUNDS = 6
"""Fits one after another, each about the arm that the last one found and weighted by what it left."""
LIGHTEST = 0.01
"""A load below this [kg] does not change what offsets do."""
FARTHEST = 5.0
"""No unknown is taken for more than so many times a usual one, lest the linearised fit run away."""
ALIKE = 0.5
"""Time over which what the model misses is alike [s]: standard errors count motion in blocks of it."""
ANOTHER = 0.3
"""Where this share of the torques' root mean square is left unexplained in some joint the log is of another
arm, or a joint has another sign. A log of the same arm with all unknowns at their usual size leaves less than
a tenth (``python studies/identify.py``)."""
LEAST_TORQUE = 0.02
"""Torques below this share of the largest are not judged so."""
ROOM = 0.2
"""Beyond the range of a joint by so much [rad or m] no sample of the same arm lies."""
LEAST_WAY = 0.01
"""A joint that goes less far [rad or m] stands still."""
SIGNIFICANT = 3.0
"""A load that is not so many standard errors heavy is none."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FittedArm:
    """What an arm has that its model lacks, with standard errors.

    Attributes:
        robot: The model that it was compared with.
        rotors: Inertia of rotors, (nv,) [kg m2 or kg]; negative where the model has too much.
        coulomb: Dry friction, (nv,) [N m or N].
        viscous: Viscous friction on top of the model's, (nv,) [N m s/rad or N s/m].
        gains: Torque that the log says by what the motor gave, less 1, (nv,).
        offsets: True position less that of the log, (nv,) [rad or m].
        load: Mass [kg], first moments [kg m] (3) and moments of inertia [kg m2] (6: xx, xy, yy, xz, yz, zz)
            at the end effector, about and along its axes, (10,).
        errors: Standard errors of all of these, by name.
        not_shown: What the motion does not show, by name, one flag each.
        left: What remains unexplained of each joint's torque, root mean square, (nv,) [N m or N].
        before: The same without any unknown.
        size: Root mean square of the torques themselves, (nv,) [N m or N].
        pieces: How many pieces of motion were looked at.
        width: How long a piece is [s].
        left_out: Time that lies in gaps of the logs [s].
    """

    robot: Robot
    rotors: FloatArray
    coulomb: FloatArray
    viscous: FloatArray
    gains: FloatArray
    offsets: FloatArray
    load: FloatArray
    errors: dict[str, FloatArray]
    not_shown: dict[str, Any]
    left: FloatArray
    before: FloatArray
    size: FloatArray
    pieces: int
    width: float
    left_out: float

    @property
    def untold(self) -> dict[str, Any]:
        """`not_shown`, as it was called before 0.4."""
        warn("what the motion does not show is FittedArm.not_shown now", DeprecationWarning, stacklevel=2)
        return self.not_shown

    @property
    def payload(self) -> Payload | None:
        """The load as ``planner.carry`` takes it; None where there is none beyond three standard errors."""
        mass = float(self.load[0])
        if self.not_shown[LOAD][0] or mass <= SIGNIFICANT * self.errors[LOAD][0]:
            return None
        centre = self.load[1:4] / mass
        about_tip = mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        try:
            return Payload(mass, centre, symmetric(self.load[4:]) - about_tip)
        except InputError:  # not known well enough to be that of a body
            return Payload(mass, centre)

    @property
    def fitted(self) -> Robot:
        """The robot with the rotors and the friction that were found; what the motion does not show stays.

        Its load is ``payload``, and gains and offsets are errors of the log, not of the arm.
        """
        robot = self.robot
        known = {name: np.where(self.not_shown[name], 0.0, getattr(self, name)) for name in
                 ("rotors", "coulomb", "viscous")}  # fmt: skip
        dry = np.where(self.not_shown["coulomb"], robot.coulomb, np.maximum(known["coulomb"], 0.0))
        viscous = np.maximum(robot.viscous + known["viscous"], 0.0)
        with_friction = robot.with_friction(viscous=viscous, coulomb=dry)
        return with_friction.with_rotors(np.maximum(robot.chain.armature + known["rotors"], 0.0))


def fitted_arm(
    robot: Robot,
    logs: TorqueLog | Sequence[TorqueLog],
    unknowns: Sequence[str] = tuple(KINDS),
    most: int = 20_000,
) -> FittedArm:
    """Rotors R, friction, load, gains k and encoder offsets o of an arm, by least squares.

    tau = (1 + k) (ID(q + o, v, a) + R a + f_c sgn(v) + f_v v + Y(q, v, a) (m, m c, I))

    in the middles of pieces of the motion of 40 ms, through which cubics are laid, longer ones where there is
    more noise. ID is what the model asks for, Y that of a load by its mass, first moments and inertia. All
    are found together, six times about what was found before, each joint weighted by what it leaves. Pieces
    in which a joint stands or turns round say nothing of friction there and are left out. Each unknown is
    drawn to 0 as little as a usual one may be large (a rotor that takes half of the torque limit at the
    acceleration limit, a gain of 10 %, an offset of 50 mrad), so that what the motion does not show stays
    there, and its standard error says so. Standard errors count half seconds, in which what the model misses
    is alike. The masses of the model are taken for true. A log of which more than 30 % of a joint's torque
    stays unexplained is refused.

    Args:
        robot: The arm as its model says.
        logs: One motion, or several with the same load, 20 s or so of it.
        unknowns: Which kinds to look for, of rotors, coulomb, viscous, gains, offsets, load.
        most: About so many pieces of the motion are looked at, of longer ones fewer.

    Raises:
        InputError: The arm has no masses, an unknown kind, a log of another arm, one without motion, or one
            that is too short or too slow.

    Source: Swevers et al. 1997 for the regression.
    """
    every = _checked(robot, logs, unknowns)
    found = arm_of(robot, every, unknowns, most)
    _refuse_another(found, every)
    return found


def arm_of(robot: Robot, every: Sequence[TorqueLog], unknowns: Sequence[str], most: int) -> FittedArm:
    """The same, also of a log that is not explained."""
    parts = [pieces_of(log, max(most // len(every), 1)) for log in every]
    t, q, v, a, tau = (np.concatenate(arrays) for arrays in zip(*(part[:5] for part in parts), strict=True))
    width, left_out = max(part.width for part in parts), sum(part.left_out for part in parts)
    pieces = Pieces(t, q, v, a, tau, width, left_out)
    block = np.concatenate(
        [np.floor((p.t - p.t[0]) / ALIKE) + 1e6 * k for k, p in enumerate(parts)]
    )  # fmt: skip
    sizes = sizes_of(robot, pieces)
    kinds = [KINDS[name] for name in unknowns]
    usual = np.concatenate([np.atleast_1d(kind.usual(sizes)) for kind in kinds])
    ends = np.cumsum([kind.size or robot.nv for kind in kinds])
    places = {name: slice(end - (kind.size or robot.nv), end)
              for name, kind, end in zip(unknowns, kinds, ends, strict=True)}  # fmt: skip
    worth = (np.abs(pieces.v) > SLOWEST) & (np.abs(pieces.v) > 0.5 * np.abs(pieces.a) * pieces.width)
    row, joint = np.nonzero(worth)
    before = _rms(pieces.tau - torques(robot, pieces), worth)
    found = np.zeros(len(usual))
    for last in (*[False] * ROUNDS, True):
        at = pieces._replace(q=pieces.q + found[places["offsets"]]) if "offsets" in places else pieces
        made = torques(robot, at)
        carrying = _carrying(robot, found[places[LOAD]]) if LOAD in places else robot
        columns = {name: KINDS[name].columns(carrying, at, made) for name in unknowns if name != "gains"}
        for name in unknowns:
            if name not in ("gains", "offsets"):
                made = made + columns[name] @ found[places[name]]
        scale = 1.0 + found[places["gains"]] if "gains" in places else np.ones(robot.nv)
        columns = {name: scale[:, None] * column for name, column in columns.items()}
        if "gains" in places:
            columns["gains"] = KINDS["gains"].columns(robot, at, made)
        A, y = np.concatenate([columns[name] for name in unknowns], axis=2), pieces.tau - scale * made
        left = _rms(y, worth)
        weight = 1.0 / np.maximum(left, 1e-9 + 1e-6 * sizes.tau)
        if last:
            break
        rows = A[row, joint] * weight[joint, None] * usual
        target = y[row, joint] * weight[joint] + rows @ (found / usual)
        inverse = np.linalg.inv(rows.T @ rows + np.eye(len(usual)))
        scaled = inverse @ (rows.T @ target)
        found = np.clip(usual * scaled, -FARTHEST * usual, FARTHEST * usual)
    errors = usual * _errors(rows, target - rows @ scaled, inverse, block[row])
    moves = np.ptp(pieces.q, axis=0) > LEAST_WAY
    not_shown = {}
    for name, kind in zip(unknowns, kinds, strict=True):
        flags = errors[places[name]] > kind.worth * usual[places[name]]
        not_shown[name] = flags if kind.size else flags | (~moves if name != "offsets" else False)
    values = {name: frozen(found[place]) for name, place in places.items()}
    none = {name: frozen(np.zeros(kind.size or robot.nv)) for name, kind in KINDS.items()}
    return FittedArm(
        robot=robot,
        errors={name: frozen(errors[place]) for name, place in places.items()},
        not_shown={**{name: np.ones(len(zero), dtype=bool) for name, zero in none.items()}, **not_shown},
        left=frozen(left), before=frozen(before), size=frozen(_rms(pieces.tau, worth)),
        pieces=len(pieces.t), width=pieces.width, left_out=pieces.left_out, **{**none, **values},
    )  # fmt: skip


def _checked(robot: Robot, logs: Any, unknowns: Sequence[str]) -> list[TorqueLog]:
    """The logs, if they may be of this arm."""
    instance("robot", robot, Robot, "an ftqp.Robot")
    if not robot.has_inertia:
        raise InputError(f"{robot.name} has no masses, so no torques; give the model its masses first")
    robot.refuse_floating("identification needs")
    for name in unknowns:
        if name not in KINDS:
            raise unknown("unknown", name, "an arm", KINDS)
    every = [logs] if isinstance(logs, TorqueLog) else list(logs)
    if not every or not unknowns:
        raise InputError(
            "no log or no unknown was given; expected ftqp.TorqueLog(t=, q=, tau=) and some kinds"
        )
    for log in every:
        instance("log", log, TorqueLog, "an ftqp.TorqueLog")
        if log.q.shape[1] != robot.nv:
            raise InputError(
                f"{log.name} has {log.q.shape[1]} joints, but {robot.name} has {robot.nv}; it is of another "
                "arm"
            )
        low = (robot.limits.q_min - log.q).max(axis=0)
        high = (log.q - robot.limits.q_max).max(axis=0)
        beyond = np.maximum(low, high)
        if (beyond > ROOM).any():
            i = int(np.argmax(beyond))
            far = float(log.q[int(np.argmax(np.abs(log.q[:, i]))), i])
            raise InputError(
                f"{log.name} has {robot.joints[i]} at {far:.4g} rad, but its range is "
                f"{robot.limits.q_min[i]:.4g} to {robot.limits.q_max[i]:.4g}; the log is of another arm, or "
                "in degrees"
            )
    still = [i for i in range(robot.nv) if all(np.ptp(log.q[:, i]) < LEAST_WAY for log in every)]
    if len(still) == robot.nv:
        raise InputError(
            f"no joint of {every[0].name} moves by {LEAST_WAY:g} rad, so it tells nothing; record the motion "
            "that `ftqp identify --motion` writes"
        )
    if not any(np.abs(log.tau).max() > 0.0 for log in every):
        raise InputError(f"all torques of {every[0].name} are 0; record what the motors gave")
    return every


def _carrying(robot: Robot, load: FloatArray) -> Robot:
    """The robot with the load that was found so far, by which torques change with positions."""
    mass = float(load[0])
    return robot if mass < LIGHTEST else robot.with_payload(Payload(mass, load[1:4] / mass))


def _rms(values: FloatArray, worth: Any) -> FloatArray:
    """Root mean square of every joint over the pieces that show something, (nv,)."""
    count = np.maximum(worth.sum(axis=0), 1)
    result: FloatArray = np.sqrt((values**2 * worth).sum(axis=0) / count)
    return result


def _errors(rows: FloatArray, left: FloatArray, inverse: FloatArray, block: FloatArray) -> FloatArray:
    """Standard errors: the larger of those of equal noise and those of blocks that are alike within."""
    names, place = np.unique(block, return_inverse=True)
    score = np.zeros((len(names), rows.shape[1]))
    np.add.at(score, place, rows * left[:, None])
    count = len(names)
    spread = inverse @ (score.T @ score) @ inverse * count / max(count - 1, 1)
    result: FloatArray = np.sqrt(np.maximum(np.diag(spread), np.diag(inverse)))
    return result


def _refuse_another(found: FittedArm, logs: list[TorqueLog]) -> None:
    """Refuse a log whose torques no unknown of a usual size explains."""
    robot, size, left = found.robot, found.size, found.left
    share = np.where(size > LEAST_TORQUE * robot.limits.tau_max, left / np.maximum(size, 1e-12), 0.0)
    if (share > ANOTHER).any():
        i = int(np.argmax(share))
        raise InputError(
            f"{robot.name} does not explain {logs[0].name}: of the {size[i]:.3g} N m of {robot.joints[i]} "
            f"{left[i]:.3g} are left, whatever its rotors, friction, load, gains and offsets may be; "
            "expected the log of this arm, each joint with the sign of the model; or say how late torques "
            "act"
        )
