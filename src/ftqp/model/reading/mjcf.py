"""Reading MJCF: MuJoCo compiles the file, a pinocchio model is built of it, and what else moves is said."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import count
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.model.audit import Finding, note, warning
from ftqp.model.followers import Follower
from ftqp.model.reading.compiled_mjcf import compiled, is_off, mujoco
from ftqp.model.reading.source import Source
from ftqp.model.reduction import joint_index, tips_of

EQUALITY = mujoco.mjtEq
TIED_JOINTS, TIED_TENDONS = int(EQUALITY.mjEQ_JOINT), int(EQUALITY.mjEQ_TENDON)
BODY, SITE = int(mujoco.mjtObj.mjOBJ_BODY), int(mujoco.mjtObj.mjOBJ_SITE)
AT_TENDON, AT_BODY = int(mujoco.mjtTrn.mjTRN_TENDON), int(mujoco.mjtTrn.mjTRN_BODY)
AT_SITES = (int(mujoco.mjtTrn.mjTRN_SITE), int(mujoco.mjtTrn.mjTRN_SLIDERCRANK))
OF_JOINT, OF_SITE = int(mujoco.mjtWrap.mjWRAP_JOINT), int(mujoco.mjtWrap.mjWRAP_SITE)
UNKNOWN = "ftqp knows nothing of it, so that torques and motions differ from MuJoCo's by what it does"


def beside_joints(
    mj: Any, names: Sequence[str], moving: Collection[int], carrier: list[int]
) -> list[Finding]:
    """A warning for each element that moves or ties the arm beside the motors of its joints."""
    said = [*_weights(mj, carrier), *_springs(mj, names, moving), *_surroundings(mj, carrier)]
    said += [*_tendons(mj, moving, carrier), *_balls(mj, names, carrier)]
    said += [*_ties(mj, moving, carrier), *_pushes(mj, carrier)]
    return [warning(sentence) for sentence in said]


def _weights(mj: Any, carrier: list[int]) -> Iterator[str]:
    lifted = [mj.body(b).name for b in range(mj.nbody) if carrier[b] >= 0 and mj.body_gravcomp[b]]
    if lifted and not is_off(mj, "GRAVITY") and np.any(mj.opt.gravity):
        yield (
            f"gravcomp carries the weight of {_listed(lifted)} in MuJoCo, which step.tau and robot.bias "
            "carry as well; send step.tau less data.qfrc_gravcomp, or take gravcomp out of the file"
        )


def _springs(mj: Any, names: Sequence[str], moving: Collection[int]) -> Iterator[str]:
    for j in sorted(moving):
        at = mj.jnt_dofadr[j]
        spring = mj.jnt_stiffness[j] or np.any(getattr(mj, "jnt_stiffnesspoly", np.zeros(mj.njnt))[j])
        if spring and not is_off(mj, "SPRING"):
            yield f"joint {names[j]!r} has a spring (stiffness {mj.jnt_stiffness[j]:g}): {UNKNOWN}"
        if np.any(getattr(mj, "dof_dampingpoly", np.zeros(mj.nv))[at]):
            yield f"joint {names[j]!r} has damping that is not in proportion to its speed: {UNKNOWN}"


def _balls(mj: Any, names: Sequence[str], carrier: list[int]) -> Iterator[str]:
    for j in np.flatnonzero(mj.jnt_type == int(mujoco.mjtJoint.mjJNT_BALL)):
        if carrier[mj.jnt_bodyid[j]] >= 0:
            yield f"the ball joint {names[int(j)]!r} swings on the arm and is held here: {UNKNOWN}"


def _surroundings(mj: Any, carrier: list[int]) -> Iterator[str]:
    for word in ("density", "viscosity"):
        if getattr(mj.opt, word):
            yield f"the arm moves in a medium with a {word} of {getattr(mj.opt, word):g}: {UNKNOWN}"
    for f in range(mj.nflex):
        first = mj.flex_vertadr[f]
        bodies = mj.flex_vertbodyid[first : first + mj.flex_vertnum[f]]
        if any(carrier[b] >= 0 for b in bodies):
            yield f"the flex {_name(mj.flex, f)} is soft and hangs on the arm: {UNKNOWN}"


def _tendons(mj: Any, moving: Collection[int], carrier: list[int]) -> Iterator[str]:
    """Tendons that do something to the arm."""
    driven = {int(mj.actuator_trnid[a, 0]) for a in np.flatnonzero(mj.actuator_trntype == AT_TENDON)}
    for t in range(mj.ntendon):
        if not _pulls(mj, t, moving, carrier):
            continue
        does = [
            word
            for word in ("stiffness", "damping", "frictionloss", "armature", "limited")
            if np.any(getattr(mj, f"tendon_{word}", np.zeros(mj.ntendon))[t])
        ]
        does += ["an actuator"] if t in driven else []
        if does:
            yield f"the tendon {_name(mj.tendon, t)} moves the arm ({', '.join(does)}): {UNKNOWN}"


def _pulls(mj: Any, t: int, moving: Collection[int], carrier: list[int]) -> bool:
    """Whether the length of a tendon changes with the arm."""
    path = range(mj.tendon_adr[t], mj.tendon_adr[t] + mj.tendon_num[t])
    if any(mj.wrap_type[w] == OF_JOINT and mj.wrap_objid[w] in moving for w in path):
        return True
    sites = [mj.site_bodyid[mj.wrap_objid[w]] for w in path if mj.wrap_type[w] == OF_SITE]
    return len({carrier[b] for b in sites}) > 1


def _ties(mj: Any, moving: Collection[int], carrier: list[int]) -> Iterator[str]:
    """Equalities beside those of joints, which close loops."""
    if is_off(mj, "EQUALITY"):
        return
    for e in np.flatnonzero(mj.eq_active0 & (mj.eq_type != TIED_JOINTS)):
        kind = EQUALITY(int(mj.eq_type[e])).name.removeprefix("mjEQ_").lower()
        ends = [int(i) for i in (mj.eq_obj1id[e], mj.eq_obj2id[e])]
        if mj.eq_type[e] == TIED_TENDONS:
            of, there = mj.tendon, [i for i in ends if i >= 0]
            tied = any(_pulls(mj, t, moving, carrier) for t in there)
        elif mj.eq_objtype[e] in (BODY, SITE):
            site = mj.eq_objtype[e] == SITE
            of, there = (mj.site if site else mj.body), [max(i, 0) for i in ends]
            bodies = [int(mj.site_bodyid[i]) if site else i for i in there]
            tied = carrier[bodies[0]] != carrier[bodies[1]]
        else:
            continue  # of a flex, which is said above
        if tied:
            between = " and ".join(_name(of, i) for i in there)
            called = f" {mj.equality(int(e)).name!r}" if mj.equality(int(e)).name else ""
            yield f"the equality{called} ({kind}) of {between} closes a loop with the arm: {UNKNOWN}"


def _pushes(mj: Any, carrier: list[int]) -> Iterator[str]:
    """Actuators that push at a place of the arm rather than at a joint."""
    for a in range(len(mj.actuator_trntype)):
        kind, at = mj.actuator_trntype[a], int(mj.actuator_trnid[a, 0])
        if kind in AT_SITES:
            at = int(mj.site_bodyid[at])
        elif kind != AT_BODY:
            continue
        if carrier[at] >= 0:
            yield f"the actuator {_name(mj.actuator, a)} pushes at body {mj.body(at).name!r}: {UNKNOWN}"


def _name(of: Any, at: int) -> str:
    return repr(of(at).name or at)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names[:5])) + (f" and {len(names) - 5} more" if len(names) > 5 else "")


FREE, BALL, SLIDE, HINGE = (
    int(getattr(mujoco.mjtJoint, f"mjJNT_{w}")) for w in ("FREE", "BALL", "SLIDE", "HINGE")
)
ONE_AXIS = (HINGE, SLIDE)
"""Types of joints with one degree of freedom."""
DIRECT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
"""Actuators that stand at a joint."""
MOTOR = (int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtDyn.mjDYN_NONE))
"""Gain, bias and dynamics of an actuator whose force is its control times a number."""


def read(source: Any, wanted: Sequence[str] = (), locked: Sequence[str | int] = ()) -> Source:
    """An MJCF file or text as MuJoCo reads it, in MuJoCo's world and with MuJoCo's joint positions."""
    mj, name = compiled(source, whole=False)
    names = _named(mj.joint, mj.njnt, [_label(mj.body, int(b)) + "_joint" for b in mj.jnt_bodyid])
    model, joints = _tree(mj, names, wanted)
    model.name = name
    simple = [j for j in range(mj.njnt) if mj.jnt_type[j] in ONE_AXIS]
    free = [names[j] for j in range(mj.njnt) if mj.jnt_type[j] == FREE]
    rest = {names[j]: float(mj.qpos0[mj.jnt_qposadr[j]]) for j in simple}
    followers = _followers(mj, names, rest)
    held = {joint_index(names, joint, name) for joint in [*locked, *free]}
    moving = {
        int(i) - 1
        for tip in tips_of(model, wanted, locked)[0]
        for frame in model.frames
        if frame.name == tip
        for i in model.supports[frame.parentJoint]
    } - {-1, *held}
    carrier = [max(({-1, *(int(i) - 1 for i in model.supports[at])} & moving), default=-1) for at in joints]
    findings = [*_ambiguous(mj, wanted), *beside_joints(mj, names, moving, carrier)]
    based = [one for one in free if any(names.index(one) + 1 in model.supports[j + 1] for j in moving)]
    findings += [
        note(
            f'joint {names[j]!r} has a range that its limited="false" switches off; give '
            f"limits={{'q_min': {{{names[j]!r}: ...}}, 'q_max': ...}} to keep one"
        )
        for j in sorted(moving)
        if not mj.jnt_limited[j] and mj.jnt_range[j, 0] < mj.jnt_range[j, 1]
    ]
    for one in based:
        findings.append(note(f"the free joint {one!r} is held at its place in the file"))
    return Source(
        model=model,
        limits={names[j]: _limits(mj, j) for j in simple},
        followers=followers,
        findings=findings,
        postures={
            mj.key(k).name: {names[j]: float(mj.key_qpos[k, mj.jnt_qposadr[j]]) for j in simple}
            for k in range(mj.nkey)
            if mj.key(k).name
        },
        held=free,
        rest=rest,
        bodiless=[names[j] for j in range(mj.njnt - 1) if mj.jnt_bodyid[j] == mj.jnt_bodyid[j + 1]],
    )


def _named(of: Any, number: int, otherwise: Sequence[str]) -> list[str]:
    """The names of some elements; one without gets a name that no other one has."""
    found = [str(of(i).name) for i in range(number)]
    for i, word in enumerate(otherwise):
        if not found[i]:
            found[i] = next(w for k in count(1) if (w := word if k == 1 else f"{word} {k}") not in found)
    return found


def _label(of: Any, at: int) -> str:
    return str(of(at).name) or f"body {at}"


def _tree(mj: Any, names: Sequence[str], wanted: Sequence[str]) -> tuple[Any, list[int]]:
    """The pinocchio model of all on the world, with MuJoCo's positions, and the joint before each body."""
    model = pin.Model()
    model.gravity = pin.Motion(np.r_[np.zeros(3) if is_off(mj, "GRAVITY") else mj.opt.gravity, np.zeros(3)])
    bodies = _named(mj.body, mj.nbody, [f"body {b}" for b in range(mj.nbody)])
    sites = [str(mj.site(s).name) for s in range(mj.nsite)]
    joints, places, frames = [0], [pin.SE3.Identity()], [0]
    for b in range(1, mj.nbody):
        above = int(mj.body_parentid[b])
        at, frame = joints[above], frames[above]
        place = places[above] * _pose(mj.body_pos[b], mj.body_quat[b])
        for j in range(mj.body_jntadr[b], mj.body_jntadr[b] + mj.body_jntnum[b]):
            kind, back = _joint(mj, j)
            anchor = pin.SE3(np.eye(3), mj.jnt_pos[j].copy())
            at = model.addJoint(at, kind, place * anchor * back, names[j])
            frame, place = model.addJointFrame(at, frame), anchor.inverse()
        if at:
            turn = _pose(np.zeros(3), mj.body_iquat[b]).rotation
            moments = turn @ np.diag(mj.body_inertia[b]) @ turn.T
            body = pin.Inertia(float(mj.body_mass[b]), mj.body_ipos[b].copy(), moments)
            model.appendBodyToJoint(at, body, place)
        # a site goes before the body of its name, as it is there to be a tip
        sort = pin.FrameType.FIXED_JOINT if bodies[b] in sites else pin.FrameType.BODY
        joints.append(at)
        places.append(place)
        frames.append(model.addFrame(pin.Frame(bodies[b], at, frame, place, sort)))
    for s, name in enumerate(sites):
        if name:
            b = int(mj.site_bodyid[s])
            place = places[b] * _pose(mj.site_pos[s], mj.site_quat[s])
            model.addFrame(pin.Frame(name, joints[b], frames[b], place, pin.FrameType.OP_FRAME))
    model.armature, model.damping, model.friction = _rotors(mj)
    return model, joints


