"""The folder that ``ftqp build`` writes: headers, library, the arm's file, examples, and a bill of all."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ftqp import __version__
from ftqp.app.deployment.headers import (
    arm_file,
    arm_header,
    fingerprint,
    kernel_hash,
    layout_header,
    small_capacity,
)
from ftqp.control.following.path_follower import PathFollower
from ftqp.control.paths.path import Path as Way
from ftqp.control.planner.planner import Planner
from ftqp.core.checks import FloatArray
from ftqp.core.errors import FtqpError, InputError
from ftqp.kernel.compiled.library import KERNEL
from ftqp.kernel.layout.enums import JOINTS
from ftqp.viz.playground.playground_page import Played, playground_page

TEXTS: Final = Path(__file__).with_name("c")
TARGETS: Final = ("host", "x86-64-v3", "aarch64", "wasm32")
PARTS: Final = ("detector", "path")
"""What may be asked for by name; a detector is in each."""
NO_PATH: Final = "a path (ftqp_follow, ftqp_speed): targets are given by the program's own clock"
NO_WAY_BACK: Final = "the way that the arm has come (ftqp_ways_out): build a planner with remember"
NO_ESCAPE: Final = "motions on the spot and bridges on the path: one that cannot go on waits"
MAKER: Final = "ftqp.kernel.building.deployed"
UNITS: Final = 130
"""So many units a library has at least; compiling those that are known finds the others."""


class CannotBuild(FtqpError):
    """The library cannot be built here; the message says why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BuildRequest:
    """What is to be built."""

    planner: Planner  # Of the arm, without any fault
    name: str  # Of the arm or the scenario
    target: str  # One of TARGETS
    cpu: str | None  # A processor by LLVM's name; None is the target's class
    embed: bool  # Whether the arm's file is a part of ``arm.h``, too
    folder: Path  # Which is made
    # Whether the library has room for arms of about as many joints only, and takes less memory
    small: bool = False
    path: Way | None = None  # What is followed by the library itself; None where a program gives targets

    @property
    def most_joints(self) -> int:
        """The most joints of an arm in the library."""
        return small_capacity(self.planner.robot.nv) if self.small else JOINTS


def build_folder(
    wanted: BuildRequest, progress: Callable[[float], None] = lambda share: None
) -> dict[str, Any]:
    """Write the folder: the facts of its bill. ``progress`` hears which share of the work is done."""
    folder = wanted.folder
    if folder.exists():
        raise InputError(f"folder {folder} is there already; give a new one with -o")
    memory = wanted.planner.deployable()
    follower = None if wanted.path is None else PathFollower(wanted.planner, wanted.path, stall=None)
    file = arm_file(
        memory, wanted.planner.robot.nv, wanted.most_joints,
        path=None if follower is None else follower.memory, fingerprint=fingerprint(wanted.planner),
    )  # fmt: skip
    parent = folder.absolute().parent
    if not parent.is_dir():
        raise InputError(f"folder {parent} is missing, in which {folder.name} would be made")
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}.", dir=parent) as part:
        made = Path(part) / "made"
        (made / "include").mkdir(parents=True)
        for name in ("ftqp.h", "ftqp.hpp"):
            shutil.copy(TEXTS / name, made / "include" / name)
        library = _library(wanted, made, progress)
        header = arm_header(
            wanted.planner,
            wanted.name,
            file,
            embedded=wanted.embed,
            joints=wanted.most_joints,
            duration=None if wanted.path is None else wanted.path.duration,
        )
        (made / "arm.h").write_text(header, encoding="utf-8")
        (made / "arm.ftqp").write_bytes(file)
        if wanted.target == "wasm32":
            shutil.copy(TEXTS / "ftqp.mjs", made / "lib" / "ftqp.mjs")
        else:
            shutil.copytree(TEXTS / "example", made / "example")
            (made / "cmake").mkdir()
            shutil.copy(TEXTS / "ftqp-config.cmake", made / "cmake" / "ftqp-config.cmake")
        left_out = [*memory.left_out, NO_PATH if wanted.path is None else NO_ESCAPE]
        left_out += [] if memory.came_every else [NO_WAY_BACK]
        bill = _bill(wanted, library, left_out, made)
        (made / "bill.json").write_text(json.dumps(bill, indent=1) + "\n", encoding="utf-8")
        os.rename(made, folder)
    return bill


