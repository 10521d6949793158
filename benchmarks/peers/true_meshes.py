"""The true meshes of the Panda and what is around it, measured by coal; they know nothing of ftqp's bodies.

The meshes are those of the package example-robot-data, the fingers left out.
"""

from pathlib import Path
from xml.etree import ElementTree

import coal
import numpy as np
import pinocchio as pin

import ftqp
from ftqp.model.collision_geometry import around

SHARE = Path(pin.__file__).parents[4] / "share"
FOLDER = SHARE / "example-robot-data/robots"
NEVER = [("panda_hand", f"panda_link{k}") for k in (5, 6, 7)]
BOX = 2


class Judge:
    """The true meshes: how near the arm is to a scene and to itself."""

    def __init__(self):
        urdf, share = str(FOLDER / "panda_description/urdf/panda.urdf"), [str(SHARE), str(FOLDER)]
        model = pin.buildModelFromUrdf(urdf)
        geometry = pin.buildGeomFromUrdf(model, urdf, pin.GeometryType.COLLISION, package_dirs=share)
        held = [model.getJointId(name) for name in model.names if "finger" in name]
        self.model, geometry = pin.buildReducedModel(model, geometry, held, pin.neutral(model))
        self.data = self.model.createData()
        self.bodies = [one for one in geometry.geometryObjects if "finger" not in one.name]
        self.names = [one.name.rsplit("_", 1)[0] for one in self.bodies]
        for one in self.bodies:
            one.geometry.buildConvexRepresentation(False)
        srdf = ElementTree.parse(FOLDER / "panda_description/srdf/panda.srdf").getroot()
        rows = srdf.findall("disable_collisions")
        never = {frozenset((row.get("link1"), row.get("link2"))) for row in rows}
        never |= {frozenset(pair) for pair in NEVER}
        self.pairs = [
            (i, j)
            for i in range(len(self.bodies))
            for j in range(i)
            if frozenset((self.names[i], self.names[j])) not in never
        ]

    def arm(self):
        """The Panda of the catalog, its bodies those of the meshes."""
        bodies = []
        for name, one in zip(self.names, self.bodies, strict=True):
            T = one.placement
            corners = np.array(one.geometry.vertices()) @ T.rotation.T + T.translation
            frame = f"panda_joint{one.parentJoint}" if one.parentJoint else "universe"
            bodies += [
                ftqp.Capsule(a, b, r + 1e-5, frame=frame, name=name, corners=inside)
                for a, b, r, inside in around(corners)
            ]
        return ftqp.robots.load("panda").with_capsules(bodies)

    def least(self, things, postures):
        """The least distance at some postures [m]."""
        least, ask, got = np.inf, coal.DistanceRequest(), coal.DistanceResult()
        for q in postures:
            pin.forwardKinematics(self.model, self.data, q)
            at = [self.data.oMi[one.parentJoint] * one.placement for one in self.bodies]
            at = [coal.Transform3s(T.rotation, T.translation) for T in at]
            pairs = [
                (one.geometry.convex, T, *thing)
                for one, T in zip(self.bodies, at, strict=True)
                if one.parentJoint
                for thing in things
            ]
            pairs += [
                (self.bodies[i].geometry.convex, at[i], self.bodies[j].geometry.convex, at[j])
                for i, j in self.pairs
            ]
            for pair in pairs:
                got.clear()
                least = min(least, coal.distance(*pair, ask, got))
        return least


def things_of(problem):
    """The scene of a problem, and the same for coal."""
    scene, things = ftqp.Scene(), []
    for k, (kind, *row) in enumerate(problem["bodies"]):
        place, size = np.eye(4), np.array(row[6:])
        place[:3, :3], place[:3, 3] = pin.exp3(np.array(row[3:6], float)), row[:3]
        if kind == BOX:
            scene.add(f"box {k}", ftqp.Box(2.0 * size, place))
            shape = coal.Box(*(2.0 * size))
        else:
            scene.add(f"cylinder {k}", ftqp.Cylinder(size[1], 2.0 * size[0], place))
            shape = coal.Cylinder(size[1], 2.0 * size[0])
        things.append((shape, coal.Transform3s(place[:3, :3], place[:3, 3])))
    return scene, things
