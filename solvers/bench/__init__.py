"""What solvers, benchmarks and studies share: the modules of ``bench``, the folder beside this one."""

from pathlib import Path

__path__ = [str(Path(__file__).resolve().parents[2] / "bench")]
