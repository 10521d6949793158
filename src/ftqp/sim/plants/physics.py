"""Rigid bodies with friction, brakes and end stops, in MuJoCo."""

from collections.abc import Sequence
from typing import Any, NamedTuple, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.model.chain import Chain
from ftqp.model.followers import led_joints
from ftqp.model.reading.compiled_mjcf import mujoco

HARD = (0.9999, 0.9999, 0.001, 0.5, 2.0)
"""Impedance of brakes and end stops in MuJoCo's terms: with its default ones a brake creeps."""
RESPONSE = 2.0
"""Time constant of brakes and end stops, in time steps: the shortest that MuJoCo integrates safely."""
ARM, WORLD = 1, 2
"""Bits of contype: what of the arm collides with what stands around it, and with nothing else."""
KINDS = {
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "half_space": mujoco.mjtGeom.mjGEOM_PLANE,
    "hull": mujoco.mjtGeom.mjGEOM_MESH,
}
HARMLESS = (1.0, 1.0, 1.0)
"""Stands for an inertia until the true one, which MuJoCo's compiler may refuse, is written [kg m2]."""


class Geom(NamedTuple):
    """Something that collides."""

    joint: int  # That it moves with, by index; -1 of what stands around the arm
    kind: str  # One of `KINDS`
    settings: dict[str, Any]  # As MuJoCo has them: ``size``, and ``fromto``, or ``pos`` and ``quat``
    corners: FloatArray | None = None  # Of a hull, in its own frame, (V, 3) [m]


@final
class Physics:
    """An arm, or several on one base, in MuJoCo: joint torques in, motion out.

    The body of joint i has that joint's frame, its axis being z. Masses and inertias are written into
    the compiled model, because the compiler refuses some that the equations of motion accept. The arm
    collides with what stands around it, and not with itself. A joint that follows another one is tied to it,
    a brake is dry friction; ties, end stops and fixed joints are hard constraints without rebound.

    Attributes:
        q: joint positions, (nv,) [rad or m]; a view into MuJoCo's memory, like the next four.
        v: joint velocities, (nv,) [rad/s or m/s].
        tau: motor torques of the next time step, (nv,) [N m or N].
        carried: torques of brakes, end stops and dry friction in the last step, (nv,) [N m or N].
        bias: h with M a + h = tau at the start of the last step, (nv,) [N m or N].

    Source: https://mujoco.readthedocs.io, pages "Computation" and "Modeling".
    """

    def __init__(self, chain: Chain, h: float, geoms: Sequence[Geom] = ()) -> None:
        self._names = chain.names
        self._model = _compiled(chain, h, geoms)
        self._data = data = mujoco.MjData(self._model)
        _write_bodies(self._model, data, chain)
        model, soft = self._model, (RESPONSE * h, 1.0)
        model.dof_solref[:], model.dof_solimp[:] = soft, HARD
        model.jnt_solref[:], model.jnt_solimp[:] = soft, HARD
        model.eq_solref[:], model.eq_solimp[:] = soft, HARD
        self.q: FloatArray = data.qpos
        self.v: FloatArray = data.qvel
        self.tau: FloatArray = data.qfrc_applied
        self.carried: FloatArray = data.qfrc_constraint
        self.bias: FloatArray = data.qfrc_bias
        self._warnings = data.warning.number
        self._tip = model.site("tip").id
        self._advance = mujoco.mj_step
        self._body = model.site_bodyid[self._tip]
        self._push = np.zeros(3)

    def reset(self, q: FloatArray, v: FloatArray) -> None:
        """Begin at (q, v), each (nv,), every joint released and free of torque."""
        mujoco.mj_resetData(self._model, self._data)
        self._data.eq_active[: len(self._names)] = 0  # behind them stand those of joints that follow others
        self._push[:] = 0.0
        self.q[:], self.v[:] = q, v

    def step(self) -> None:
        """Move on by one time step under ``tau``."""
        if self._push.any():
            data = self._data
            lever = data.site_xpos[self._tip] - data.xipos[self._body]
            data.xfrc_applied[self._body, :3] = self._push
            data.xfrc_applied[self._body, 3:] = np.cross(lever, self._push)
        self._advance(self._model, self._data)

    def push(self, force: FloatArray) -> None:
        """From now on a force acts at the tip, (3,) [N], along the axes of the world; zeros are none."""
        self._push[:] = force
        self._data.xfrc_applied[:] = 0.0

    def resist(self, i: int, coulomb: float, viscous: float) -> None:
        """Give joint i dry friction, or a brake, of ``coulomb`` [N m or N] and viscous friction [N m s/rad].

        A constraint of MuJoCo yields in proportion to (M^-1)_ii of the posture q = 0. Where the joint has
        more inertia than there, a brake would creep, so the number is made that of the present posture.
        """
        self._model.dof_invweight0[i] = self._inverse_column(i)[i]
        self._model.dof_frictionloss[i], self._model.dof_damping[i] = coulomb, viscous

    def stop_at(self, i: int, low: float, high: float) -> None:
        """Put the end stops of joint i to ``low`` and ``high`` [rad or m]; it has none if one is infinite."""
        limited = bool(np.isfinite([low, high]).all())
        self._model.jnt_limited[i] = limited
        if limited:
            self._model.jnt_range[i] = low, high

    def fix(self, i: int) -> None:
        """Bring joint i to rest by an impulse and hold it where it is.

        The others keep the momentum: dv = -v_i (M^-1)_i / (M^-1)_ii.
        """
        column = self._inverse_column(i)
        self.v -= self.v[i] / column[i] * column
        self.v[i] = 0.0
        self._model.eq_data[i, :5] = self.q[i], 0.0, 0.0, 0.0, 0.0
        self._data.eq_active[i] = 1

    def release(self, i: int) -> None:
        """Let go of a joint that was fixed."""
        self._data.eq_active[i] = 0

    def _inverse_column(self, i: int) -> FloatArray:
        """Column i of M^-1 at the present state, (nv,)."""
        mujoco.mj_forward(self._model, self._data)
        unit, column = np.zeros((1, len(self.q))), np.zeros((1, len(self.q)))
        unit[0, i] = 1.0
        mujoco.mj_solveM(self._model, self._data, column, unit)
        return np.asarray(column[0])

    @property
    def contact_force(self) -> float:
        """The largest force between the arm and what stands around it in the last step [N]."""
        worst, force = 0.0, np.zeros(6)
        for at in range(self._data.ncon):
            mujoco.mj_contactForce(self._model, self._data, at, force)
            worst = max(worst, float(force[0]))
        return worst

    def mass_matrix(self) -> FloatArray:
        """M at the present state, (nv, nv)."""
        mujoco.mj_forward(self._model, self._data)
        n = len(self.q)
        M, column, unit = np.zeros((n, n)), np.zeros(n), np.eye(n)
        for i in range(n):
            mujoco.mj_mulM(self._model, self._data, column, unit[i])
            M[i] = column
        return M

    def tip(self) -> FloatArray:
        """Pose of the tip at the present state, (4, 4) [m]."""
        mujoco.mj_forward(self._model, self._data)
        T = np.eye(4)
        T[:3, :3] = self._data.site_xmat[self._tip].reshape(3, 3)
        T[:3, 3] = self._data.site_xpos[self._tip]
        return T

    @property
    def failure(self) -> str | None:
        """Why what happens since the reset cannot be true any more, or None."""
        if not self._warnings.any():
            return None
        data, first = self._data, int(np.argmax(self._warnings > 0))
        said = mujoco.mju_warningText(first, int(data.warning[first].lastinfo))
        joint = self._names[self._culprit()]
        return f"the physics broke down at joint {joint} at t = {data.time:.4g} s: {said}"

    def _culprit(self) -> int:
        """The joint whose torque or velocity alone is not finite, else the fastest one."""
        for signal in (self.tau, self.v):
            wrong = ~np.isfinite(signal)
            if wrong.any() and not wrong.all():
                return int(np.argmax(wrong))
        return int(np.argmax(np.abs(self.v)))


