"""Logs: written by runs and of one's own measurements, read as tables.

A Parquet log is a table that ``pandas.read_parquet`` and ``polars.read_parquet`` read.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from . import _micromotor
from ._micromotor import Scene
from .filters import _Measured
from .results import Result, Table


@dataclass(frozen=True)
class Log:
    """An MCAP log.

    Attributes:
        command: The command that wrote it: ``position``, ``rate``, ``record``, ``import``.
        filter: The filter that ran; ``none`` of a recording.
        scene: The scene of the run.
        ended: ``whole``, ``interrupted`` or ``no room``; ``None`` of a log that was cut off.
        result: What the run gave; ``None`` if it did not end.
        tables: The channels that have messages, by their topics: ``/camera``, ``/vibrometer``, ``/truth``,
            ``/estimate``, ``/innovation``, ``/drive`` and more. Each has ``time_s`` and the fields of its messages.
    """

    command: str
    filter: str
    scene: Scene
    ended: str | None
    result: Result | None
    tables: dict[str, Table]


def read_log(path: str | os.PathLike[str]) -> Log:
    """Read an MCAP log.

    Raises:
        LogError: The file is no log, of another version, or damaged.
    """
    command, filter_name, scene, ended, result, tables = _micromotor.read_log(path)
    return Log(command, filter_name, scene, ended, None if result is None else Result(result), tables)


def write_recording(
    path: str | os.PathLike[str],
    scene: Scene | None = None,
    *,
    camera: Sequence[ArrayLike] | None = None,
    vibrometer: Sequence[ArrayLike] | None = None,
    drive: Sequence[ArrayLike] | None = None,
) -> Result:
    """Write measurements of one's own as a log, as ``host-sim import`` does: for :func:`micromotor.identify`.

    Args:
        path: ``.mcap`` for :func:`micromotor.identify` and ``host-sim replay``, ``.parquet`` or ``.csv`` for a table.
        scene: Design of the motor and what the instruments are, as for :func:`micromotor.run_filter`.
        camera, vibrometer, drive: As for :func:`micromotor.run_filter`; at least one of the first two.

    Returns:
        What was written: length, rates, gaps, rows left out, and advice in sentences.

    Raises:
        SceneError: A setting is refused.
        LogError: The log cannot be written, or there are too few measurements.
    """
    return Result(_micromotor.write_recording(path, scene or Scene(), _Measured(camera, vibrometer, drive)))
