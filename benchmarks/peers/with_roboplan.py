"""roboplan's RRT-Connect among the true meshes, its edges looked at every 0.05 rad as by default."""

from time import process_time
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from roboplan import core, rrt

from peers.asked_ways import LONGEST, answer_all
from peers.true_meshes import BOX, FOLDER, NEVER, SHARE, SRDF, URDF

GREY = np.array([0.5, 0.5, 0.5, 1.0])
NODES = 100_000


def described():
    """The Panda, nothing of whose fingers meets anything."""
    root = ElementTree.parse(URDF).getroot()
    for link in root.findall("link"):
        if "finger" in link.get("name"):
            for body in link.findall("collision"):
                link.remove(body)
    text = ElementTree.tostring(root, encoding="unicode")
    return core.loadUrdfSceneDescriptionFromXml(text, [str(SHARE), str(FOLDER)])


def make():
    """What answers a question."""
    scene = core.Scene("panda", described())
    scene.importSrdf(SRDF.read_text())
    scene.setCollisions(NEVER, False)
    joints = [f"panda_joint{k}" for k in range(1, 8)]
    there = []

    def ask(bodies, start, goal, failed):
        for name in there:
            scene.removeGeometry(name)
        there.clear()
        for k, (kind, *row) in enumerate(bodies):
            place, size, name = np.eye(4, order="F"), np.array(row[6:]), f"thing {k}"
            place[:3, :3], place[:3, 3] = pin.exp3(np.array(row[3:6], float)), row[:3]
            if kind == BOX:
                scene.addBoxGeometry(name, "universe", core.Box(*(2.0 * size)), place, GREY)
            else:
                scene.addCylinderGeometry(
                    name, "universe", core.Cylinder(size[1], 2.0 * size[0]), place, GREY
                )
            for other in ("panda_link0", *there):  # what does not move may touch
                scene.setCollisions(name, other, False)
            there.append(name)
        free = [k for k in range(7) if k not in failed]
        group = "free " + " ".join(map(str, free))
        scene.addGroup(group, [joints[k] for k in free])
        scene.setJointPositions(np.concatenate([start, np.zeros(1)]))
        names = [joints[k] for k in free]
        ends = [core.JointConfiguration(names, np.ascontiguousarray(q[free])) for q in (start, goal)]
        options = rrt.RRTOptions(group, rrt_connect=True, max_nodes=NODES, max_planning_time=LONGEST)
        t = process_time()
        planner = rrt.RRT(scene, options)
        planner.setRngSeed(0)
        try:
            found = planner.plan(*ends)
        except RuntimeError:
            return None, process_time() - t
        taken = process_time() - t
        places = np.tile(start, (len(found.positions), 1))
        places[:, free] = np.array(found.positions)
        return places, taken

    return ask


if __name__ == "__main__":
    answer_all(make(), ("roboplan-rrt", "roboplan-core"))
