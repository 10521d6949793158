"""Make the notebooks: run their cells, and keep what they print and draw.

python docs/making/notebooks.py            all of them, into notebooks/, in half a minute
python docs/making/notebooks.py 02         one of them
python docs/making/notebooks.py --check    run those that lie there, and say what fails
"""

import sys
from pathlib import Path

import nbclient
import nbformat
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

FOLDER = Path(__file__).parents[2] / "notebooks"
PATIENCE = 300
"""How long a cell may take [s]."""

NOTEBOOKS = {
    "01_first_arm": (
        "# A first arm\n\nA robot of the catalog, what it can do, and a circle that it draws.",
        'import ftqp\n\nrobot = ftqp.robots.load("panda")\nrobot',
        "robot.show()",
        "path = ftqp.paths.Circle(robot.pose(robot.neutral), radius=0.05, duration=4.0)\n"
        "planner = ftqp.Planner(robot, dt=0.002)\n"
        'result = ftqp.Simulation(planner, path, q=robot.neutral, log="memory").run()\nresult',
        "result.plot()",
    ),
    "02_a_fault": (
        "# A fault\n\nJoint 3 locks half-way. This is reported to the planner at once, or 50 ms later.",
        'import ftqp\n\nrobot = ftqp.robots.load("panda")\n'
        "path = ftqp.paths.Circle(robot.pose(robot.neutral), radius=0.05, duration=4.0)\n\n\n"
        "def run(announced=None):\n"
        '    fault = ftqp.FaultEvent(2.0, ftqp.Locked("panda_joint3"), announced=announced)\n'
        "    planner = ftqp.Planner(robot, dt=0.002)\n"
        "    simulation = ftqp.Simulation(\n"
        '        planner, path, q=robot.neutral, schedule=ftqp.Schedule([fault]), log="memory"\n'
        "    )\n"
        "    return simulation.run()\n\n\nat_once, late = run(), run(2.05)\nat_once",
        "late",
        "late.plot()",
    ),
    "03_coverage": (
        "# Which failures a motion survives\n\nBefore the mission: each joint is locked at each instant.",
        'import ftqp\nfrom ftqp.analysis import coverage, plan\n\nrobot = ftqp.robots.load("panda")\n'
        "path = ftqp.paths.Line(robot.pose(robot.neutral), (0.0, 0.25, 0.0), duration=4.0)\n"
        "made = plan(robot, path, q0=robot.neutral, dt=0.05)\nmade",
        "coverage(robot, None, made)",
    ),
    "04_compare_solvers": (
        "# The same motion by several QP solvers\n\nOne word changes, the motion does not.",
        'import numpy as np\n\nimport ftqp\n\nrobot = ftqp.robots.load("panda")\n'
        "path = ftqp.paths.Circle(robot.pose(robot.neutral), radius=0.05, duration=1.0)\n"
        "ends = {}\n"
        'for backend in ("active_set", "daqp", "proxqp", "osqp"):\n'
        "    planner = ftqp.Planner(robot, dt=0.002, backend=backend)\n"
        "    ends[backend] = ftqp.Simulation(planner, path, q=robot.neutral).run().q\n"
        "for backend, q in ends.items():\n"
        "    print(f\"{backend:10} ends {np.abs(q - ends['active_set']).max():.1e} rad from active_set\")",
    ),
    "05_your_urdf": (
        "# Your own URDF\n\nHere one is written from the catalog; put the path of yours in its place.",
        "from pathlib import Path\nfrom tempfile import mkdtemp\n\nimport ftqp\n\n"
        'file = Path(mkdtemp()) / "arm.urdf"\nfile.write_text(ftqp.robots.load("xarm7").to_urdf())\n'
        'robot = ftqp.Robot.from_urdf(file, tip="link7")\nrobot',
        "robot.show(robot.neutral)",
        "for finding in robot.findings:\n    print(finding)",
    ),
    "06_a_scene": (
        "# A scene\n\nA post stands where the hand wants to go; joint 5 locks on the way.",
        'import numpy as np\n\nimport ftqp\n\nrobot = ftqp.robots.load("panda")\nscene = ftqp.Scene()\n'
        'scene.add("post", ftqp.Cylinder(radius=0.05, length=1.2, place=(0.45, 0.3, 0.6)))\n'
        "planner = ftqp.Planner(robot, dt=0.001, scene=scene, clearance=ftqp.Clearance(keep=0.02))\n"
        "planner.reset(robot.neutral)\n"
        "target, q = ftqp.Target(pose=robot.pose(robot.neutral)), robot.neutral\n"
        "start, way = target.position.copy(), np.array([0.15, 0.13, 0.05])\n"
        "for k in range(4000):\n"
        "    target.position[:] = start + min(k / 3000, 1.0) * way\n"
        '    if k == 1500:\n        planner.report(ftqp.Locked("panda_joint5"))\n'
        "    step = planner.step(q, None, target)\n    q = step.q.copy()\nstep",
        "print(f\"{1e3 * step.clearance:.1f} mm between {' and '.join(step.nearest)}\")\nrobot.show(q)",
    ),
}
"""By name: the words at the top, and the cells below."""


def made(name: str) -> nbformat.NotebookNode:
    """A notebook with what its cells print and draw."""
    words, *cells = NOTEBOOKS[name]
    book = new_notebook(cells=[new_markdown_cell(words), *map(new_code_cell, cells)])
    for k, cell in enumerate(book.cells):
        cell["id"] = f"cell-{k}"
    book.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    executed(book)
    return book


def executed(book: nbformat.NotebookNode) -> None:
    """Run all cells of a notebook.

    Raises:
        CellExecutionError: One fails.
    """
    nbclient.NotebookClient(book, timeout=PATIENCE, kernel_name="python3").execute()
    book.metadata.pop("language_info", None)  # of the Python that happened to run it
    for cell in book.cells:
        cell.get("metadata", {}).pop("execution", None)


def main() -> int:
    """Make, or check."""
    asked = [word for word in sys.argv[1:] if word != "--check"]
    names = [name for name in NOTEBOOKS if not asked or name.startswith(tuple(asked))]
    for name in names:
        file = FOLDER / f"{name}.ipynb"
        if "--check" in sys.argv:
            executed(nbformat.read(file, as_version=4))
        else:
            FOLDER.mkdir(exist_ok=True)
            nbformat.write(made(name), file)
        print(f"{name} runs")
    return 0


if __name__ == "__main__":
    sys.exit(main())
