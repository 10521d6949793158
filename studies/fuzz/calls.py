"""Calls around a step, in any order: those that are allowed, and those that are mistakes."""

import copy
import pickle
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

import ftqp
from fuzz import damage, forms
from fuzz.world import World, last_line

Call = Callable[[World], None]


def _joint(world: World) -> int | str:
    """A joint, by index or by name."""
    i = int(world.rng.integers(world.case.robot.nv))
    return i if world.rng.random() < 0.5 else world.case.robot.joints[i]


def _share(world: World) -> float:
    return float(world.rng.uniform(0.05, 1.0))


def _fault(world: World) -> Any:
    rng, kind = world.rng, int(world.rng.integers(5))
    if kind == 0:
        return ftqp.Locked(_joint(world))
    if kind == 1:
        reset = ("kinematic", "momentum", "task")[int(rng.integers(3 if world.case.robot.has_inertia else 1))]
        return ftqp.Locked(_joint(world), mode="instant", reset=reset)
    if kind == 2 and world.case.robot.has_inertia:
        return ftqp.FreeSwinging(_joint(world), damping=float(rng.uniform(0.0, 5.0)))
    if kind == 3:
        return ftqp.Locked(_joint(world), deceleration=float(10.0 ** rng.uniform(-3.0, 6.0)))
    return ftqp.Degraded(_joint(world), _share(world), _share(world), max(0.6, _share(world)))


def report(world: World) -> None:
    """Believe a fault."""
    if len(world.told) >= 3:
        withdraw(world)
    fault = _fault(world)
    world.both(lambda planner: planner.report(fault))
    world.told[world.case.robot.joint(fault.joint)] = fault
    world.changed = True


def withdraw(world: World) -> None:
    """Believe a joint to be healthy again, mostly one of which something was told."""
    joint = _joint(world)
    if world.told and world.rng.random() < 0.8:
        joint = list(world.told)[int(world.rng.integers(len(world.told)))]
    world.both(lambda planner: planner.withdraw(joint))
    world.told.pop(world.case.robot.joint(joint), None)
    world.changed = True


def reset(world: World) -> None:
    """Begin anew somewhere inside the limits, moving or not."""
    robot, rng = world.case.robot, world.rng
    low, high = robot.limits.q_min, robot.limits.q_max
    spread = np.where(np.isfinite(high - low), high - low, 2.0)
    q = np.clip(robot.neutral + rng.uniform(-0.3, 0.3, robot.nv) * spread, low, high)
    v = rng.uniform(-0.5, 0.5, robot.nv) * robot.limits.v_max if rng.random() < 0.3 else np.zeros(robot.nv)
    given = v if v.any() or rng.random() < 0.5 else None
    world.both(lambda planner: planner.reset(q, given))
    world.begins, world.asked_to_stop = (q, v), False


def reset_anywhere(world: World) -> None:
    """Begin anew outside the limits, or too fast."""
    robot, rng = world.case.robot, world.rng
    q = robot.neutral + rng.normal(0.0, 10.0 ** rng.uniform(-1.0, 1.0), robot.nv)
    v = robot.limits.v_max * rng.normal(0.0, 3.0, robot.nv)
    world.both(lambda planner: planner.reset(q, v))
    world.begins, world.asked_to_stop = (q, v), False


def stop(world: World) -> None:
    """Ask for a stop."""
    world.both(lambda planner: planner.stop())
    world.asked_to_stop = True


def resume(world: World) -> None:
    """Go on after a stop, if the planner lets one."""
    if world.both(lambda planner: planner.resume()):
        world.asked_to_stop = False


def speed(world: World) -> None:
    """Lead the arm more slowly."""
    share = _share(world)
    world.both(lambda planner: setattr(planner, "speed", share))


