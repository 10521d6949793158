"""ProxQP is loaded in the build whose rounding is steady, unless somebody was faster."""

import subprocess
import sys

import pytest

LOADED = "print([m for m in sys.modules if m.startswith('proxsuite.proxsuite_pywrap')])"


def run(code):
    done = subprocess.run(
        [sys.executable, "-c", f"import sys\n{code}\n{LOADED}"], capture_output=True, text=True, check=True
    )
    return done.stdout.strip(), done.stderr


@pytest.mark.long
def test_backend_loads_the_build_that_rounds_steadily():
    loaded, said = run("import ftqp; ftqp.qp.backend('proxqp')")
    assert "'proxsuite.proxsuite_pywrap'" in loaded and "avx" not in loaded
    assert "loaded before" not in said


@pytest.mark.long
def test_list_of_backends_loads_it_too():
    loaded, _ = run("import ftqp; ftqp.qp.backends()")
    assert "'proxsuite.proxsuite_pywrap'" in loaded and "avx" not in loaded


@pytest.mark.long
def test_build_that_was_loaded_before_stays_and_is_said():
    loaded, said = run("import proxsuite, ftqp; ftqp.qp.backend('proxqp'); ftqp.qp.backend('proxqp')")
    if "avx" not in loaded:
        pytest.skip("this processor has no faster build")
    assert said.count("proxsuite was loaded before ftqp") == 1
