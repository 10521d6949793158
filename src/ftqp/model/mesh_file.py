"""Which files are taken for meshes: by their names, so that no reader unpacks what only a guess makes one."""

from pathlib import Path

from ftqp.core.errors import InputError

MESHES = (".stl", ".obj", ".ply", ".glb", ".dae")
"""How names of meshes end."""
ARCHIVES = (b"PK", b"\x1f\x8b", b"BZh", b"7z", b"Rar!", b"\xfd7zXZ", b"\x28\xb5\x2f\xfd")
"""How archives and packed files begin: a zip of 10 MB can hold gigabytes."""


def refuse_other_than_mesh(file: Path) -> None:
    """Refuse a file that no reader of meshes is to see."""
    if file.suffix.lower() not in MESHES:
        kinds = ", ".join(end[1:].upper() for end in MESHES)
        raise InputError(
            f"mesh {str(file)!r:.200} is packed, or is no mesh (it ends in {file.suffix!r:.20}, expected one "
            f"of {kinds}); convert it to STL"
        )
    try:
        with file.open("rb") as opened:
            begins = opened.read(8)
    except OSError as error:
        raise InputError(f"mesh {str(file)!r:.200} cannot be read: {error.strerror}") from error
    if begins.startswith(ARCHIVES):
        raise InputError(f"mesh {str(file)!r:.200} is an archive, expected a mesh; unpack it first")
