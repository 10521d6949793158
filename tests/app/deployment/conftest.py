"""One library for this machine, which all tests share: it is the same for every arm."""

import shutil

import pytest
from deployed_library import library

pytest.importorskip("numba", reason="needs numba, which the extra 'build' brings")
pytest.importorskip("ziglang", reason="needs ziglang, which the extra 'build' brings")


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """The folder that ``ftqp build`` writes for this machine."""
    if shutil.which("gcc") is None or shutil.which("g++") is None:
        pytest.skip("needs gcc and g++")
    return library("host", tmp_path_factory.mktemp("deployed") / "built")
