"""The true meshes of the Panda and what is around it, measured by coal; they know nothing of ftqp.

The meshes are those of the package example-robot-data, the fingers left out.
"""

from pathlib import Path
from xml.etree import ElementTree

import coal
import numpy as np
import pinocchio as pin

SHARE = Path(pin.__file__).parents[4] / "share"
FOLDER = SHARE / "example-robot-data/robots"
URDF = FOLDER / "panda_description/urdf/panda.urdf"
SRDF = FOLDER / "panda_description/srdf/panda.srdf"
NEVER = [("panda_hand", f"panda_link{k}") for k in (5, 6, 7)]
BOX = 2


class Judge:
    """The true meshes: how near the arm is to a scene and to itself."""

    def __init__(self):
        urdf, share = str(URDF), [str(SHARE), str(FOLDER)]
        model = pin.buildModelFromUrdf(urdf)
        geometry = pin.buildGeomFromUrdf(model, urdf, pin.GeometryType.COLLISION, package_dirs=share)
        held = [model.getJointId(name) for name in model.names if "finger" in name]
        self.model, geometry = pin.buildReducedModel(model, geometry, held, pin.neutral(model))
        self.data = self.model.createData()
        self.bodies = [one for one in geometry.geometryObjects if "finger" not in one.name]
        self.names = [one.name.rsplit("_", 1)[0] for one in self.bodies]
        for one in self.bodies:
            one.geometry.buildConvexRepresentation(False)
        srdf = ElementTree.parse(SRDF).getroot()
        rows = srdf.findall("disable_collisions")
        never = {frozenset((row.get("link1"), row.get("link2"))) for row in rows}
        never |= {frozenset(pair) for pair in NEVER}
        self.pairs = [
            (i, j)
            for i in range(len(self.bodies))
            for j in range(i)
            if frozenset((self.names[i], self.names[j])) not in never
        ]

    def scene_with(self, things):
        """The meshes and what is around, and the pairs that may not meet."""
        geometry, count = pin.GeometryModel(), len(self.bodies)
        for one in self.bodies:
            body = one.geometry.convex
            geometry.addGeometryObject(pin.GeometryObject(one.name, one.parentJoint, one.placement, body))
        for k, (shape, T) in enumerate(things):
            place = pin.SE3(T.getRotation(), T.getTranslation())
            geometry.addGeometryObject(pin.GeometryObject(f"thing {k}", 0, place, shape))
        moving = [i for i in range(count) if self.bodies[i].parentJoint]
        for pair in [(i, count + k) for i in moving for k in range(len(things))] + self.pairs:
            geometry.addCollisionPair(pin.CollisionPair(*pair))
        return geometry

    def least(self, things, postures):
        """The least distance at some postures [m]."""
        geometry = self.scene_with(things)
        asked, least = pin.GeometryData(geometry), np.inf
        for q in postures:
            nearest = pin.computeDistances(self.model, self.data, geometry, asked, q)
            least = min(least, asked.distanceResults[nearest].min_distance)
        return least


def things_of(bodies):
    """Boxes and cylinders of a problem, and where they are."""
    things = []
    for kind, *row in bodies:
        R, size = pin.exp3(np.array(row[3:6], float)), np.array(row[6:])
        shape = coal.Box(*(2.0 * size)) if kind == BOX else coal.Cylinder(size[1], 2.0 * size[0])
        things.append((shape, coal.Transform3s(R, np.array(row[:3], float))))
    return things
