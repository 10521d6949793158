"""A motion of an arm along a path: the arm at a few instants, and its joints within their limits."""

from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.model.chain import Skeleton
from ftqp.model.robot import Robot
from ftqp.viz.figures import arm_views
from ftqp.viz.figures.canvas import BLUE, paper, save, shade_beyond, tidy


def draw_motion(path: str | Path, title: str, robot: Robot, t: FloatArray, q: FloatArray) -> Path:
    """Draw a motion to a PNG file: configurations q, (N, nv) [rad or m], at the times t, (N,) [s]."""
    at = np.linspace(0, len(q) - 1, arm_views.INSTANTS).round().astype(int)
    way, none = np.stack([robot.pose(row)[:3, 3] for row in q]), np.zeros((len(at), robot.nv), dtype=bool)
    arm = arm_views.postures_of(Skeleton.of(robot.chain), t[at], q[at], failed=none, way=way)
    rows = -(-robot.nv // 2)
    figure = paper(11.0, 4.2 + 1.5 * rows, title)
    parts: Any = figure.subfigures(2, 1, height_ratios=[4.2, 1.5 * rows])
    above, below = parts
    arm_views.draw_views(above, None, [arm], targets=way)
    panels = np.atleast_1d(below.subplots(rows, 2, sharex=True, squeeze=False)).ravel()
    for i, panel in enumerate(panels):
        if i >= robot.nv:
            panel.set_visible(False)
            continue
        ends = (robot.limits.q_min[i], robot.limits.q_max[i])
        low, high = (float(x) if np.isfinite(x) else None for x in ends)
        shade_beyond(panel, low, high, q[:, i])
        panel.plot(t, q[:, i], color=BLUE, linewidth=1.6)
        tidy(panel, "time [s]" if i >= robot.nv - 2 else "", "[rad or m]", robot.joints[i])
        panel.set_xlim(t[0], t[-1])
        panel.tick_params(labelbottom=i >= robot.nv - 2)
    return save(figure, path)
