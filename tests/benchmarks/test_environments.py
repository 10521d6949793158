"""A peer that cannot be installed says why."""

from pathlib import Path

import pytest
from steps.environments import NotInstalled, Peer, python_of


def test_a_package_that_does_not_exist_is_told_in_one_sentence(tmp_path: Path) -> None:
    missing = str(tmp_path / "nothing_here")
    peer = Peer(name="nobody", module="bench.nobody", packages=(missing,))
    with pytest.raises(NotInstalled, match=r"nobody could not be installed: .*nothing_here"):
        python_of(peer, tmp_path)


def test_an_environment_that_was_made_is_used_again(tmp_path: Path) -> None:
    peer = Peer(name="empty", module="bench.empty", packages=("pip",))
    python = python_of(peer, tmp_path)
    made = python.stat().st_ctime_ns
    assert python_of(peer, tmp_path) == python
    assert python.stat().st_ctime_ns == made
