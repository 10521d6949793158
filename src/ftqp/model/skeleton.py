"""The bare geometry of an arm: enough to place its joints, small enough to be kept in a log."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pinocchio as pin

from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.core.pose import transform
from ftqp.model.chain import Chain, limbs_of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Skeleton:
    """Where the joints of an arm, or of several on one base, sit on each other."""

    prismatic: BoolArray  # Whether the joint slides, (nv,)
    # Each joint's frame in that of its parent at q = 0, its z axis along the joint, (nv, 4, 4)
    placements: FloatArray
    tip: FloatArray  # The tip in the frame of its joint, (4, 4)
    parent: IntArray  # The joint that each hangs on, lower than itself; -1 is the base, (nv,)
    tip_joint: int  # The joint that the tip moves with

    @classmethod
    def of(cls, chain: Chain) -> Self:
        """The skeleton of a chain."""
        placements = np.array(
            [transform(R, p) for R, p in zip(chain.rotation, chain.translation, strict=True)]
        )
        return cls(
            prismatic=chain.prismatic,
            placements=placements,
            tip=transform(chain.tip_rotation, chain.tip_translation),
            parent=chain.parent,
            tip_joint=chain.tip_joint,
        )

    @classmethod
    def from_facts(cls, facts: Mapping[str, Any]) -> Self:
        """The skeleton that ``facts`` gave, for example those in a log; without parents it is serial."""
        try:
            prismatic = np.array(facts["prismatic"], dtype=np.bool_)
            n = len(prismatic)
            placements = np.array(facts["placements"], dtype=np.float64).reshape(n, 4, 4)
            tip = np.array(facts["tip"], dtype=np.float64).reshape(4, 4)
            parent = np.array(facts.get("parent", range(-1, n - 1)), dtype=np.int64).reshape(n)
            tip_joint = int(facts.get("tip_joint", n - 1))
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"the arm's geometry is not readable: {error!s:.100}") from error
        return cls(prismatic=prismatic, placements=placements, tip=tip, parent=parent, tip_joint=tip_joint)

    def facts(self) -> dict[str, Any]:
        """The same in values that JSON can hold; parents only where the arm is not serial."""
        n = len(self.prismatic)
        serial = (self.parent == np.arange(-1, n - 1)).all() and self.tip_joint == n - 1
        return {
            "prismatic": self.prismatic.tolist(),
            "placements": self.placements.tolist(),
            "tip": self.tip.tolist(),
        } | ({} if serial else {"parent": self.parent.tolist(), "tip_joint": self.tip_joint})

    @property
    def limbs(self) -> list[list[int]]:
        """How the arm is drawn, see ``ftqp.model.chain.limbs_of``."""
        return limbs_of(self.parent, self.tip_joint)

    def frames(self, q: FloatArray) -> FloatArray:
        """Poses of the joint frames and then of the tip in the base, (K, nv + 1, 4, 4)."""
        model = pin.Model()
        for i, (placement, slides) in enumerate(zip(self.placements, self.prismatic, strict=True)):
            joint = pin.JointModelPZ() if slides else pin.JointModelRZ()
            model.addJoint(int(self.parent[i]) + 1, joint, pin.SE3(placement), f"j{i}")
        data, tip = model.createData(), pin.SE3(self.tip)
        poses = np.empty((len(q), model.njoints, 4, 4))
        for k, row in enumerate(np.asarray(q, dtype=np.float64)):
            pin.forwardKinematics(model, data, row)
            for i in range(1, model.njoints):
                poses[k, i - 1] = data.oMi[i].homogeneous
            poses[k, -1] = (data.oMi[self.tip_joint + 1] * tip).homogeneous
        return poses
