import logging
import os
import stat
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest

from ftqp.kernel.compiled import folder
from ftqp.kernel.compiled.mode import COMPILED

pytestmark = pytest.mark.skipif(not hasattr(os, "getuid"), reason="this system has no owners and modes")
as_root = pytest.mark.skipif(
    not hasattr(os, "getuid") or os.getuid() != 0, reason="only root can give a folder to another user"
)
needs_numba = pytest.mark.skipif(not COMPILED, reason="the kernel runs as plain Python")
NOBODY = 65534


def made(place: Path, mode: int = 0o700) -> Path:
    place.mkdir()
    place.chmod(mode)
    return place


def test_missing_folder_is_made_for_us_alone(tmp_path: Path) -> None:
    place = folder.own(tmp_path / "a" / "b")
    assert place.is_dir()
    assert stat.S_IMODE(place.stat().st_mode) == 0o700


@pytest.mark.parametrize("mode", [0o707, 0o777, 0o1777])
def test_folder_that_everybody_can_write_is_refused(tmp_path: Path, mode: int) -> None:
    with pytest.raises(OSError, match="can be written by other users"):
        folder.own(made(tmp_path / "open", mode))


def test_folder_in_one_that_everybody_can_write_is_refused(tmp_path: Path) -> None:
    inside = made(made(tmp_path / "open", 0o777) / "inside")
    with pytest.raises(OSError, match="open can be written by other users"):
        folder.own(inside)


def test_folder_in_one_where_only_owners_remove_is_used(tmp_path: Path) -> None:
    place = made(tmp_path / "sticky", 0o1777) / "inside"
    assert folder.own(place) == place.resolve()


def test_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(made(tmp_path / "real"))
    with pytest.raises(OSError, match="is a link"):
        folder.own(tmp_path / "link")


def test_link_above_is_followed_and_what_it_leads_through_is_looked_at(tmp_path: Path) -> None:
    made(tmp_path / "real")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    assert folder.own(tmp_path / "link" / "inside") == (tmp_path / "real" / "inside").resolve()
    (tmp_path / "real").chmod(0o777)
    with pytest.raises(OSError, match="can be written by other users"):
        folder.own(tmp_path / "link" / "inside")


def test_file_in_the_place_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for place in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(OSError):
            folder.own(place)


@as_root
@pytest.mark.parametrize("below", ["", "inside"])
def test_folder_of_another_user_is_refused(tmp_path: Path, below: str) -> None:
    place = made(tmp_path / "theirs")
    os.chown(place, NOBODY, NOBODY)
    with pytest.raises(OSError, match="belongs to another user"):
        folder.own(place / below)


@as_root
def test_folder_that_a_group_of_others_can_write_is_refused(tmp_path: Path) -> None:
    place = made(tmp_path / "shared", 0o770)
    os.chown(place, 0, NOBODY)
    with pytest.raises(OSError, match="can be written by other users"):
        folder.own(place)


def test_file_is_read_only_if_it_is_plain_and_ours_alone(tmp_path: Path) -> None:
    file = tmp_path / "file"
    assert folder.write_own(file, b"code") == ""
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert folder.read_own(file) == b"code"
    (tmp_path / "link").symlink_to(file)
    os.mkfifo(tmp_path / "pipe")
    made(tmp_path / "folder")
    for other in ("link", "pipe", "folder", "missing"):
        assert folder.read_own(tmp_path / other) is None
    file.chmod(0o602)
    assert folder.read_own(file) is None


@as_root
def test_file_of_another_user_is_not_read(tmp_path: Path) -> None:
    folder.write_own(tmp_path / "file", b"code")
    os.chown(tmp_path / "file", NOBODY, NOBODY)
    assert folder.read_own(tmp_path / "file") is None


def test_failed_writing_leaves_no_file_behind(tmp_path: Path) -> None:
    made(tmp_path / "taken")
    (tmp_path / "taken" / "inside").touch()
    assert "cannot be written" in folder.write_own(tmp_path / "taken", b"code")
    assert [place.name for place in tmp_path.iterdir()] == ["taken"]


