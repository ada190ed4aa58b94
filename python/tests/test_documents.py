"""The Python of README and documentation runs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("page", ["python/README.md", "docs/python.md"])
def test_tool_examples_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The blocks of a page one after the other, in one namespace and a folder of their own."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), flags=re.DOTALL)
    assert blocks
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)


def test_dual_benches_run_and_peers_agree() -> None:
    """With few measurements, the core has the states of FilterPy and pykalman; in one turn, each command runs."""
    for bench, *arguments in (["kalman.py", "2000"], ["runs.py", os.environ["MICROMOTOR_COMMAND"], "1", "0.1"]):
        line = [sys.executable, str(ROOT / "python/benches" / bench), *arguments]
        printed = subprocess.run(line, check=True, capture_output=True, text=True).stdout
        assert len(printed.splitlines()) >= 4, printed
