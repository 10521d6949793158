"""MuJoCo in the loop from C: a program that links the wheel's libmujoco logs what Python logs, bit by bit.

A Panda with servos on positions goes along a line; half-way the brake of a joint closes, and the planner is
told.

Run it: python studies/deployed_physics.py (needs gcc and the extra 'sim')
"""

import subprocess
import tempfile
from pathlib import Path

import mujoco
import numpy as np
from deployed_library import library

import ftqp
from ftqp.app.deployment.arm_file import arm_file

HERE = Path(__file__).with_name("deployed")
STEPS, BRAKES = 2000, 2
STIFFNESS, DAMPING = 4000.0, 200.0
"""Of the servos [N m/rad] and [N m s/rad]."""


def model_file(robot, folder):
    """A MuJoCo model of the arm with servos on positions, as a file."""
    spec = mujoco.MjSpec.from_string(robot.to_urdf())
    spec.option.timestep = 1e-3
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for name in robot.joints:
        servo = spec.add_actuator(name=f"{name} servo", target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.gainprm[0], servo.biasprm[:3] = STIFFNESS, [0.0, -STIFFNESS, -DAMPING]
        servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    spec.compile()
    file = folder / "arm.xml"
    file.write_text(spec.to_xml(), encoding="utf-8")
    return file


def in_python(file, robot, target):
    """Measured positions of every step, (STEPS, nv)."""
    m = mujoco.MjModel.from_xml_path(str(file))
    d = mujoco.MjData(m)
    planner = ftqp.Planner(robot, 1e-3)
    d.qpos[:] = robot.neutral
    planner.reset(d.qpos.copy())
    x, log = float(target.pose[0, 3]), np.empty((STEPS, robot.nv))
    for k in range(STEPS):
        if k == STEPS // 2:
            m.dof_frictionloss[BRAKES] = 1e3
            planner.report(ftqp.Locked(BRAKES))
        target.pose[0, 3] = x + 0.02 * (1e-3 * k)
        d.ctrl[:] = planner.step(d.qpos.copy(), None, target).q
        mujoco.mj_step(m, d)
        log[k] = d.qpos
    return log


def in_c(file, robot, target, folder):
    """The same of the program in C."""
    built, where = library("host", folder / "built"), Path(mujoco.__file__).parent
    shared = next(where.glob("libmujoco.so*"))
    program, arm = folder / "in_physics", folder / "panda.ftqp"
    arm.write_bytes(arm_file(ftqp.Planner(robot, 1e-3).deployable(), robot.nv))
    flags = [
        "-std=c11",
        "-O2",
        "-Wall",
        "-Wextra",
        "-Werror",
        f"-I{built / 'include'}",
        f"-I{where / 'include'}",
    ]
    linked = [built / "lib" / "libftqp.a", shared, f"-Wl,-rpath,{where}", "-lm"]
    subprocess.run(["gcc", *flags, HERE / "in_physics.c", *linked, "-o", program], check=True)
    given = target.packed.tobytes() + robot.neutral.tobytes()
    command = [program, file, arm, str(STEPS), str(BRAKES)]
    done = subprocess.run(command, input=given, capture_output=True, check=True)
    return np.frombuffer(done.stdout).reshape(STEPS, robot.nv)


def main():
    """Say whether both logs are the same."""
    robot = ftqp.robots.load("panda")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = model_file(robot, folder)
        logs = [
            make(file, robot, ftqp.Target(pose=robot.pose(robot.neutral)), *more)
            for make, more in ((in_python, ()), (in_c, (folder,)))
        ]
    after = float(np.abs(np.diff(logs[0][STEPS // 2 + 300 :, BRAKES])).max())
    same = bool((logs[0] == logs[1]).all())
    apart = float(np.abs(logs[0] - logs[1]).max())
    said = "the same log bit by bit" if same else f"logs differ by {apart:.3g} rad"
    print(
        f"{STEPS} steps in MuJoCo {mujoco.__version__}: {said}; the braked joint moves {after:.2g} rad a step"
    )
    return int(not same)


if __name__ == "__main__":
    raise SystemExit(main())
