"""Fuzzed commands are held against the limits of the model file and against what their statuses claim.

The laws are those of ``ftqp.checker``, which shares nothing with the planner; the arm is one that does
exactly what the planner's reference says.
"""

from dataclasses import replace
from typing import Any

import numpy as np

import ftqp
from ftqp.checker.checked_run import LAWS
from ftqp.checker.joint_health import health
from ftqp.checker.tip_errors import errors
from ftqp.checker.trace import KINEMATIC, Failure, Trace
from fuzz.account import Account, Epoch
from fuzz.cases import Case

Array = np.ndarray[Any, Any]
LONG_AGO = -1e3
IN_A_STOP = ("STOPPING", "STOPPED", "INVALID_INPUT")
LOOKED_AT = 8
"""So many claims of an episode are held against forward kinematics."""
NEARLY = 1e-9
STANDS = 5e-3
"""Share of its speed limit below which a joint of a stopped arm stands."""


def broken(case: Case, account: Account, world: Any) -> list[str]:
    """The promises that an episode broke, a sentence each."""
    K = account.count
    if K == 0:
        return []
    found = _finite(account, K)
    if found:
        return found
    begun_wrong = np.zeros(case.robot.nv, dtype=bool)
    for epoch, end in zip(account.epochs, [*(e.first for e in account.epochs[1:]), K], strict=True):
        if end > epoch.first:
            found += _of_epoch(case, account, epoch, end, begun_wrong)
    return found + _stops(case, account, K) + _honesty(case, account, K, world)


def _finite(account: Account, K: int) -> list[str]:
    for name in ("q", "v", "a", "sent_q", "sent_v"):
        bad = ~np.isfinite(getattr(account, name)[:K]).all(axis=1)
        if bad.any():
            k = int(np.argmax(bad))
            return [f"tick {k}: {name} is not finite ({account.status[k]}): {getattr(account, name)[k]}"]
    return []


def _believed(case: Case, epoch: Epoch) -> tuple[Any, list[Failure]]:
    """The arm with the limits that are left of it, and what failed."""
    arm, failures = case.arm, []
    limits = {name: getattr(arm, name) for name in ("v_max", "a_max", "tau_max")}
    for i, fault in epoch.told.items():
        if isinstance(fault, ftqp.Degraded):
            for name, share in fault.shares.items():
                limits[name] = limits[name].copy()
                limits[name][i] *= getattr(fault, share)
            continue
        instant = i in epoch.fresh and getattr(fault, "mode", "") == "instant"
        since = 0.0 if instant else LONG_AGO
        kind = "locked" if isinstance(fault, ftqp.Locked) else "free"
        failures.append(Failure(joint=i, kind=kind, since=since, told=since, jumps=instant))
    return replace(arm, **limits), failures


def _of_epoch(case: Case, account: Account, epoch: Epoch, end: int, begun_wrong: Array) -> list[str]:
    """Limits, and failed joints, of ticks with one belief.

    Args:
        case: The planner and its arm.
        account: What was handed in and came back.
        epoch: What is believed.
        end: The tick after its last one.
        begun_wrong: Which joints a reset, or a failure before they were mended, has put beyond their speed,
            or where they cannot brake in time any more, (nv,); judged from when they are inside again.
    """
    part = slice(epoch.first, end)
    arm, failures = _believed(case, epoch)
    run = Trace(
        dt=case.dt,
        level=case.level,
        q=np.concatenate([account.q_before[part][:1], account.q[part]]),
        v=np.concatenate([account.v_before[part][:1], account.v[part]]),
        sent_q=account.q[part],
        sent_v=account.v[part],
        status=account.status[part],
        target=account.target[part],
        rows=case.rows,
        tolerance=(1.0, 1.0),
        failures=failures,
    )
    _, limits = health(arm, run)
    wrong = (np.abs(run.v[:-1]) > arm.v_max * (1.0 + NEARLY)) | _cannot_brake(run, limits)
    begun_wrong[:] = np.where(
        epoch.again | np.isin(np.arange(len(arm.names)), [*epoch.healed]), wrong[0], begun_wrong
    )
    excused = begun_wrong & np.logical_and.accumulate(wrong, axis=0)
    begun_wrong[:] = excused[-1]
    found = []
    for name in ("speed", "acceleration", "position", "braking"):
        if not case.viable:
            break
        law, sentence = LAWS[name]
        over = law(arm, run, KINEMATIC)
        over = np.where(excused & ((name != "acceleration") | _must(arm, run, limits)), 0.0, over)
        if name == "braking":  # which is a question about a joint that is inside
            over = np.where((run.q[:-1] > arm.q_max) | (run.q[:-1] < arm.q_min), 0.0, over)
        if not (over <= 0.0).all():
            k, i = np.unravel_index(int(np.argmax(over)), over.shape)
            first = epoch.first + int(np.argmax((over > 0.0).any(axis=1)))
            found.append(
                f"{name}: joint {i}: {sentence}: {over[k, i]:.3g} at tick {epoch.first + k} "
                f"({account.status[epoch.first + k]}), first at tick {first}; told {_words(epoch)}"
            )
    return found + _held(case, account, epoch, end)


