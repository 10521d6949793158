"""The planner without Python: whether what ``ftqp build`` makes gives Python's commands, and bears anything.

Random arms of 3 to 32 joints go along random ways, fail, are repaired, stopped, reset, loaded, given tools
and late, among things that move, in Python; the library replays what they were told and given. ``--fuzz N``
gives it N changed files and calls in any order, with the sanitizers of gcc.

Run it: python studies/deployed_library.py --target host --episodes 1000 (a minute or two)
"""

import argparse
import logging
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from functools import cache
from itertools import count, islice
from pathlib import Path

import numpy as np

import ftqp
from ftqp.app.deployment.built_folder import TEXTS, BuildRequest, build_folder
from ftqp.app.deployment.headers import SMALL, arm_file, layout_header
from ftqp.kernel.layout.enums import JOINTS

HERE = Path(__file__).with_name("deployed")
ARMS = (
    ("panda", {}), ("iiwa14", {}), ("xarm7", {}), ("planar6", {}), ("srs7", {}), ("modular11", {}),
    ("planar", {"count": 3}), ("planar", {"count": 12}), ("planar", {"count": 32}),
)  # fmt: skip
DT = 1e-3
STEPS = 120
"""Steps of an episode."""
ACCURACY = 1e-12
"""Largest difference of a command on another processor [rad or m]."""
TRIALS = 8
"""How often rounding is tried on this machine."""
MORE = 3.0
"""By how much another processor may differ more than those trials do, which are few."""
END, RESET, STEP, REPORT, WITHDRAW, STOP, RESUME, CARRY, TOOL, MOVE = range(10)
RESETS = ("kinematic", "momentum", "task")
KINDS = {"locked": 1, "free_swinging": 2, "degraded": 3}


@dataclass
class Episode:
    """What a planner was told and given, and what it answered.

    Attributes:
        name: Of the arm, and what else was drawn.
        file: Its arm.ftqp.
        joints: How many it has.
        stream: What it was told and given.
        answers: What Python answered.
        commands: Where the positions to be sent begin in it.
    """

    name: str
    file: bytes
    joints: int
    stream: list[float] = field(default_factory=list)
    answers: list[float] = field(default_factory=list)
    commands: list[int] = field(default_factory=list)


def drawn_fault(robot, rng):
    """A fault of a joint."""
    joint = int(rng.integers(robot.nv))
    kind = int(rng.integers(4))
    if kind == 0:
        return ftqp.Locked(joint, deceleration=None if rng.random() < 0.5 else float(rng.uniform(0.5, 5.0)))
    if kind == 1:
        return ftqp.Locked(joint, mode="instant", reset=RESETS[int(rng.integers(3))])
    if kind == 2 and robot.has_inertia:
        return ftqp.FreeSwinging(
            joint, damping=float(rng.uniform(0.0, 1.0)), friction=float(rng.uniform(0.0, 0.5))
        )
    return ftqp.Degraded(
        joint, velocity=float(rng.uniform(0.3, 1.0)), acceleration=float(rng.uniform(0.5, 1.0)),
        torque=float(rng.uniform(0.1, 1.0)),
        q_min=None if rng.random() < 0.5 else float(robot.limits.q_min[joint]) - 1.0,
    )  # fmt: skip


def said(fault):
    """A fault as ``ftqp_fault`` has it."""
    numbers = [fault.joint, KINDS[fault.kind], 0, 0, np.nan, 0.0, 0.0, 1.0, 1.0, 1.0, np.nan, np.nan]
    if isinstance(fault, ftqp.Locked):
        numbers[2:4] = ("ramp", "instant").index(fault.mode), RESETS.index(fault.reset)
        numbers[4] = np.nan if fault.deceleration is None else fault.deceleration
    elif isinstance(fault, ftqp.FreeSwinging):
        numbers[5:7] = fault.damping, fault.friction
    else:
        ends = [np.nan if end is None else end for end in (fault.q_min, fault.q_max)]
        numbers[7:] = [fault.velocity, fault.acceleration, fault.torque, *ends]
    return [float(number) for number in numbers]


@cache
def arm(at):
    """An arm of the list."""
    name, options = ARMS[at]
    return ftqp.robots.load(name, **options)


