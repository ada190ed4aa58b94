"""Runs and studies. Each reads the keys that the command of the same name reads, and gives what it prints.

All of them release Python's lock while they compute, and end at Ctrl-C with ``KeyboardInterrupt``.
"""

from __future__ import annotations

import os
from collections.abc import Callable

from . import _micromotor
from ._micromotor import Scene
from .results import Result

Progress = Callable[[int, int], object]
"""Is told what is done, and the total. It is called in the thread that waits for the result, at most 20 times a second;
an exception that it raises ends the study."""

Path = str | os.PathLike[str]


def _log(path: Path | None, every: int) -> tuple[Path, int] | None:
    return None if path is None else (path, every)


def simulate(scene: Scene | None = None, *, every_s: float | None = None) -> Result:
    """Run the nominal motor in open loop under a constant drive: keys ``simulate.`` and ``motor.``.

    Args:
        scene: The settings.
        every_s: Time in s from row to row of the course; none is kept without it.

    Returns:
        Rate, impacts, angle turned. ``course`` has ``time_s``, ``height_m``, ``velocity_m_s``, ``angle_deg``,
        ``rate_rad_s``, ``tooth_height_0_m``, ``tooth_height_1_m`` and ``drive``.

    Raises:
        SceneError: A setting is refused.
        RunError: The run diverged.
    """
    text, course = _micromotor.simulate(scene or Scene(), every_s)
    return Result(text, {"course": course})


def position(
    scene: Scene | None = None, *, every: int = 100, log: Path | None = None, log_every: int = 10
) -> Result:
    """Move the rotor of a drawn motor to ``position.to_deg`` in closed loop.

    Args:
        scene: The settings.
        every: Ticks of 10 us from row to row of the course; 0 keeps none.
        log: Where to write all that happens: ``.mcap``, ``.parquet`` or ``.csv``.
        log_every: Ticks from one logged truth and estimate to the next.

    Returns:
        What became of the move. ``course`` has ``time_s``, ``truth_angle_deg``, ``truth_rate_rad_s``,
        ``estimate_angle_deg``, ``estimate_angle_sd_mdeg``, ``estimate_rate_rad_s``, ``estimate_rate_sd_rad_s``,
        ``drive`` (its size is the amplitude, its sign the mode: mode B is positive), and ``health``
        (:class:`micromotor.Health`); NaN before the first estimate.

    Raises:
        SceneError: A setting is refused.
        LogError: The log cannot be written.
    """
    text, course = _micromotor.position(scene or Scene(), every, _log(log, log_every))
    return Result(text, {"course": course})


def plan(scene: Scene | None = None) -> Result:
    """Say what the move of :func:`position` will take, without moving.

    Raises:
        SceneError: A setting is refused.
    """
    return Result(_micromotor.plan(scene or Scene()))


def rate(
    scene: Scene | None = None, *, every: int = 100, log: Path | None = None, log_every: int = 10
) -> Result:
    """Hold the rate ``rate.deg_s`` in closed loop, or follow a profile of rates.

    Arguments, course and exceptions are those of :func:`position`. The course also has ``wanted_rate_rad_s`` and
    ``reference_angle_deg``: the rate asked for, and the angle that the rotor should have.
    """
    text, course = _micromotor.rate(scene or Scene(), every, _log(log, log_every))
    return Result(text, {"course": course})


def record(
    scene: Scene | None = None, *, every: int = 100, log: Path | None = None, log_every: int = 10
) -> Result:
    """Record the true motor, or its bare stator, under the drives of ``record.schedule``.

    Args:
        scene: The settings.
        every: Ticks of 10 us from row to row of the truth; 0 keeps none.
        log: Where to write the recording: ``.mcap`` for :func:`identify`.
        log_every: Ticks from one logged truth to the next.

    Returns:
        What was recorded, with the tables ``camera`` (``time_s`` of the middle of each exposure, ``angle_deg`` within
        the turn), ``vibrometer`` (``time_s``, ``velocity_m_s``), ``drive`` (``time_s``, ``drive``,
        ``frequency_offset_hz``: each row holds from its time on) and ``truth`` (``time_s``, ``angle_deg``,
        ``rate_rad_s``).

    Raises:
        SceneError: A setting is refused.
        LogError: The log cannot be written.
    """
    text, tables = _micromotor.record(scene or Scene(), every, _log(log, log_every))
    return Result(text, dict(zip(("camera", "vibrometer", "drive", "truth"), tables, strict=True)))


def calibrate(
    scene: Scene | None = None, *, runs: int = 1, motors: int = 10, progress: Progress | None = None
) -> Result:
    """Calibrate gyroscopes on the rotor: scale factor and bias with their intervals, against the truth.

    Args:
        scene: The settings: keys ``calibrate.`` and ``gyroscope.`` among them.
        runs: Calibrations, each of another gyroscope.
        motors: Motors that they are spread over, at most one a calibration.
        progress: Is told how many motors are done, of how many.

    Returns:
        The first calibration, and figures over all. Tables: ``runs``, a row a calibration; ``rates`` (``time_s``,
        ``rate_deg_s``) of the first gyroscope; ``allan`` (``span_s``, ``deviation_deg_h``, ``model_deg_h``) of it at
        rest.

    Raises:
        SceneError: A setting is refused.
    """
    text, tables = _micromotor.calibrate(scene or Scene(), runs, motors, progress)
    return Result(text, dict(zip(("runs", "rates", "allan"), tables, strict=True)))


def trials(scene: Scene | None = None, motors: int = 1000, *, progress: Progress | None = None) -> Result:
    """Move many drawn motors, each to a target of its own, on all processors.

    Args:
        scene: The settings. Its seed names the first motor, the seeds that follow it the others.
        motors: How many.
        progress: Is told how many moves are done, of how many.

    Returns:
        Figures over all moves. The table ``trials`` has a row a move: ``seed``, ``target_deg``, ``final_error_mdeg``,
        ``settle_s`` (NaN of a move that was given up), and more.

    Raises:
        SceneError: A setting is refused.
    """
    text, table = _micromotor.trials(scene or Scene(), motors, progress)
    return Result(text, {"trials": table})
