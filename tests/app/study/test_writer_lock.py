"""The lock of a folder's only writer: why it is not to be had is said as it is."""

import os
from contextlib import closing
from pathlib import Path

import pytest

from ftqp.app.study.writer_lock import LOCK_NAME, locked
from ftqp.core.errors import InputError


def test_only_a_lock_that_is_held_is_another_process(tmp_path: Path) -> None:
    held = r"another process writes to .*; wait until it has ended, or rest"
    with closing(locked(tmp_path, "rest")), pytest.raises(InputError, match=held):
        locked(tmp_path, "rest")
    locked(tmp_path, "wait").close()


def test_full_disk_is_not_taken_for_another_process(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource", reason="needs a system that limits the size of files")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, before[1]))
        with pytest.raises(InputError, match=r"cannot be written: .*full.*; free the disk"):
            locked(tmp_path, "wait")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    locked(tmp_path, "wait").close()


def test_folder_that_cannot_be_opened_for_writing_is_not_taken_for_another_process(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none cannot be written: .* \(the disk is full, or the folder is"):
        locked(tmp_path / "none", "wait")


@pytest.mark.parametrize("kind", ["short text", "text", "folder", "pipe", "link to nothing"])
def test_what_is_no_lock_is_named_with_its_remedy(tmp_path: Path, kind: str) -> None:
    file = tmp_path / LOCK_NAME
    if kind == "short text":
        file.write_text("hold", encoding="utf-8")
    elif kind == "text":
        file.write_text("not a database, but long enough to be looked at" * 30, encoding="utf-8")
    elif kind == "folder":
        file.mkdir()
    elif kind == "pipe":
        os.mkfifo(file)
    else:
        file.symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match=f"{LOCK_NAME} is not the lock that ftqp keeps there: .*; delete it"):
        locked(tmp_path, "wait")
