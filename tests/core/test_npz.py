"""Files of arrays come back as they were written, and nothing in them is run."""

import io
import zipfile

import numpy as np
import pytest

from ftqp.core.npz import npz_arrays

GOOD = np.linspace(0.0, 1.0, 5)


def npy(array, **how):
    file = io.BytesIO()
    np.save(file, array, **how)
    return file.getvalue()


class Evil:
    def __reduce__(self):
        return exec, ("raise SystemExit('code of the file ran')",)


def test_arrays_of_numpy_are_read_as_they_are(tmp_path):
    arrays = {"q": GOOD, "T": np.eye(4)[::-1], "whole": np.arange(3), "about": np.array("{}")}
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "a.npz", **arrays)
        found = npz_arrays(tmp_path / "a.npz")
        assert list(found) == list(arrays)
        for name, array in arrays.items():
            np.testing.assert_array_equal(found[name], array)


@pytest.mark.parametrize(
    "content", [npy(np.array([Evil()], dtype=object), allow_pickle=True), npy(GOOD)[:-8], b"\x93NUMPY"]
)
def test_array_that_is_damaged_or_would_run_code_is_refused(tmp_path, content):
    path = tmp_path / "arrays.npz"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("x.npy", content)
    for whole in (path.read_bytes(), content, b"", b"hello"):
        path.write_bytes(whole)
        with pytest.raises(ValueError, match="damaged"):
            npz_arrays(path)