def carry(world: World) -> None:
    """Take a load, or put it down."""
    rng = world.rng
    load = None
    if rng.random() < 0.6:
        load = ftqp.Payload(float(10.0 ** rng.uniform(-3.0, 1.0)), tuple(rng.normal(0.0, 0.1, 3)))
    if world.case.robot.has_inertia:
        world.both(lambda planner: planner.carry(load))
        world.fitted = True
    elif load is not None:
        world.refused("carry", lambda: world.planner.carry(load))


def tool(world: World) -> None:
    """Control another point."""
    T = np.eye(4)
    T[:3, 3] = world.rng.normal(0.0, 0.1, 3)
    given = T if world.rng.random() < 0.7 else None
    world.both(lambda planner: planner.tool(given))
    world.fitted = world.moved = True


WRONG_JOINTS: tuple[Any, ...] = ("elbow", "", -1, 99, 1.5, None, True, (0,), 2**70, b"j1", np.nan, "\uff10")
WRONG_FAULTS: tuple[Any, ...] = (None, "locked", 3, {"kind": "locked", "joint": 0}, ftqp.Locked, object())
WRONG_NUMBERS: tuple[Any, ...] = (np.nan, np.inf, -1.0, 0.0, 1e309, "fast", None, [0.5], 1 + 1j, "1_000")


def _pick(world: World, values: tuple[Any, ...]) -> Any:
    return values[int(world.rng.integers(len(values)))]


def wrong_report(world: World) -> None:
    """Report what is no fault, or of no joint."""
    if world.rng.random() < 0.5:
        fault = _pick(world, WRONG_FAULTS)
        world.refused(f"report({fault!r:.40})", lambda: world.planner.report(fault))
        return
    joint = _pick(world, WRONG_JOINTS)
    world.refused(f"report(Locked({joint!r}))", lambda: world.planner.report(ftqp.Locked(joint)))


def wrong_withdraw(world: World) -> None:
    """Withdraw of no joint."""
    joint = _pick(world, WRONG_JOINTS)
    world.refused(f"withdraw({joint!r})", lambda: world.planner.withdraw(joint))


def wrong_reset(world: World) -> None:
    """Begin where nobody can be: nothing has changed then."""
    n = world.case.robot.nv
    good = world.case.robot.neutral
    name = _pick(world, tuple(forms.MISTAKES))
    if name.startswith("one too") and world.case.robot.nq in (n - 1, n + 1):
        return
    wrong = forms.MISTAKES[name](good)
    kind = _pick(world, ("q", "v", "nan"))
    if kind == "nan":
        value = _pick(world, (np.nan, np.inf, -np.inf))
        world.refused("reset(not finite)", lambda: world.planner.reset(np.full(n, value)))
    elif kind == "q":
        world.refused(f"reset(q {name})", lambda: world.planner.reset(wrong))
    else:
        world.refused(f"reset(v {name})", lambda: world.planner.reset(good, wrong))


def wrong_speed(world: World) -> None:
    """A share of the speed that is none."""
    share = _pick(world, (*WRONG_NUMBERS, 1.0000001, True and "half"))
    world.refused(f"speed = {share!r}", lambda: setattr(world.planner, "speed", share), "speed")


def wrong_load(world: World) -> None:
    """A load or tool that is none."""
    n = _pick(world, WRONG_NUMBERS)
    ways: tuple[tuple[str, Callable[[], Any]], ...] = (
        (f"Payload({n!r})", lambda: ftqp.Payload(n if n != 0.0 else -0.5)),
        ("Payload(com)", lambda: ftqp.Payload(1.0, (np.nan, 0.0, 0.0))),
        ("Payload(com shape)", lambda: ftqp.Payload(1.0, (0.0, 0.0))),
        ("carry(3)", lambda: world.planner.carry(3.0)),
        ("carry(class)", lambda: world.planner.carry(ftqp.Payload)),
        ("tool(NaN)", lambda: world.planner.tool(np.full((4, 4), np.nan))),
        ("tool(no rotation)", lambda: world.planner.tool(np.diag([1.0, 1.0, -1.0, 1.0]))),
        ("tool(shape)", lambda: world.planner.tool(np.eye(3))),
        ("tool(words)", lambda: world.planner.tool("hand")),
    )
    name, call = ways[int(world.rng.integers(len(ways)))]
    world.refused(name, call)