def _library(wanted: BuildRequest, made: Path, progress: Callable[[float], None]) -> dict[str, Any]:
    """Compile and link it in a process of its own: what that says of it."""
    if not (KERNEL / "building" / "deployed.py").is_file():
        raise CannotBuild(
            "this installation of ftqp was made without what builds its kernel; install it anew"
        )
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "layout.h").write_text(layout_header(wanted.most_joints), encoding="utf-8")
        command = [
            sys.executable, "-P", "-m", MAKER, "--target", wanted.target, "--source", str(TEXTS),
            "--layout", folder, "--out", str(made / "lib"), "--joints", str(wanted.most_joints),
            *(["--cpu", wanted.cpu] if wanted.cpu else []),
            *(["--path"] if wanted.path is not None else []),
        ]  # fmt: skip
        path = os.pathsep.join(filter(None, [str(KERNEL.parents[1]), os.environ.get("PYTHONPATH", "")]))
        env = {**os.environ, "PYTHONPATH": path}
        with tempfile.TemporaryFile("w+", encoding="utf-8") as errors:
            last = "{}"
            with subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=errors, text=True, env=env
            ) as maker:
                try:
                    for last in maker.stdout or ():
                        facts = json.loads(last)
                        if "known" in facts:
                            progress(facts["compiled"] / max(facts["known"], UNITS))
                except BaseException:
                    maker.kill()
                    raise
            errors.seek(0)
            said = errors.read().strip() or "it ended without a word"
    if maker.returncode:
        said = said.splitlines()[-1] if said.startswith("Traceback") else said
        raise CannotBuild(f"the library for {wanted.target} is not built: {said}")
    made_of: dict[str, Any] = json.loads(last)
    return made_of


def _bill(wanted: BuildRequest, library: dict[str, Any], left_out: list[str], made: Path) -> dict[str, Any]:
    files = sorted(path for path in made.rglob("*") if path.is_file())
    planner = wanted.planner
    return {
        "of": wanted.name, "robot": planner.robot.name, "joints": planner.robot.nv, "dt": planner.dt,
        "most_joints": wanted.most_joints, "drive": planner.drive.kind, "target": wanted.target,
        "triple": library["triple"],
        "cpu": library["cpu"], "ftqp": __version__, "kernel": kernel_hash(), "zig": library["zig"],
        "left_out": left_out,
        "compiled": library["compiled"], "units": library["units"],
        "files": {
            path.relative_to(made).as_posix(): {
                "bytes": path.stat().st_size,
                "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            }
            for path in files
        },
    }  # fmt: skip


def write_page(
    wanted: BuildRequest,
    q: FloatArray,
    path: Way | None,
    page: Path,
    progress: Callable[[float], None] = lambda share: None,
) -> dict[str, Any]:
    """Build the library for browsers, write the page with it, and return the bill of the library."""
    if page.exists():
        raise InputError(f"file {page} is there already; give a new one with --page")
    if not page.absolute().parent.is_dir():
        raise InputError(f"folder {page.absolute().parent} is missing, in which {page.name} would be made")
    with tempfile.TemporaryDirectory(prefix=f".{page.name}.", dir=page.absolute().parent) as part:
        bill = build_folder(wanted, progress)
        played = Played(
            title=wanted.name,
            planner=wanted.planner,
            q=q,
            path=path,
            kernel=kernel_hash(),
            wasm=(wanted.folder / "lib" / "ftqp.wasm").read_bytes(),
            arm=(wanted.folder / "arm.ftqp").read_bytes(),
            loader=(TEXTS / "ftqp.mjs").read_text(encoding="utf-8"),
        )
        made = Path(part) / "page"
        made.write_text(playground_page(played), encoding="utf-8")
        os.rename(made, page)
    return bill
