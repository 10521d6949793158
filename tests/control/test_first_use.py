"""A first use is announced, once, and only when something has to be compiled."""

import pytest

from ftqp.control import first_use
from ftqp.kernel.entry import compile as compiled
from ftqp.kernel.jit import COMPILED


def test_what_is_compiled_already_is_not_announced(capfd):
    first_use.warm_up(external=True)
    capfd.readouterr()
    first_use.warm_up(external=True)
    assert capfd.readouterr().err == ""


@pytest.mark.skipif(not COMPILED, reason="the kernel runs as plain Python")
def test_compilation_is_announced_on_stderr_before_it_begins(monkeypatch, capfd, tmp_path):
    said = []
    monkeypatch.setattr(compiled, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(compiled, "_compile", lambda names: said.append((names, capfd.readouterr().err)))
    monkeypatch.setattr(compiled, "entry", type("Nothing", (), {"step": type("Raw", (), {"signatures": []})}))
    compiled.compile_entries(("step",), first_use.notice)
    assert said == [(["step"], first_use.NOTICE + "\n")]


def test_notice_names_the_remedy():
    assert "ftqp warmup" in first_use.NOTICE


@pytest.mark.skipif(not COMPILED, reason="the kernel runs as plain Python")
def test_external_entries_and_the_network_are_compiled_only_when_asked(monkeypatch):
    asked = []
    monkeypatch.setattr(first_use, "compile_entries", lambda names, announce: asked.append(set(names)))
    first_use.warm_up(external=False, network=False)
    first_use.warm_up(network=False)
    first_use.warm_up()
    first_use.warm_up(base=False)
    assert asked[1] - asked[0] == set(compiled.EXTERNAL)
    assert asked[2] - asked[1] == set(compiled.NETWORK)
    assert asked[2] - asked[3] == set(compiled.BASE)
    assert "step" in asked[0]
