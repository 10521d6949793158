"""Files of arrays: what is written comes back, nothing in them is run, and a damaged one is a sentence."""

import io
import zipfile

import numpy as np
import pytest

from ftqp.core.npz import npz_arrays, read_npz, write_npz

GOOD = np.linspace(0.0, 1.0, 5)


def npy(array, **how):
    file = io.BytesIO()
    np.save(file, array, **how)
    return file.getvalue()


class Evil:
    def __reduce__(self):
        return exec, ("raise SystemExit('code of the file ran')",)


def test_arrays_come_back_as_they_were(tmp_path):
    arrays = {"q": GOOD, "T": np.eye(4)[::-1], "whole": np.arange(3)}
    write_npz(tmp_path / "a.npz", arrays, {"name": "arm"})
    found, about = read_npz(tmp_path / "a.npz")
    assert about == {"name": "arm"} and list(found) == list(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)


@pytest.mark.parametrize(
    "content",
    [npy(np.array([Evil()], dtype=object), allow_pickle=True), npy(GOOD)[:-8], b"", b"\x93NUMPY"],
    ids=["code", "cut", "empty", "head"],
)
def test_array_that_is_not_what_it_says_is_refused(tmp_path, content):
    path = tmp_path / "arrays.npz"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("good.npy", npy(GOOD))
        file.writestr("x.npy", content)
    with pytest.raises(ValueError, match=r"truncated or damaged"):
        npz_arrays(path)


@pytest.mark.parametrize("content", [b"", b"hello", npy(GOOD), b"PK\x03\x04"])
def test_file_that_is_no_archive_is_refused(tmp_path, content):
    (tmp_path / "arrays.npz").write_bytes(content)
    with pytest.raises(ValueError, match=r"no archive of arrays"):
        npz_arrays(tmp_path / "arrays.npz")