def test_private_folder_is_new_ours_and_told_to_processes_that_are_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("FTQP_CACHE_DIR", "/nowhere")
    first, second = folder.private_folder(), folder.private_folder()
    assert first is not None and second is not None and first != second
    assert folder.own(first) == first
    assert os.environ["FTQP_CACHE_DIR"] == str(second)


def test_home_is_named_by_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("FTQP_CACHE_DIR", str(tmp_path))
    assert folder.home() == tmp_path
    monkeypatch.delenv("FTQP_CACHE_DIR")
    if sys.platform.startswith("linux"):
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "x"))
        assert folder.home() == tmp_path / "x" / "ftqp"
        monkeypatch.setenv("XDG_CACHE_HOME", "relative")
        assert folder.home() == Path.home() / ".cache" / "ftqp"


def test_one_sentence_says_that_nothing_is_kept(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING, logger="ftqp")
    warned = folder.Warned()
    warned.say("the disk is full")
    warned.say("again")
    assert len(caplog.messages) == 1
    assert "the disk is full" in caplog.messages[0] and "FTQP_CACHE_DIR" in caplog.messages[0]


WORKS = """
import os, resource, sys
from pathlib import Path
import numpy as np
from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.compiled.kernel import Kernel
from ftqp.kernel.compiled import folder, machine_code
from ftqp.kernel.compiled.making import lean
from ftqp.kernel.compiled.making import emit
from ftqp.kernel.compiled.making import guard
import ftqp.kernel.compiled.taking, ftqp.kernel.jit, numba, {module}
{before}
kernel = Kernel(Path({source!r}))
print(kernel.load(EntryPoint(name="fails", module={module!r}, factory="fails", signature="i"), 8)(5))
"""


def works(tiny: Any, before: str, **environment: str) -> str:
    """What a process that cannot keep its compiled code says on stderr."""
    done = subprocess.run(
        [sys.executable, "-c", WORKS.format(source=str(tiny.source), module=tiny.module, before=before)],
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tiny.source), *sys.path])} | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "5\n"), done.stderr
    return done.stderr


@needs_numba
def test_full_disk_costs_one_sentence(tiny: Any) -> None:
    said = works(tiny, "resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))")
    assert said.count("\n") == 1 and "cannot be written" in said


@needs_numba
def test_no_place_to_write_at_all_costs_one_sentence(tiny: Any) -> None:
    (tiny.source / "file").touch()
    nowhere = str(tiny.source / "file" / "below")
    said = works(
        tiny, f"import tempfile; tempfile.tempdir = {nowhere!r}", FTQP_CACHE_DIR=nowhere, TMPDIR=nowhere
    )
    assert said.count("\n") == 1 and "cannot be used" not in said and "Not a directory" in said


@needs_numba
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="no /proc, where nobody can make a folder")
def test_home_where_nothing_can_be_made_costs_one_sentence(tiny: Any) -> None:
    said = works(tiny, "", FTQP_CACHE_DIR="/proc/ftqp")
    assert said.count("\n") == 1 and "/proc/ftqp" in said


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() == 0, reason="root can write everywhere")
def test_read_only_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="cannot be written"):
        folder.own(made(tmp_path / "readonly", 0o500))


@needs_numba
@as_root
def test_folder_that_another_user_prepared_in_the_temporary_directory_is_never_used(
    tiny: Any, tmp_path: Path
) -> None:
    public = made(tmp_path / "tmp", 0o1777)
    prepared = [made(public / name, 0o777) for name in (f"ftqp-{os.getuid()}", "ftqp-cache", "ftqp")]
    for place in prepared:
        os.chown(place, NOBODY, NOBODY)
    said = works(tiny, "", FTQP_CACHE_DIR=str(prepared[-1]), TMPDIR=str(public))
    assert said.count("\n") == 1 and "belongs to another user" in said
    assert all(list(place.iterdir()) == [] for place in prepared)
    assert sorted(place.name for place in public.iterdir()) == sorted(place.name for place in prepared)
