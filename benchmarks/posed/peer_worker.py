"""Runs an example in a peer's own environment: peer, example, a file with all, a file for the answer."""

import sys
from importlib import import_module
from pathlib import Path

import numpy as np

FILES = ("urdf", "joints", "q", "steps")


def pink_model(urdf, joints, q):
    import pinocchio as pin

    model = pin.buildModelFromXML(urdf)
    full = pin.neutral(model)
    for name, value in zip(joints, q, strict=True):
        at, joint = model.joints[model.getJointId(name)].idx_q, model.joints[model.getJointId(name)]
        full[at : at + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
    return model, full


def joint_values(model, joints, full):
    found = []
    for name in joints:
        joint = model.joints[model.getJointId(name)]
        part = full[joint.idx_q : joint.idx_q + joint.nq]
        found.append(part[0] if joint.nq == 1 else np.arctan2(part[1], part[0]))
    return found


def main(peer, example, given, answer):
    data = dict(np.load(given, allow_pickle=False))
    goals = {name: value for name, value in data.items() if name not in FILES}
    joints, steps, urdf = [str(name) for name in data["joints"]], int(data["steps"]), str(data["urdf"])
    run = getattr(import_module(f"posed.with_{peer}"), example)
    if example == "jacobians":
        model, q = pink_model(urdf, joints, data["q"])
        order = [model.joints[model.getJointId(name)].idx_v for name in joints]
        np.save(answer, np.vstack([J[:, order] for J in run(model, q)]))
        return
    if peer == "pink":
        model, q = pink_model(urdf, joints, data["q"])
        q = joint_values(model, joints, run(model, q, goals, steps))
    else:
        import placo

        file = Path(given).with_suffix(".urdf")
        file.write_text(urdf, encoding="utf-8")
        robot = placo.RobotWrapper(str(file), placo.Flags.ignore_collisions)
        for name, value in zip(joints, data["q"], strict=True):
            robot.set_joint(name, float(value))
        robot.update_kinematics()
        run(robot, goals, steps)
        q = [robot.get_joint(name) for name in joints]
    np.save(answer, np.array(q))


if __name__ == "__main__":
    main(*sys.argv[1:])