def drawn_planner(rng):
    """A planner of a random arm, and what it is called."""
    robot = arm(int(rng.integers(len(ARMS))))
    name = robot.name
    level = ("acceleration", "velocity")[int(rng.integers(2))]
    schemes = ("mvn", "man", "rmp", "dlsm") if level == "acceleration" else ("mvn", "rmp")
    scheme = schemes[int(rng.integers(len(schemes)))]
    mode = ("slack", "slack", "hard", "scaled", "lexicographic")[int(rng.integers(5))]
    drive = ("position", "velocity", "torque")[int(rng.integers(3))] if robot.has_inertia else "position"
    degrades = rng.random() < 0.2 and robot.nv > 5 and "planar" not in name
    task = ftqp.Task(mode=mode, degrade=("position_axis", "position") if degrades else None)
    scene = None
    if name in ("panda", "iiwa14") and rng.random() < 0.3:
        scene = ftqp.Scene()
        tip = robot.pose(robot.neutral)[:3, 3]
        scene.add("ball", ftqp.Sphere(radius=0.05, place=tip + np.array([0.0, 0.16, 0.0])))
    planner = ftqp.Planner(robot, DT, level=level, scheme=scheme, task=task, drive=drive, scene=scene)
    return planner, f"{robot.name} {level} {scheme} {mode} {drive}"


def tool(rng):
    """A pose near the frame that it is in."""
    T = np.eye(4)
    angle = float(rng.uniform(-1.0, 1.0))
    T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    T[:3, 3] = rng.uniform(-0.05, 0.05, 3)
    return T


def run(seed, capacity=JOINTS):
    """An episode in Python; None of an arm for which a library of this capacity has no room."""
    rng, beside = np.random.default_rng(seed), np.random.default_rng([seed, 1])
    while True:
        try:
            planner, name = drawn_planner(rng)
            break
        except ftqp.InputError:
            continue
    robot = planner.robot
    n = robot.nv
    if n > capacity:
        return None
    episode = Episode(f"seed {seed}: {name}", arm_file(planner.deployable(), n, capacity), n)
    add, answer = episode.stream.extend, episode.answers.append
    limits = robot.limits
    low, high = np.maximum(limits.q_min, -3.0), np.minimum(limits.q_max, 3.0)
    q = np.clip(robot.neutral + rng.uniform(-0.2, 0.2, n), low, high)
    path = ftqp.paths.Circle(
        robot.pose(q), radius=float(rng.uniform(0.01, 0.2)), duration=float(rng.uniform(0.2, 4.0))
    )
    motion = path.sample(np.arange(6 * STEPS) * DT)
    targets = ftqp.Targets(motion.pose, motion.twist, motion.acceleration)

    def reset(q):
        v = rng.uniform(-0.1, 0.1, n) * (rng.random() < 0.5)
        planner.reset(q, v)
        add([RESET, *q, *v])
        answer(0.0)

    reset(q)
    k = 0
    for _ in range(STEPS):
        chance = rng.random()
        if chance < 0.02:
            fault = drawn_fault(robot, rng)
            try:
                planner.report(fault)
            except ftqp.InputError:
                continue
            add([REPORT, *said(fault)])
            answer(0.0)
        elif chance < 0.03 and planner.faults:
            joint = robot.joint(next(iter(planner.faults)))
            planner.withdraw(joint)
            add([WITHDRAW, joint])
            answer(0.0)
        elif chance < 0.035:
            planner.stop()
            add([STOP])
            answer(0.0)
        elif chance < 0.05:
            add([RESUME])
            answer(float(planner.resume()))
        elif chance < 0.055:
            reset(q)
        elif chance < 0.065 and robot.has_inertia:
            mass, com = float(rng.uniform(0.1, 1.0)) * (rng.random() < 0.7), rng.uniform(-0.05, 0.05, 3)
            inertia = np.diag([1e-3, 1e-3, 1.5e-3]) * (rng.random() < 0.5)
            planner.carry(ftqp.Payload(mass=mass, com=com, inertia=inertia) if mass else None)
            add([CARRY, mass, *com, *inertia.ravel()])
            answer(0.0)
        if beside.random() < 0.02:
            T = tool(beside)
            planner.tool(T)
            add([TOOL, *T.ravel()])
            answer(0.0)
        if planner.scene and beside.random() < 0.05:
            T, twist = tool(beside), beside.uniform(-0.3, 0.3, 6)
            T[:3, 3] = 2.0 * T[:3, 3] + planner.scene["ball"].place[:3, 3]
            planner.scene.move("ball", T, twist)
            add([MOVE, 0, *T.ravel(), *twist])
            answer(0.0)
        gap = int(rng.integers(2, 7)) if rng.random() < 0.1 else 1
        k += gap
        target = targets.at(k).packed[k].copy()
        if rng.random() < 0.01:
            target[int(rng.integers(28))] = np.nan
        measured = q + rng.normal(0.0, 1e-5, n) * (rng.random() < 0.3)
        if rng.random() < 0.01:
            measured[int(rng.integers(n))] += float(rng.choice([np.nan, 0.5, 1e6]))
        given = ftqp.Target(pose=np.eye(4))
        given.packed[:] = target
        step = planner.step(measured, None, given, ticks=gap)
        add([STEP, *measured, *target, gap])
        episode.commands.append(len(episode.answers) + 1)
        episode.answers.extend([float(step.code), *step.q, *step.v, *step.a, *step.tau, step.position_error])
        q = step.q.copy()
    add([END])
    return episode


