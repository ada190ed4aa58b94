"""Runs of the module beside the command, in one run: the same scenes, turn by turn.

    pip install ./python
    cargo build --release
    python python/benches/runs.py target/release/host-sim [TURNS [PART]]

The command's time is that of its process, start and output included; the module's that of the call. PART of 0.1 makes
each run a tenth as long.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import micromotor as mm

TURNS = int(sys.argv[2]) if len(sys.argv) > 2 else 5
PART = float(sys.argv[3]) if len(sys.argv) > 3 else 1.0
MOTORS = max(1, round(40 * PART))

CASES: list[tuple[str, dict[str, Any], Callable[[mm.Scene], mm.Result]]] = [
    ("position", {"position.to_deg": 360 * PART}, mm.position),
    ("rate", {"rate.duration_s": 10 * PART}, mm.rate),
    ("simulate", {"simulate.duration_s": 10 * PART}, mm.simulate),
    ("positioning-trials", {}, lambda scene: mm.trials(scene, MOTORS)),
]


def timed(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def main() -> None:
    program = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        print("                     command      module   module's speed per the command's")
        for name, sets, run in CASES:
            flags = [word for key, value in sets.items() for word in ("--set", f"{key}={value}")]
            flags += ["--motors", str(MOTORS)] if name == "positioning-trials" else []
            line = [program, "-q", name, *flags, "--format", "json"]
            scene = mm.Scene(sets)
            times = [
                (
                    timed(lambda: subprocess.run(line, cwd=folder, check=True, capture_output=True)),
                    timed(lambda: run(scene)),
                )
                for _ in range(TURNS)
            ]
            command_s, module_s = (min(column) for column in zip(*times, strict=True))
            print(f"{name:20} {command_s:7.3f} s   {module_s:7.3f} s   {command_s / module_s:.2f}")


main()