def _pose(place: Any, quaternion: Any) -> Any:
    w, x, y, z = quaternion
    return pin.SE3(pin.Quaternion(w, x, y, z).toRotationMatrix(), np.array(place))


def _joint(mj: Any, j: int) -> tuple[Any, Any]:
    """pinocchio's joint, and the way back from where the file has it to position 0."""
    axis, ref = mj.jnt_axis[j].copy(), mj.qpos0[mj.jnt_qposadr[j]]
    if mj.jnt_type[j] == HINGE:
        return pin.JointModelRevoluteUnaligned(axis), pin.SE3(pin.exp3(-ref * axis), np.zeros(3))
    if mj.jnt_type[j] == SLIDE:
        return pin.JointModelPrismaticUnaligned(axis), pin.SE3(np.eye(3), -ref * axis)
    ball = mj.jnt_type[j] == BALL
    return pin.JointModelSpherical() if ball else pin.JointModelFreeFlyer(), pin.SE3.Identity()


def _rotors(mj: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rotor inertia, viscous and dry friction of every degree of freedom, those of actuators among them."""
    armature = mj.dof_armature.copy()
    damping = mj.dof_damping * (not is_off(mj, "DAMPER"))
    friction = mj.dof_frictionloss * (not is_off(mj, "FRICTIONLOSS"))
    for a, j in _at_joints(mj):
        at, square = mj.jnt_dofadr[j], mj.actuator_gear[a, 0] ** 2
        for name, total in (("actuator_armature", armature), ("actuator_damping", damping)):
            own = getattr(mj, name, None)  # of MuJoCo 3.5 and later
            total[at] += 0.0 if own is None else square * own[a]
    return armature, damping, friction


def _at_joints(mj: Any) -> Iterable[tuple[int, int]]:
    """The actuators that stand at a joint with one degree of freedom, each with it."""
    for a in range(len(mj.actuator_trntype)):
        j = int(mj.actuator_trnid[a, 0])
        if mj.actuator_trntype[a] in DIRECT and mj.jnt_type[j] in ONE_AXIS:
            yield a, j


def _limits(mj: Any, j: int) -> dict[str, float]:
    """Limits of a joint; its torque is the less of its range and of its actuators' forces or controls."""
    low, high = mj.jnt_range[j]
    if not mj.jnt_limited[j] and (low < high or low == high == 0.0):  # else it is one that MuJoCo ignores
        low, high = -np.inf, np.inf
    own = _either_way(mj.jnt_actfrcrange[j]) if mj.jnt_actfrclimited[j] else np.inf
    motors = [_most(mj, a) for a, at in _at_joints(mj) if at == j]
    return {
        "q_min": float(low),
        "q_max": float(high),
        "v_max": np.inf,
        "tau_max": float(min(own, sum(motors) if motors else np.inf)),
    }


def _most(mj: Any, a: int) -> float:
    """The most that an actuator gives its joint [N m or N]."""
    gear, most = abs(mj.actuator_gear[a, 0]), np.inf
    if mj.actuator_forcelimited[a]:
        most = _either_way(mj.actuator_forcerange[a])
    kinds = (mj.actuator_gaintype[a], mj.actuator_biastype[a], mj.actuator_dyntype[a])
    if mj.actuator_ctrllimited[a] and kinds == MOTOR:
        most = min(most, abs(mj.actuator_gainprm[a, 0]) * _either_way(mj.actuator_ctrlrange[a]))
    return float(gear * most) if gear else 0.0


def _either_way(ends: FloatArray) -> float:
    """What a range allows either way, or the one way that it allows."""
    return float(np.abs(ends).min() or np.abs(ends).max())


def _followers(mj: Any, names: Sequence[str], rest: dict[str, float]) -> dict[str, Follower]:
    """Joints that equalities tie to others: y - y0 = a0 + a1 (x - x0), each followed to the one that leads.

    Where an equality holds a joint at a constant, that is where it rests.
    """
    found: dict[str, Follower] = {}
    if is_off(mj, "EQUALITY"):
        return found
    for e in np.flatnonzero((mj.eq_type == int(mujoco.mjtEq.mjEQ_JOINT)) & mj.eq_active0):
        y = names[mj.eq_obj1id[e]]
        a0, a1, *more = (float(a) for a in mj.eq_data[e, :5])
        if mj.eq_obj2id[e] < 0:
            rest[y] += a0
            found[y] = Follower(leader="a constant", otherwise="a constant moves no joint")
            continue
        x = names[mj.eq_obj2id[e]]
        offset = rest[y] + a0 - a1 * rest[x]
        if any(more):
            curve = " ".join(f"{a:g}" for a in (a0, a1, *more))
            found[y] = Follower(leader=x, otherwise=f"along the curve {curve!r}, not in proportion")
        elif y not in found and _leader(found, x) != y:
            found[y] = Follower(leader=x, ratio=a1, offset=offset)
        elif x not in found and a1 and _leader(found, y) != x:
            found[x] = Follower(leader=y, ratio=1.0 / a1, offset=-offset / a1)
        else:
            found[y] = Follower(leader=x, otherwise="equalities tie it to others already")
    return {joint: _resolved(found, joint) for joint in found}


def _leader(found: dict[str, Follower], joint: str) -> str:
    """The joint that leads another one in the end."""
    while joint in found and not found[joint].otherwise:
        joint = found[joint].leader
    return joint


def _resolved(found: dict[str, Follower], joint: str) -> Follower:
    """How a joint follows the one that leads it in the end."""
    one = found[joint]
    while not one.otherwise and one.leader in found and not found[one.leader].otherwise:
        above = found[one.leader]
        one = Follower(
            leader=above.leader, ratio=one.ratio * above.ratio, offset=one.ratio * above.offset + one.offset
        )
    return one


def _ambiguous(mj: Any, wanted: Sequence[str]) -> list[Finding]:
    bodies = {str(mj.body(b).name) for b in range(mj.nbody)}
    sites = {str(mj.site(s).name) for s in range(mj.nsite)}
    return [
        note(f"both a site and a body are called {tip!r}; the site is taken")
        for tip in wanted
        if tip in bodies & sites
    ]