def _cannot_brake(run: Trace, limits: dict[str, Array]) -> Array:
    """Which joints are outside, or cannot brake before the end of their range, before each tick, (K, nv)."""
    q, v, a = run.q[:-1], run.v[:-1], limits["a_max"]
    way = v * v / (2.0 * a) + np.abs(v) * run.dt
    return (q + np.where(v > 0.0, way, 0.0) > limits["q_max"]) | (
        q - np.where(v < 0.0, way, 0.0) < limits["q_min"]
    )


def _must(arm: Any, run: Trace, limits: dict[str, Array]) -> Array:
    """Which joints leave no command that keeps their acceleration beside what goes before it, (K, nv).

    Those that cannot brake before the end of their range come to rest at it, and are sent no farther; those
    that are faster than they may be are sent no faster than that.
    """
    q, v = run.q[1:], run.v[1:]
    ends = (v == 0.0) & ((q >= limits["q_max"]) | (q <= limits["q_min"]))
    before = np.abs(run.v[:-1])
    return ends | ((before > arm.v_max) & (np.abs(v) < before))


def _words(epoch: Epoch) -> str:
    return "; ".join(f"{i} {fault}" for i, fault in epoch.told.items()) or "nothing"


def _held(case: Case, account: Account, epoch: Epoch, end: int) -> list[str]:
    """A locked joint that has come to rest is held exactly, and one that brakes never speeds up."""
    found = []
    part = slice(epoch.first, end)
    for i, fault in epoch.told.items():
        if not isinstance(fault, ftqp.Locked):
            continue
        v, a, sent = account.v[part, i], account.a[part, i], account.sent_v[part, i]
        before = np.concatenate([account.v_before[part, i][:1], v[:-1]])
        if i in epoch.fresh:  # the first tick begins with what is observed of the joint
            before = np.concatenate([[np.inf], before[1:]])
        stood = before == 0.0
        moved = stood & ((v != 0.0) | (a != 0.0) | (sent != 0.0))
        if moved.any():
            k = int(np.argmax(moved))
            found.append(f"tick {epoch.first + k}: locked joint {i} moves: v {v[k]:.3g}, a {a[k]:.3g}")
        faster = np.abs(v) > np.abs(before) * (1.0 + NEARLY)
        if faster.any():
            k = int(np.argmax(faster))
            found.append(
                f"tick {epoch.first + k}: joint {i}, is being locked and speeds up from {before[k]:.6g} to "
                f"{v[k]:.6g}"
            )
    return found


def _stops(case: Case, account: Account, K: int) -> list[str]:
    """A stop that was asked for is made, and an arm that has stopped stays where it is."""
    found = []
    for k in range(K):
        if account.asked[k] and account.status[k] not in IN_A_STOP:
            found.append(f"tick {k}: a stop was asked for, and the status is {account.status[k]}")
            break
    stopped = np.array([name == "STOPPED" for name in account.status])
    working = np.ones((K, case.robot.nv), dtype=bool)
    for epoch in account.epochs:
        for i, fault in epoch.told.items():
            if not fault.works:
                working[epoch.first :, i] = False
        for i in range(case.robot.nv):
            if i not in epoch.told:
                working[epoch.first :, i] = True
    fast = (np.abs(account.v[:K]) > STANDS * case.arm.v_max) & working & stopped[:, None]
    if case.viable and fast.any():
        k = int(np.argmax(fast.any(axis=1)))
        found.append(f"tick {k}: STOPPED is said of an arm that moves: joint {int(np.argmax(fast[k]))}")
    return found


def _honesty(case: Case, account: Account, K: int, world: Any) -> list[str]:
    """OK is said of what was measured: finite, and the tip within the tolerance of its target."""
    said = np.array([name == "OK" for name in account.status])
    blind = said & ~account.sound[:K]
    found = []
    if blind.any():
        k = int(np.argmax(blind))
        found.append(f"tick {k}: OK is said although what was handed in is not finite, or no pose")
    if case.latency or world.moved:
        return found
    ticks = np.flatnonzero(said & account.sound[:K] & ~account.has_tip[:K])
    if not len(ticks):
        return found
    ticks = ticks[np.linspace(0, len(ticks) - 1, min(LOOKED_AT, len(ticks))).astype(int)]
    q = account.given_q[ticks]
    by_axis = case.rows[-2:] == ("rx", "ry")
    run = Trace(
        dt=case.dt,
        level=case.level,
        q=np.concatenate([q, q[-1:]]),
        v=np.zeros((len(ticks) + 1, case.robot.nv)),
        sent_q=q,
        sent_v=q,
        status=["OK"] * len(ticks),
        target=account.target[ticks],
        rows=case.rows[:3] if by_axis else case.rows,
        tolerance=(case.planner.task.tolerance, case.planner.task.rotation_tolerance),
    )
    distance, turn = errors(case.arm, run)
    if by_axis:  # the direction of the tool, not the turn about it
        axes = case.arm.tips(q)[:, :3, 2], run.target[:, :3, 2]
        turn = np.arcsin(np.clip(np.linalg.norm(np.cross(*axes), axis=1), 0.0, 1.0))
    far = np.maximum(distance / run.tolerance[0], turn / run.tolerance[1])
    if (far > 1.0 + 1e-6).any():
        j = int(np.argmax(far))
        found.append(
            f"tick {ticks[j]}: OK is said although the tip that was measured is {far[j]:.3g} tolerances away"
        )
    return found
