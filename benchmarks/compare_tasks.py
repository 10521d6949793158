"""Several tasks at once beside pink and placo: where the same examples end, and how long they are.

    python benchmarks/compare_tasks.py              prints the table, and writes it to benchmarks/results
    python benchmarks/compare_tasks.py --quick      few steps, to see that it runs; nothing is written

Four examples as published for these programs (dual arm with a relative frame, look-at, humanoid upper body
with its centre of mass, mobile base), posed on arms that ftqp's catalog has, from its URDFs; their files in
``benchmarks/posed`` are written as the programs' own examples are. Targets stand still and can all be kept,
so that every program has to end at errors of zero. Lines are those of each example's function without its
text. The rows of tasks of one frame are compared with pink's Jacobians of it, at ten random postures.
"""

import argparse
import ast
import inspect
import platform
import subprocess
import sys
import tempfile
from datetime import date
from pathlib import Path

import numpy as np
from bench import results
from posed import with_ftqp
from steps import environments

import ftqp
from ftqp.model.frames import centre_of_mass
from ftqp.model.serial import Inertial

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "results" / "compare_tasks.md"
STEPS, QUICK = 4000, 20
WHO = ("ftqp", "pink", "placo")
EXAMPLES = ("two_hands", "look_at", "upper_body", "mobile_base")
SAYS = {
    "two_hands": "dual arm, relative frame",
    "look_at": "look-at",
    "upper_body": "upper body, centre of mass",
    "mobile_base": "mobile base",
}


def posed(example):
    """The arm of an example and its targets."""
    if example in ("two_hands", "upper_body"):
        robot = ftqp.robots.load("dual_panda")
    else:
        robot = ftqp.robots.load("panda")
    if example == "mobile_base":
        body = Inertial(mass=30.0, com=(0.0, 0.0, 0.1), inertia=np.eye(3))
        robot = robot.on_planar_base(v_max=1.0, a_max=2.0, inertial=body)
    q = np.array(robot.neutral)
    there = q + 0.15 * np.resize([1.0, -1.0, 1.0], robot.nv)  # some posture, whose poses are the targets
    goals = {tip: robot.pose(there, tip) for tip in robot.tips}
    if example == "upper_body":
        goals = {tip: T[:3, 3] for tip, T in goals.items()} | {"mass": centre_of_mass(robot, there)}
    elif example == "look_at":
        T = goals.pop(robot.tip)
        goals = {"place": T[:3, 3], "ball": T[:3, 3] + 0.4 * T[:3, 2]}
    elif example == "mobile_base":
        goals = {"tip": goals[robot.tip], "base": there[:2], "base_place": np.array([*there[:2], 0.0])}
    return robot, q, goals


def errors(example, robot, start, q, goals):
    """The largest error of its tasks [mm and mrad]."""
    if example == "two_hands":
        left, right = robot.tips
        grip = np.linalg.inv(robot.pose(start, left)) @ robot.pose(start, right)
        now = np.linalg.inv(robot.pose(q, left)) @ robot.pose(q, right)
        return max(np.abs(now - grip).max(), np.abs(robot.pose(q, left) - goals[left]).max())
    if example == "look_at":
        T = robot.pose(q)
        way = goals["ball"] - T[:3, 3]
        turned = np.linalg.norm(np.cross(T[:3, 2], way / np.linalg.norm(way)))
        return max(np.abs(T[:3, 3] - goals["place"]).max(), turned)
    if example == "upper_body":
        places = [np.abs(robot.pose(q, tip)[:3, 3] - goals[tip]).max() for tip in robot.tips]
        return max(*places, np.abs(centre_of_mass(robot, q) - goals["mass"])[:2].max())
    return max(np.abs(robot.pose(q) - goals["tip"]).max(), np.abs(q[:2] - goals["base"]).max())