def _compiled(chain: Chain, h: float, geoms: Sequence[Geom]) -> Any:
    """The model of the chain, every body with a harmless inertia, and of what it collides with."""
    spec = mujoco.MjSpec()
    spec.compiler.degree, spec.compiler.balanceinertia = False, False
    spec.compiler.boundmass = spec.compiler.boundinertia = 0.0
    option = spec.option
    option.gravity, option.timestep = chain.gravity, h
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    if not any(geom.joint < 0 for geom in geoms):
        option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    bodies = [spec.worldbody]
    for i, name in enumerate(chain.names):
        above = bodies[chain.parent[i] + 1]
        body = above.add_body(name=name, pos=chain.translation[i], quat=quaternion(chain.rotation[i]))
        bodies.append(body)
        body.explicitinertial, body.mass, body.inertia = True, 1.0, HARMLESS
        kind = mujoco.mjtJoint.mjJNT_SLIDE if chain.prismatic[i] else mujoco.mjtJoint.mjJNT_HINGE
        body.add_joint(name=name, type=kind, axis=(0.0, 0.0, 1.0), armature=chain.armature[i])
        hold = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=name, active=False)
        hold.objtype = mujoco.mjtObj.mjOBJ_JOINT
    for m, l, ratio, offset in led_joints(chain):
        names = chain.names[m], chain.names[l]
        tie = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=names[0], name2=names[1], active=True)
        tie.objtype = mujoco.mjtObj.mjOBJ_JOINT
        tie.data[:5] = offset, ratio, 0.0, 0.0, 0.0
    tip = bodies[chain.tip_joint + 1]
    tip.add_site(name="tip", pos=chain.tip_translation, quat=quaternion(chain.tip_rotation))
    for k, geom in enumerate(geoms):
        shape = geom.settings
        if geom.corners is not None:
            spec.add_mesh(name=f"hull {k}", uservert=geom.corners.ravel())
            shape = {"meshname": f"hull {k}"} | shape
        of, meets = (WORLD, ARM) if geom.joint < 0 else (ARM, WORLD)
        bodies[geom.joint + 1].add_geom(type=KINDS[geom.kind], contype=of, conaffinity=meets, **shape)
    return spec.compile()


def _write_bodies(model: Any, data: Any, chain: Chain) -> None:
    """Masses and inertias of the chain; bodies are numbered from 1, the world is 0."""
    for i in range(len(chain.names)):
        moments, axes = np.linalg.eigh(chain.inertia[i])
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        model.body_mass[i + 1], model.body_ipos[i + 1] = chain.mass[i], chain.com[i]
        model.body_inertia[i + 1], model.body_iquat[i + 1] = moments, quaternion(axes)
    model.body_simple[:] = 0
    model.body_sameframe[:] = 0
    mujoco.mj_setConst(model, data)


def quaternion(R: FloatArray) -> FloatArray:
    """The unit quaternion w, x, y, z of a rotation, (4,)."""
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(R).reshape(9))
    return quaternion
