"""A robot as a table, for the cells of notebooks."""

from typing import Any

import numpy as np

from ftqp.core.html_table import html_table

HEADINGS = ("joint", "from", "to", "speed", "acceleration", "torque")


def robot_html(robot: Any) -> str:
    """Joints with their limits, degrees where they turn and metres where they slide, and what was found.

    Args:
        robot: The ``ftqp.Robot``.
    """
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
    return html_table(f"{robot.name}: {robot.nv} joints, tip {', '.join(robot.tips)}", HEADINGS, rows, said)