def jacobians(robot, q):
    """Rows of a pose, a relative pose and the centre of mass at their targets, as pink has them, (15, nv)."""
    left, right = robot.tips
    tasks = [ftqp.PoseTask(right), ftqp.RelativeTask(right, left), ftqp.CentreOfMass()]
    planner = ftqp.Planner(robot, level="velocity", tasks=[ftqp.Task(), *tasks])
    planner.reset(q)
    planner.step(q, None, ftqp.Target(pose=robot.pose(q)))
    terms, R = planner._session.K.terms, robot.pose(q, right)[:3, :3]
    pose, relative, mass = np.array(terms.J[:3, :, : robot.nv])
    own = []
    for J in (pose, relative):
        J[3:] /= terms.length  # a radian counts so many metres
        own += [R.T @ J[:3], R.T @ J[3:]]
    return np.vstack([*own, mass[:3]])


def jacobians_apart(folder):
    """The largest difference from pink's, less their signs: a pose, a relative pose, the centre of mass."""
    robot, rng, worst = ftqp.robots.load("dual_panda"), np.random.default_rng(5), np.zeros(3)
    for _ in range(10):
        low, high = robot.limits.q_min, robot.limits.q_max
        q = low + (high - low) * rng.uniform(0.2, 0.8, robot.nv)
        theirs, ours = peers_end("pink", "jacobians", robot, q, {}, 0, folder), jacobians(robot, q)
        for k, rows in enumerate((slice(0, 6), slice(6, 12), slice(12, 15))):
            sign = np.sign((theirs[rows] * ours[rows]).sum())
            worst[k] = max(worst[k], np.abs(theirs[rows] - sign * ours[rows]).max())
    return worst


def lines(peer, example):
    """How many lines the function of an example has, its text aside; None where there is none."""
    tree = ast.parse((HERE / "posed" / f"with_{peer}.py").read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name == example:
            return sum(one.end_lineno - one.lineno + 1 for one in node.body[1:])
    return None


def peers_end(peer, example, robot, q, goals, steps, folder):
    """Where a peer ends."""
    given, answer = folder / f"{peer}_{example}.npz", folder / f"{peer}_{example}.npy"
    np.savez(given, urdf=robot.to_urdf(), joints=list(robot.joints), q=q, steps=steps, **goals)
    python = environments.python_of(
        next(one for one in environments.PEERS if one.name == peer), environments.DEFAULT
    )
    command = [str(python), "-m", "posed.peer_worker", peer, example, str(given), str(answer)]
    subprocess.run(command, cwd=HERE, check=True, timeout=900)
    return np.load(answer)


def main():
    parser = argparse.ArgumentParser(description=inspect.cleandoc(__doc__))
    parser.add_argument("--quick", action="store_true", help="few steps; nothing is written")
    options = parser.parse_args()
    steps = QUICK if options.quick else STEPS
    rows = ["| example | | ftqp | pink | placo |", "|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as name:
        for example in EXAMPLES:
            robot, q, goals = posed(example)
            ends = {"ftqp": getattr(with_ftqp, example)(robot, q, goals, steps)}
            for peer in ("pink", "placo"):
                if lines(peer, example):
                    ends[peer] = peers_end(peer, example, robot, q, goals, steps, Path(name))
            left = {who: errors(example, robot, q, end, goals) for who, end in ends.items()}
            said = [f"{left[who]:.1e}" if who in left else "no such task" for who in WHO]
            rows.append(f"| {SAYS[example]} | largest error left [m, rad] | {' | '.join(said)} |")
            said = [str(lines(who, example) or "-") for who in WHO]
            rows.append(f"| | lines | {' | '.join(said)} |")
            print(rows[-2], rows[-1], sep="\n", flush=True)
        apart = jacobians_apart(Path(name))
    found = ", ".join(f"{one:.1e}" for one in apart)
    said = f"Rows of a pose, a relative pose and the centre of mass differ from pink's by at most {found}."
    print(said)
    if options.quick:
        return
    versions = ", ".join(map(" ".join, results.packages(("numpy", "numba")).items()))
    text = (
        f"# Several tasks beside pink and placo\n\n{inspect.cleandoc(__doc__)}\n\n"
        f"{date.today()}, Python {platform.python_version()}, {versions}; {STEPS} steps of 5 ms.\n\n"
        + "\n".join(rows) + f"\n\n{said}\n"
    )  # fmt: skip
    results.written({"rows": rows}, text, RESULTS.parent, RESULTS.stem)


if __name__ == "__main__":
    sys.exit(main())
