"""What moves an arm of an MJCF file beside the motors of its joints, of which a planner knows nothing."""

from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np

from ftqp.model.audit import Finding, warning
from ftqp.model.reading.compiled_mjcf import is_off, mujoco

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
