"""A robot as a table, for the cells of notebooks."""

from typing import Any

import numpy as np

from ftqp.core.small_picture import curves_svg, html_table

HEADINGS = ("joint", "from", "to", "speed", "acceleration", "torque")


def robot_html(robot: Any) -> str:
    """Joints with their limits, degrees where they turn and metres where they slide, and what was found."""
    limits, slides = robot.limits, robot.chain.prismatic
    rows = []
    for i, name in enumerate(robot.joints):
        scale, unit = (1.0, "m") if slides[i] else (float(np.rad2deg(1.0)), "°")
        values = [limits.q_min[i], limits.q_max[i], limits.v_max[i], limits.a_max[i]]
        cells = [
            "-" if np.isinf(value) else f"{scale * value:.4g} {unit}{per}"
            for value, per in zip(values, ("", "", "/s", "/s²"), strict=True)
        ]
        torque = (
            "-" if np.isinf(limits.tau_max[i]) else f"{limits.tau_max[i]:.4g} {'N' if slides[i] else 'N m'}"
        )
        rows.append((name, *cells, torque))
    said = "; ".join(finding.sentence for finding in robot.findings)
    title = f"{robot.name}: {robot.nv} joints, tip {', '.join(robot.tips)}"
    return html_table(title, HEADINGS, rows, said, arm_svg(robot, robot.neutral))


def arm_svg(robot: Any, q: Any) -> str:
    """The lines from joint to joint and to the tip, seen from the side."""
    at = [robot.pose(q, name)[:3, 3] for name in robot.joints]
    lines = [(np.zeros(3) if k < 0 else at[k], at[i]) for i, k in enumerate(robot.chain.parent)]
    lines.append((at[robot.chain.tip_joint], robot.pose(q)[:3, 3]))
    curves = [(np.array([a[0], b[0]]), np.array([a[2], b[2]])) for a, b in lines]
    return curves_svg(curves, "from the side, x to the right and z up", true_to_scale=True)
