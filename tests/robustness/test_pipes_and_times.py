"""Pipes in the place of files never let anybody wait, and times that no arm knows are refused."""

import os
import threading

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes in its file system")
def test_pipe_in_the_place_of_a_profile_is_refused_at_once(tmp_path):
    pipe = tmp_path / "profile.toml"
    os.mkfifo(pipe)
    said = []

    def make():
        try:
            ftqp.Planner(ftqp.robots.load("planar(4)"), backend=pipe)
        except InputError as error:
            said.append(str(error))

    user = threading.Thread(target=make, daemon=True)
    user.start()
    user.join(60.0)
    assert said and said[0].endswith("profile.toml is not a regular file; expected a TOML file")


@pytest.mark.parametrize("dt", [1e-9, 5e-324, 1e-300, 9e-7])
def test_sampling_period_that_no_arm_takes_is_refused(dt):
    with pytest.raises(InputError, match=r"dt is .* s, expected at least 1e-06 s"):
        ftqp.Planner(ftqp.robots.load("planar(4)"), dt)


@pytest.mark.parametrize("duration", [1e10, 1e300])
def test_path_of_a_thousand_years_is_refused(duration):
    with pytest.raises(InputError, match=r"duration of the path is .* expected at most 1e\+09 s"):
        ftqp.paths.Line(np.eye(4), (0.1, 0.0, 0.0), duration=duration)
