"""How long a step takes in C, beside the same step called from Python: median, tail, page faults and stack.

Run it: python benchmarks/bench_deployed.py [--fifo] (SCHED_FIFO needs the right to it; half a minute)
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import ftqp
from ftqp.app.deployment.built_folder import BuildRequest, build_folder
from ftqp.app.scenario.setup import load
from ftqp.core.clock import now

HERE = Path(__file__).with_name("deployed")
STEPS = 20_000
LEVELS = ("velocity", "acceleration")


def program(planner, folder, source):
    """A program over the library of a planner."""
    build_folder(
        BuildRequest(planner=planner, name="panda", target="host", cpu=None, embed=False, folder=folder)
    )
    made = folder / "timed"
    flags = ["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", f"-I{folder / 'include'}", f"-I{folder}"]
    subprocess.run(
        ["gcc", *flags, HERE / source, folder / "lib" / "libftqp.a", "-lm", "-lpthread", "-o", made],
        check=True,
    )
    return made


def in_c(planner, folder, way):
    """What the program says of the steps of a planner."""
    command = [
        program(planner, folder, "timed.c"),
        folder / "arm.ftqp",
        str(STEPS if way == "free" else 5_000),
        way,
    ]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def of_the_demo(folder):
    """The same of the front page's episode, `ftqp demo brake`: a joint locks, and nobody reports it."""
    setup = load("panda-unannounced")
    made = program(setup.planner, folder, "episode.c")
    log = setup.simulation(log="memory").run().log
    motion = setup.path.sample(np.minimum(log["t"], setup.path.duration))
    targets = ftqp.Targets(motion.pose, motion.twist, motion.acceleration).packed
    (folder / "episode").write_bytes(np.hstack([log["q_measured"], targets]).astype("<f8").tobytes())
    command = [made, folder / "arm.ftqp", folder / "episode"]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def in_python(planner):
    """Median and tail of the same circle called from Python [us]."""
    robot = planner.robot
    t, w = np.arange(STEPS) * planner.dt, 1.5
    pose = np.repeat(robot.pose(robot.neutral)[None], STEPS, axis=0)
    pose[:, 0, 3] += 0.05 * (np.cos(w * t) - 1.0)
    pose[:, 1, 3] += 0.05 * np.sin(w * t)
    twist = np.zeros((STEPS, 6))
    twist[:, 0], twist[:, 1] = -0.05 * w * np.sin(w * t), 0.05 * w * np.cos(w * t)
    targets, q = ftqp.Targets(pose, twist), robot.neutral.copy()
    planner.reset(q)
    took = np.empty(STEPS)
    for k in range(STEPS):
        target = targets.at(k)
        begin = now()
        step = planner.step(q, None, target)
        took[k] = now() - begin
        q[:] = step.q
    took = 1e-3 * took[100:]
    return {"p50": float(np.median(took)), "p999": float(np.quantile(took, 0.999))}


def row(times):
    """Median, tail and their ratio as cells."""
    return f"{times['p50']:.2f} | {times['p999']:.2f} | {times['p999'] / times['p50']:.1f}"


def main(arguments=None):
    """Print a row for each level."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fifo", action="store_true", help="at 1 kHz under SCHED_FIFO, too")
    given = parser.parse_args(arguments)
    print("| Panda, a step [us] | p50 | p99.9 | p99.9/p50 | page faults | stack [kB] |")
    print("|---|---|---|---|---|---|")
    for level in LEVELS:
        for way in ("free", "fifo") if given.fifo else ("free",):
            with tempfile.TemporaryDirectory() as folder:
                planner = ftqp.Planner(ftqp.robots.load("panda"), level=level)
                c = in_c(planner, Path(folder) / "built", way)
            beside = f"{c['page_faults']} | {c['stack'] / 1e3:.1f}"
            print(f"| C, {level} level, {way} | {row(c)} | {beside} |", flush=True)
        p = in_python(ftqp.Planner(ftqp.robots.load("panda"), level=level))
        print(f"| Python, {level} level, free | {row(p)} | | |", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        demo = of_the_demo(Path(folder) / "built")
    print(f"| C, the episode of `ftqp demo brake` | {row(demo)} | | |")
    print(
        f"Before the finding {demo['before']:.2f} us at the median, after it {demo['after']:.2f} us; "
        f"the step that finds the joint and answers takes {demo['reaction']:.0f} us."
    )


if __name__ == "__main__":
    main()
