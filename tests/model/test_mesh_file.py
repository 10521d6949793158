"""Meshes are taken by their names, and archives for none."""

import gzip
import zipfile

import numpy as np
import pytest

import ftqp
from ftqp.viz.live.meshes import read_mesh

CORNERS = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    + "".join(f"{x} {y} {z}\n" for x, y, z in CORNERS)
    + "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
)
READERS = {"hull": lambda file: ftqp.Hull(mesh=str(file)), "page": read_mesh}


@pytest.fixture(params=list(READERS))
def read(request):
    if request.param == "page":
        pytest.importorskip("trimesh")
    return READERS[request.param]


@pytest.mark.parametrize(
    "name", ["part.zip", "part.3mf", "part.pk3", "part.zae", "part", "part.gltf", "part.off"]
)
def test_a_file_of_another_name_is_refused_unread(tmp_path, read, name):
    with zipfile.ZipFile(tmp_path / name, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("part.obj", OBJ)
    with pytest.raises(ftqp.InputError, match="expected one of STL, OBJ, PLY, GLB, DAE"):
        read(tmp_path / name)


@pytest.mark.parametrize("name", ["part.stl", "part.OBJ", "part.ply", "part.glb", "part.dae"])
@pytest.mark.parametrize("packed", ["zip", "gzip"])
def test_an_archive_under_the_name_of_a_mesh_is_refused(tmp_path, read, name, packed):
    if packed == "zip":
        with zipfile.ZipFile(tmp_path / name, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("part.obj", OBJ)
    else:
        (tmp_path / name).write_bytes(gzip.compress(OBJ.encode()))
    with pytest.raises(ftqp.InputError, match="is an archive, expected a mesh"):
        read(tmp_path / name)


@pytest.mark.parametrize(("name", "text"), [("part.obj", OBJ), ("part.OBJ", OBJ), ("part.ply", PLY)])
def test_a_mesh_is_read(tmp_path, read, name, text):
    (tmp_path / name).write_text(text, encoding="utf-8")
    read(tmp_path / name)
