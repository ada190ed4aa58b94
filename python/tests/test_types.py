"""Types: the package and its stubs, checked by mypy; the stubs against the module, by stubtest."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

USER = """
import micromotor as mm
import numpy as np
from numpy.typing import NDArray

scene = mm.Scene({"position.to_deg": 37, "ldv.installed": False})
move: mm.Result = mm.position(scene, every=10)
times: NDArray[np.float64] = move.course["time_s"]
found: mm.Filtered = mm.run_filter(scene, camera=(times, times))


def controller(moment: mm.Moment) -> float:
    return 0.0 if moment.estimate is None else -moment.estimate.angle_deg


mm.Loop(scene).run(controller, 0.1)
"""


def run(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", *arguments], cwd=cwd, capture_output=True, text=True, check=False)


def test_law_package_stubs_and_a_user_s_program_are_typed(tmp_path: Path) -> None:
    """Strictly; and a program with a slip is refused, so that the types are those of the package and not `Any`."""
    (tmp_path / "user.py").write_text(USER)
    checked = run("mypy", "--strict", "-m", "user", "-p", "micromotor", cwd=tmp_path)
    assert checked.returncode == 0, checked.stdout
    (tmp_path / "slip.py").write_text(USER.replace("mm.Loop(scene)", "mm.Loop('scene')"))
    assert 'incompatible type "str"' in run("mypy", "--strict", "slip.py", cwd=tmp_path).stdout


def test_law_stubs_are_those_of_the_module(tmp_path: Path) -> None:
    checked = run("mypy.stubtest", "micromotor", cwd=tmp_path)
    assert checked.returncode == 0, checked.stdout
