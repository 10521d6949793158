"""The folder in which compiled code is kept: ours, and writable by nobody else, or not used at all.

Machine code from a folder that others can write is code of theirs. The folder itself, what lies in it, and
every folder above it must belong to us (those above: or to root), and nobody else may write there. Above it,
a folder in which everybody may create but only the owner may remove (``/tmp``) is allowed.
"""

import atexit
import contextlib
import errno
import logging
import os
import shutil
import stat
import sys
import tempfile
from pathlib import Path

VARIABLE = "FTQP_CACHE_DIR"
"""The environment variable that names the folder of the compiled kernel."""

_READ = os.O_RDONLY
for _flag in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_BINARY"):  # each where the system has it
    _READ |= getattr(os, _flag, 0)

_LOG = logging.getLogger("ftqp")


def home() -> Path:
    """The folder that compiled code shall be kept in: ``FTQP_CACHE_DIR``, or one in the user's cache folder.

    Raises:
        RuntimeError: if the user has no home.
    """
    given = os.environ.get(VARIABLE)
    if given:
        return Path(given).absolute()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home())
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        named = os.environ.get("XDG_CACHE_HOME", "")
        base = Path(named) if os.path.isabs(named) else Path.home() / ".cache"
    return base / "ftqp"


def own(folder: Path) -> Path:
    """The folder without links in its path, made for us alone if it is missing.

    Args:
        folder: an absolute path.

    Raises:
        OSError: if it cannot be made, read or written, or if somebody else could put something into it.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if folder.is_symlink():
        raise _unusable(folder, "is a link")
    folder = folder.resolve(strict=True)
    for place in (folder, *folder.parents):
        problem = _foreign(os.lstat(place), itself=place == folder)
        if problem:
            raise _unusable(place, problem)
    if not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
        raise _unusable(folder, "cannot be written")
    return folder


def _unusable(place: Path, problem: str) -> OSError:
    return OSError(errno.EPERM, f"{place} {problem}")


def _foreign(what: os.stat_result, *, itself: bool) -> str:
    """Why somebody else could change what lies in a folder or below; empty where nobody can.

    Args:
        what: the folder's state.
        itself: whether it is the folder that compiled code lies in, not one above it.
    """
    if not stat.S_ISDIR(what.st_mode):
        return "is not a folder"
    if not hasattr(os, "getuid"):
        return ""
    if what.st_uid != os.getuid() and (itself or what.st_uid != 0):
        return "belongs to another user"
    if _others_write(what) and (itself or not what.st_mode & stat.S_ISVTX):
        return "can be written by other users"
    return ""


def _others_write(what: os.stat_result) -> bool:
    if what.st_mode & stat.S_IWOTH:
        return True
    return bool(what.st_mode & stat.S_IWGRP) and not _is_group_of_ours_alone(what.st_gid)


def _is_group_of_ours_alone(group: int) -> bool:
    """Whether it is the group that many systems give each user: of the same name, with nobody else in it."""
    import grp
    import pwd

    try:
        user, found = pwd.getpwuid(os.getuid()), grp.getgrgid(group)
    except KeyError:
        return False
    return group == user.pw_gid and found.gr_name == user.pw_name and set(found.gr_mem) <= {user.pw_name}


def read_own(path: Path) -> bytes | None:
    """The content of a plain file that belongs to us and that nobody else can write; else ``None``."""
    try:
        handle = os.open(path, _READ)
    except (OSError, ValueError):
        return None
    try:
        what = os.fstat(handle)
        if not stat.S_ISREG(what.st_mode):
            return None
        if hasattr(os, "getuid") and (what.st_uid != os.getuid() or _others_write(what)):
            return None
        with os.fdopen(handle, "rb", closefd=False) as file:
            return file.read()
    except (OSError, MemoryError):
        return None
    finally:
        os.close(handle)


def installed_problem(place: Path) -> str:
    """Why somebody else could have changed a file or folder of the installation; empty where nobody could.

    It must belong to us, to root, or to whoever installed this very Python file, and no other user may write.
    """
    what = os.stat(place)
    if not hasattr(os, "getuid"):
        return ""
    if what.st_uid not in (os.getuid(), 0, os.stat(__file__).st_uid):
        return "belongs to another user"
    return "can be written by other users" if _others_write(what) else ""


def refused(place: Path, problem: str) -> None:
    """Say in one sentence that compiled code which is there is not used."""
    _LOG.warning(
        "%s %s, so its machine code is not loaded; the kernel is compiled anew, or runs as plain Python "
        "where numba is missing",
        place,
        problem,
    )


def write_own(path: Path, content: bytes) -> str:
    """Write a file in one go: there is all of it, or nothing; why it failed, empty where it did not."""
    temporary = ""
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        if temporary:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        return f"{path.parent} is full" if full else f"{path} cannot be written ({error.strerror or error})"
    return ""


class Warned:
    """Says once, in one sentence, that compiled code is not kept."""

    def __init__(self) -> None:
        self._said = False

    def say(self, problem: str) -> None:
        """Log the sentence, unless one was logged before."""
        if not self._said:
            self._said = True
            _LOG.warning(
                "the compiled kernel is not kept for the next start: %s; %s=FOLDER names another place",
                problem,
                VARIABLE,
            )


def private_folder() -> Path | None:
    """A fresh folder for this process and those it starts, removed at its end; ``None`` if it cannot be.

    The environment variable ``FTQP_CACHE_DIR`` tells the processes that it starts.
    """
    try:
        folder = Path(tempfile.mkdtemp(prefix="ftqp-")).resolve()
    except OSError:
        return None
    owner = os.getpid()

    def remove() -> None:
        if os.getpid() == owner:
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    os.environ[VARIABLE] = str(folder)
    return folder
