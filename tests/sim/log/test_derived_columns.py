"""Columns of whole blocks, against one row at a time by other means."""

import numpy as np
from scipy.spatial.transform import Rotation

from ftqp.kernel.layout.flat_arrays import BLOCK_FIELDS, BLOCK_SCALARS
from ftqp.model import catalog
from ftqp.sim.base.moving_world import Platform
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.raw_rows import PER_JOINT, RawLayout, across, table
from ftqp.sim.log.signals import base_columns, columns

COUNT = 40
EQUAL = ("position_error", "rotation_error", "scale", "status", "qp_status", "qp_iterations", "qp_residual",
         "sigma_min", "manipulability", "condition", "kappa", "progress", "path_status")  # fmt: skip


def drawn(layout, seed=0):
    generator = np.random.default_rng(seed)
    raw = generator.standard_normal((COUNT, layout.width))
    for name in ("target", "tip", "base_pose"):
        if name in layout.fields:
            turns = Rotation.random(COUNT, random_state=seed + len(name)).as_matrix()
            layout.poses(raw, name)[:, :, :3] = turns
    for name in ("belief", "truth", "status", "qp_status", "qp_iterations", "path_status", "base_status"):
        if name in layout.fields:
            raw[:, layout.fields[name]] = np.round(raw[:, layout.fields[name]])
    return raw


def test_places_of_the_kernel_s_blocks_are_those_of_the_fields():
    layout = RawLayout(7)
    places = dict(zip(BLOCK_FIELDS, layout.places().tolist(), strict=True))
    assert places.pop("scalars") == layout.fields[BLOCK_SCALARS[0]].start
    assert places == {name: layout.fields[name].start for name in places}
    for k, name in enumerate(BLOCK_SCALARS):
        assert layout.fields[name].start == layout.scalars.start + k


def test_columns_of_a_block_are_those_of_its_rows_by_other_means():
    panda, layout = catalog.load("panda"), RawLayout(7)
    raw = drawn(layout)
    log = Log.of_table(None, table(raw, layout), columns(panda.joints, np.zeros(7, bool), "velocity"), {})
    for raw_name, name in zip(PER_JOINT, ("q", "v", "a", "tau", "tau_brake", "lb", "ub", "belief", "truth"),
                              strict=True):  # fmt: skip
        np.testing.assert_array_equal(log[name], raw[:, layout.fields[raw_name]])
    for name in EQUAL:
        np.testing.assert_array_equal(log[name], raw[:, layout.fields[name]][:, 0])
    np.testing.assert_allclose(log["step_time"], 1e-3 * raw[:, layout.fields["step_time"]][:, 0])
    np.testing.assert_allclose(log["slack"], [np.linalg.norm(row) for row in raw[:, layout.fields["slack"]]])
    for k in range(COUNT):
        for name in ("target", "tip"):
            pose = layout.poses(raw, name)[k]
            np.testing.assert_array_equal(log[name][k, :3], pose[:, 3])
            turned = Rotation.from_matrix(pose[:, :3]).as_quat(canonical=True)
            np.testing.assert_allclose(log[name][k, 3:], turned, atol=1e-14)
        error = log["target"][k, :3] - log["tip"][k, :3]
        along = raw[k, layout.fields["velocity"]]
        expected = np.linalg.norm(np.cross(error, along)) / np.linalg.norm(along)
        assert abs(log["off_path"][k] - expected) < 1e-12


def test_columns_of_a_moving_base_follow():
    layout = RawLayout(7, 3)
    raw = drawn(layout)
    signals = (
        *columns(list("abcdefg"), np.zeros(7, bool), "velocity"),
        *base_columns(Platform().coordinates),
    )
    log = Log.of_table(None, table(raw, layout), signals, {})
    target, tip, base = (layout.poses(raw, name) for name in ("target", "tip", "base_pose"))
    turns = Rotation.from_matrix(target[:, :, :3]) * Rotation.from_matrix(tip[:, :, :3]).inv()
    np.testing.assert_allclose(log["inertial_error"][:, 3:], turns.as_rotvec(), atol=1e-12)
    np.testing.assert_array_equal(log["inertial_error"][:, :3], target[:, :, 3] - tip[:, :, 3])
    np.testing.assert_array_equal(log["base"][:, :3], base[:, :, 3])
    np.testing.assert_array_equal(log["disturbance"], raw[:, layout.fields["eta"]])
    np.testing.assert_array_equal(log["base_status"], raw[:, layout.fields["base_status"]][:, 0])


def test_error_of_a_path_at_rest_is_all_across():
    error = np.array([[3.0, 4.0, 0.0], [3.0, 4.0, 0.0]])
    np.testing.assert_allclose(across(error, np.array([[1e-10, 0.0, 0.0], [2.0, 0.0, 0.0]])), [5.0, 4.0])
