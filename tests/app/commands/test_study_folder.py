"""The folder of a study: one whose study ended before its results file was made is gone on in."""

from contextlib import closing
from pathlib import Path

import pytest

from ftqp.app.study.results_file import FILE_NAME, locked
from ftqp.app.study.runner import study_folder
from ftqp.core.errors import InputError


@pytest.mark.parametrize("content", [None, "nothing", "lock", "results"])
def test_folder_with_no_more_than_a_study_leaves_is_taken(tmp_path: Path, content: str | None) -> None:
    out = tmp_path / "out"
    if content is not None:
        out.mkdir()
    if content == "lock":
        locked(out, "rest").close()
        with closing(locked(out, "rest")):
            assert study_folder(out, "x") == out
    elif content == "results":
        (out / FILE_NAME).touch()
        (out / "summary.json").touch()
    assert study_folder(out, "x") == out


def test_folder_with_anything_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").touch()
    locked(tmp_path, "rest").close()
    with pytest.raises(InputError, match="exists, and nothing is overwritten"):
        study_folder(tmp_path, "x")
    with pytest.raises(InputError, match="exists, and nothing is overwritten"):
        study_folder(tmp_path / "mine.txt", "x")