def wrong_fault(world: World) -> None:
    """A fault with numbers that are none."""
    n = _pick(world, WRONG_NUMBERS[:-1])
    ways: tuple[tuple[str, Callable[[], Any]], ...] = (
        (f"Locked(deceleration={n!r})", lambda: ftqp.Locked(0, deceleration=-1.0 if n is None else n)),
        (f"Degraded(velocity={n!r})", lambda: ftqp.Degraded(0, velocity=n)),
        (f"FreeSwinging(damping={n!r})", lambda: ftqp.FreeSwinging(0, damping=-1.0 if n == 0.0 else n)),
        ("Degraded(q_min > q_max)", lambda: ftqp.Degraded(0, q_min=1.0, q_max=-1.0)),
        ("Degraded(q_min nan)", lambda: ftqp.Degraded(0, q_min=np.nan)),
        ("Locked(mode)", lambda: ftqp.Locked(0, mode=_pick(world, ("soft", None, 3, ["ramp"])))),
    )
    name, call = ways[int(world.rng.integers(len(ways)))]
    world.refused(name, call)


def wrong_target(world: World) -> None:
    """Targets that are none, and mistakes with one that is: nothing of it is written then."""
    target, rng = world.target, world.rng
    before = target.packed.copy()
    wrong = forms.MISTAKES[_pick(world, tuple(forms.MISTAKES))](before[:16])
    shown = f"{type(wrong).__name__} {wrong!r:.40}"
    if np.shape(before[:16]) == (16,) and rng.random() < 0.5:
        ways: tuple[tuple[str, Callable[[], Any]], ...] = (
            (f"Target(pose={shown})", lambda: ftqp.Target(pose=() if wrong is None else wrong)),
            (f"Target.at({shown})", lambda: target.at(wrong)),
            (f"target.pose = {shown}", lambda: setattr(target, "pose", wrong)),
            (f"target.twist = {shown}", lambda: setattr(target, "twist", wrong)),
            (f"Target.at(twist={shown})", lambda: target.at(target.pose, () if wrong is None else wrong)),
        )
    else:
        ways = (
            ("Target()", ftqp.Target),
            ("Target(both)", lambda: ftqp.Target(pose=np.eye(4), position=np.zeros(3))),
            ("Target(mirrored)", lambda: ftqp.Target(pose=np.diag([1.0, 1.0, -1.0, 1.0]))),
            ("Target(twist alone)", lambda: ftqp.Target(twist=np.zeros(6))),
            ("Target(stamp)", lambda: ftqp.Target(pose=np.eye(4), stamp=1.0)),
            ("Targets(wrong)", lambda: ftqp.Targets(wrong)),
            ("Targets(twist)", lambda: ftqp.Targets(np.eye(4)[None], np.zeros((2, 6)))),
            ("Targets.at", lambda: ftqp.Targets(np.eye(4)[None]).at(7)),
        )
    name, call = ways[int(rng.integers(len(ways)))]
    world.refused(name, call)
    if before.tobytes() != target.packed.tobytes():
        world.wrong.append(f"{name}: the target was written although it was refused")
        target.packed[:] = before


def no_copies(world: World) -> None:
    """A planner is neither copied nor pickled, and says so."""
    way = _pick(world, (copy.copy, copy.deepcopy, pickle.dumps))
    try:
        way(world.planner)
    except TypeError as error:
        if "neither copied nor pickled" not in str(error):
            world.wrong.append(f"{way.__name__} of a planner: {last_line(error)}")
    except Exception as error:  # anything else is not what is promised
        world.wrong.append(f"{way.__name__} of a planner: {last_line(error)}")
    else:
        world.wrong.append(f"{way.__name__} of a planner was made")