def library(target, folder, *, small=False):
    """Build the library of a target once: the folder that ``ftqp build`` writes."""
    planner = ftqp.Planner(ftqp.robots.load("planar", count=3))
    named = {"planner": planner, "name": "planar(3)", "target": target, "cpu": None, "embed": False}
    build_folder(BuildRequest(**named, folder=folder, small=small))
    return folder


def whole_library(folder):
    """Build a library with all that it can have: the folder that ``ftqp build`` writes."""
    robot = ftqp.robots.load("panda")
    task = ftqp.Task(mode="scaled")
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(radius=0.05, place=(0.0, 0.9, 0.3)))
    tasks = [ftqp.PostureTask(), ftqp.PoseTask("panda_joint4")]
    planner = ftqp.Planner(
        robot, drive="torque", task=task, detector=ftqp.Detector(), scene=scene, tasks=tasks, remember=1.0
    )
    path = ftqp.paths.Circle(robot.pose(robot.neutral), radius=0.1, duration=2.0)
    named = {"planner": planner, "name": "panda", "target": "host", "cpu": None, "embed": False}
    build_folder(BuildRequest(**named, folder=folder, path=path))
    return folder


def zig(*arguments):
    """Run zig."""
    subprocess.run([sys.executable, "-m", "ziglang", *map(str, arguments)], check=True)


def replayer(target, folder):
    """The command that replays an episode, but for the arm's file; None where it cannot be run."""
    program = folder / "replayed"
    headers = [f"-I{folder / 'include'}", "-Wall", "-Wextra", "-Werror", "-pedantic", "-std=c11", "-O2"]
    if target == "wasm32":
        node = shutil.which("node")
        shutil.copy(HERE / "replayed.mjs", folder)
        loader = folder / "lib" / "ftqp.mjs"
        return node and [node, str(folder / "replayed.mjs"), str(loader), str(folder / "lib" / "ftqp.wasm")]
    if target == "aarch64":
        qemu = shutil.which("qemu-aarch64") or shutil.which("qemu-aarch64-static")
        made = [HERE / "replayed.c", folder / "lib" / "libftqp.a", "-static", "-lm", "-o", program]
        zig("cc", "-target", "aarch64-linux-musl", *headers, *made)
        return qemu and [qemu, str(program)]
    cc = shutil.which("cc") or shutil.which("gcc")
    shared = [f"-L{folder / 'lib'}", "-lftqp", f"-Wl,-rpath,{folder / 'lib'}", "-lm"]
    subprocess.run([cc, *headers, HERE / "replayed.c", *shared, "-o", program], check=True)
    return [str(program)]


def replayed(command, episode, folder):
    """What a library answers to an episode."""
    arm = folder / "episode.ftqp"
    arm.write_bytes(episode.file)
    stream = np.array(episode.stream, dtype="<f8").tobytes()
    done = subprocess.run([*command, str(arm)], input=stream, capture_output=True, check=False)
    if done.returncode:
        raise RuntimeError(
            f"{episode.name}: the program ended with {done.returncode}: {done.stderr.decode()[-300:]}"
        )
    return np.frombuffer(done.stdout, dtype="<f8")


def difference(episode, answers):
    """The largest difference of a position to be sent, and whether all is equal; NaN equals NaN."""
    wanted = np.array(episode.answers)
    if wanted.shape != answers.shape:
        return np.inf, False
    both = np.isnan(wanted) & np.isnan(answers)
    apart = np.where(both, 0.0, np.abs(wanted - answers))
    sent = np.add.outer(np.array(episode.commands), np.arange(episode.joints))
    worst = float(np.nan_to_num(apart[sent], nan=np.inf).max())
    return worst, bool((both | (wanted == answers)).all())


