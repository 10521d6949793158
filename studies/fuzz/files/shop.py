"""The folder in which files are tried: what a file may point to, good and bad."""

import os
from pathlib import Path

URDF = """<robot name="arm"><link name="base"/>
<link name="a"><inertial><mass value="1"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<link name="b"><inertial><mass value="1"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<link name="tool"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" velocity="1.5" effort="10"/></joint>
<joint name="j2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.5 0 0"/>
<axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="1" effort="10"/></joint>
<joint name="end" type="fixed"><parent link="b"/><child link="tool"/><origin xyz="0.5 0 0"/></joint>
</robot>"""
WAYPOINTS = "t,x,y,z\n0,0,0,0\n1,0.01,0,0\n2,0.02,0.01,0\n"
MOTION = "t,track\n0,0\n1,0.1\n2,0\n"


def furnished(folder: Path) -> Path:
    """A folder with a robot, waypoints, a profile, a pipe, a folder and an empty file."""
    texts = {
        "arm.urdf": URDF, "way.csv": WAYPOINTS, "motion.csv": MOTION, "empty": "",
        "solver.toml": 'name = "active_set"\n', "some.json": "{}", "broken.npz": "PK\3\4",
    }  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "folder").mkdir()
    os.mkfifo(folder / "pipe")
    return folder