def copied_target(world: World) -> None:
    """Go on with a copy of the target."""
    target, way = world.target, int(world.rng.integers(4))
    if way == 0:
        world.target = copy.copy(target)
    elif way == 1:
        world.target = copy.deepcopy(target)
    elif way == 2:
        world.target = pickle.loads(pickle.dumps(target))
    else:
        world.target = ftqp.Target(pose=np.eye(4)) if target.packed[-1] else ftqp.Target(position=np.zeros(3))
        world.target.packed[:] = target.packed
    if world.target.packed.tobytes() != target.packed.tobytes():
        world.wrong.append("a copy of a target differs")


def facts(world: World) -> None:
    """Read everything that can be read of a planner between steps; nothing changes."""
    planner = world.planner
    for name in ("backend", "task_rows", "tick", "faults", "stopped_because", "speed", "pace", "disturbance",
                 "payload", "diagnosis", "findings", "plan", "plan_time"):  # fmt: skip
        getattr(planner, name)
    planner.session()
    planner.view()
    repr(planner)


def threads(world: World) -> None:
    """Two threads call what belongs to neither of them; then everybody begins anew."""
    robot, planner = world.case.robot, world.planner
    q, trouble = robot.neutral, []
    target = ftqp.Target(pose=robot.pose(q))

    def user(seed: int) -> None:
        rng = np.random.default_rng(seed)
        try:
            for _ in range(20):
                step = planner.step(q + rng.normal(0.0, 1e-4, robot.nv), None, target)
                kept = step.copy()
                pickle.dumps(step)
                if not (np.isfinite(kept.q).all() and np.isfinite(kept.v).all()):
                    trouble.append("a command is not finite")
                repr(step), step.limits_active, step.tau, step.outside
                if rng.random() < 0.1:
                    planner.stop()
        except Exception as error:  # in a thread nobody would see it
            trouble.append(last_line(error))

    world.both(lambda planner: planner.reset(q))
    seeds = world.rng.integers(2**31, size=2)
    users = [threading.Thread(target=user, args=(int(seed),)) for seed in seeds]
    for one in users:
        one.start()
    for one in users:
        one.join()
    world.wrong += [f"threads: {what}" for what in trouble]
    world.both(lambda planner: planner.reset(q))
    world.begins, world.asked_to_stop = (q, np.zeros(robot.nv)), False


CALLS: tuple[tuple[Call, float], ...] = (
    (report, 3.0),
    (withdraw, 3.0),
    (reset, 2.0),
    (reset_anywhere, 0.5),
    (stop, 1.0),
    (resume, 4.0),
    (speed, 1.0),
    (carry, 0.03),
    (tool, 0.03),
    (wrong_report, 1.0),
    (wrong_withdraw, 1.0),
    (wrong_reset, 1.0),
    (wrong_speed, 1.0),
    (wrong_load, 1.0),
    (wrong_fault, 1.0),
    (wrong_target, 2.0),
    (no_copies, 0.3),
    (copied_target, 2.0),
    (facts, 1.0),
    (threads, 0.02),
)
"""Calls, and how often each is made beside the others."""
POINTS = np.cumsum([weight for _, weight in CALLS])
POINTS /= POINTS[-1]


def make(world: World) -> str:
    """Make a random call; what raises that should not is wrong."""
    call, _ = CALLS[int(np.searchsorted(POINTS, world.rng.random()))]
    name = call.__name__
    world.done[name] = world.done.get(name, 0) + 1
    try:
        call(world)
    except Exception as error:  # a call that is allowed has raised: that is a result, not to be hidden
        world.wrong.append(f"{name}: {last_line(error)}")
    return name


__all__ = ["CALLS", "damage", "make"]