def felt(episode, command, folder):
    """The largest difference that rounding makes on this machine itself.

    Every measured position is moved by one unit in its last place, at random up or down, TRIALS times.
    """
    rng, n, worst = np.random.default_rng(0), episode.joints, 0.0
    answers = np.array(episode.answers)
    sent = np.add.outer(np.array(episode.commands), np.arange(n))
    lengths = {
        RESET: 2 * n, STEP: n + 30, REPORT: 12, WITHDRAW: 1, STOP: 0, RESUME: 0, CARRY: 13, TOOL: 16,
        MOVE: 23,
    }  # fmt: skip
    for _ in range(TRIALS):
        stream, at = np.array(episode.stream), 0
        while stream[at] != END:
            if stream[at] in (RESET, STEP):
                q = stream[at + 1 : at + 1 + n]
                q[:] = np.nextafter(q, rng.choice([-np.inf, np.inf], n))
            at += 1 + lengths[int(stream[at])]
        moved = Episode(episode.name, episode.file, n, stream, episode.answers, episode.commands)
        apart = np.abs(replayed(command, moved, folder)[sent] - answers[sent])
        worst = max(worst, float(np.nan_to_num(apart, nan=np.inf).max()))
    return worst


def compare(target, episodes, seed=0, folder=None, *, small=False):
    """Compare episodes, of a small library those of arms of up to 8 joints.

    What is returned: how many were equal, within ACCURACY, the largest difference, whose; of those beyond,
    how many are within MORE of what rounding makes on this machine, and the names of the others.
    """
    with tempfile.TemporaryDirectory() as own:
        folder = library(target, Path(own) / "built", small=small) if folder is None else folder
        command = replayer(target, folder)
        if not command:
            return None
        equal, near, worst, who, as_rounding, others = 0, 0, 0.0, "", 0, []
        own_command = None
        drawn = (run(k, SMALL[0] if small else JOINTS) for k in count(seed))
        for episode in islice((one for one in drawn if one is not None), episodes):
            apart, same = difference(episode, replayed(command, episode, folder))
            equal += same
            near += apart <= ACCURACY
            if apart > worst:
                worst, who = apart, episode.name
            if apart > ACCURACY:
                here = Path(own) / "here"
                own_command = own_command or replayer("host", library("host", here))
                plain = run(int(episode.name.split()[1][:-1])) if small else episode
                if apart <= MORE * felt(plain, own_command, here):
                    as_rounding += 1
                else:
                    others.append(f"{episode.name}, {apart:.2g}")
        return equal, near, worst, who, as_rounding, others


def fuzz(files, seed=0):
    """Changed files and calls in any order, under the sanitizers: what the program printed."""
    with tempfile.TemporaryDirectory() as own:
        folder = whole_library(Path(own) / "built")
        (Path(own) / "layout.h").write_text(layout_header(), encoding="utf-8")
        program = Path(own) / "fuzzed"
        checked = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-O1", "-g"]
        strict = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-pedantic"]
        strict += ["-DFTQP_WITH_PATH"]
        subprocess.run(
            ["gcc", *strict, *checked, f"-I{TEXTS}", f"-I{own}", HERE / "fuzzed.c", TEXTS / "ftqp.c",
             folder / "lib" / "libftqp.a", "-lm", "-o", program], check=True,
        )  # fmt: skip
        arm = folder / "arm.ftqp"
        done = subprocess.run(
            [program, arm, str(files), str(seed)], capture_output=True, text=True, check=True
        )
        return done.stdout.strip()


def main(arguments=None):
    """Compare or fuzz, and say what was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--target", default="host", choices=("host", "x86-64-v3", "aarch64", "wasm32"))
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--small", action="store_true", help="the library of `ftqp build --small`")
    parser.add_argument("--fuzz", type=int, default=0, metavar="N", help="change N files instead")
    given = parser.parse_args(arguments)
    if given.fuzz:
        print(fuzz(given.fuzz, given.seed))
        return 0
    logging.getLogger("ftqp").setLevel(logging.ERROR)
    os.environ.setdefault("QEMU_CPU", "max")
    found = compare(given.target, given.episodes, given.seed, small=given.small)
    if found is None:
        print(f"LEFT OUT: nothing here runs programs for {given.target}")
        return 0
    equal, near, worst, who, as_rounding, others = found
    print(
        f"{given.target}: {equal} of {given.episodes} episodes equal bit by bit, {near} within {ACCURACY:g}, "
        f"largest difference {worst:.3g} ({who})"
    )
    if near < given.episodes:
        print(f"of those beyond, {as_rounding} within {MORE:g} times what rounding makes on this machine")
    for name in others:
        print(f"beyond that: {name}")
    return int(given.target == "host" and not given.small and equal < given.episodes)


if __name__ == "__main__":
    raise SystemExit(main())
