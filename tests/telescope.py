"""An arm on a lift of two stages, whose second stage and elbow follow others, as a URDF."""

LINK = (
    '<link name="l{i}"><inertial><mass value="{mass}"/><origin xyz="0.05 0.02 {high}"/>'
    '<inertia ixx="0.02" iyy="0.03" izz="0.025" ixy="0.001" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="l{i}"/><origin xyz="{at}"/>'
    '<axis xyz="{axis}"/><limit {limit} effort="{effort}"/>{more}</joint>'
)
TURN = 'lower="-2.5" upper="2.5" velocity="2"'
JOINTS = (
    ("turn", "revolute", "0 0 0", "0 0 1", 'lower="-3" upper="3" velocity="2"', 200, ""),
    ("lift", "prismatic", "0 0 0", "0 0 1", 'lower="0" upper="0.5" velocity="0.5"', 500, ""),
    (
        "lift2", "prismatic", "0 0 0", "0 0 1", 'lower="0" upper="0.2" velocity="0.6"', 1,
        '<mimic joint="lift" multiplier="0.5" offset="0.02"/>',
    ),
    ("shoulder", "revolute", "0.3 0 0.1", "0 1 0", TURN, 100, ""),
    (
        "elbow", "revolute", "0.3 0 0.1", "0 1 0", TURN, 100,
        '<mimic joint="shoulder" multiplier="-0.7" offset="0.3"/>',
    ),
    ("roll", "revolute", "0.2 0 0.1", "1 0 0", TURN, 100, ""),
    ("pitch", "revolute", "0.2 0 0.05", "0 1 0", TURN, 50, ""),
    ("yaw", "revolute", "0.1 0 0", "0 0 1", TURN, 50, ""),
)  # fmt: skip


def telescope(**more: str) -> str:
    """The URDF; keywords replace what stands in a joint after its limits, such as its ``mimic``."""
    parts = ['<robot name="telescope"><link name="base"/>']
    for i, (name, kind, at, axis, limit, effort, follows) in enumerate(JOINTS):
        parts.append(LINK.format(i=i, mass=1.0 + 0.3 * i, high=0.1 + 0.01 * i))
        parts.append(
            JOINT.format(
                name=name, kind=kind, parent=f"l{i - 1}" if i else "base", i=i, at=at, axis=axis, limit=limit,
                effort=effort, more=more.get(name, follows),
            )
        )  # fmt: skip
    place = '<origin xyz="0.1 0.02 0.03"/>'
    end = f'<joint name="t" type="fixed"><parent link="l7"/><child link="tool"/>{place}</joint>'
    return "".join([*parts, '<link name="tool"/>', end, "</robot>"])
