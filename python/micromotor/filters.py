"""Filters over arrays of measurements of one's own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _micromotor
from ._micromotor import Scene
from .results import Table

Floats = NDArray[np.float64]


class Health(IntEnum):
    """Whether an estimate may be used; GOOD and DEGRADED may."""

    GOOD = 0
    DEGRADED = 1
    UNUSABLE = 2
    WAITING = 3


class Reason(IntEnum):
    """Why an estimate is degraded or unusable."""

    NONE = 0
    VIBROMETER_SILENT = 1
    VIBROMETER_UNFIT = 2
    VIBROMETER_INVERTED = 3
    VIBROMETER_SCALE = 4
    VIBROMETER_ERRATIC = 5
    IMPACTS_UNEXPLAINED = 6
    CAMERA_SILENT = 7
    CAMERA_STUCK = 8
    NOISE_MISMATCH = 9
    FRAMES_REFUSED = 10
    REFERENCE_LOST = 11
    TURN_UNKNOWN = 12
    UNCERTAIN = 13


class Verdict(IntEnum):
    """What became of a camera frame; USED and RESTARTED changed the estimate."""

    USED = 0
    RESTARTED = 1
    OUT_OF_HORIZON = 2
    DUPLICATE = 3
    FUTURE = 4
    GATE = 5
    REPEATED = 6
    STUCK = 7


@dataclass(frozen=True)
class Filtered:
    """What a filter made of measurements.

    Attributes:
        estimates: ``time_s``, ``angle_deg`` over all turns, ``rate_deg_s``, ``covariance`` (n, 2, 2) of both in deg^2,
            deg^2/s and deg^2/s^2, ``resting``, ``health`` (:class:`Health`), ``reason`` (:class:`Reason`); NaN before
            the first frame.
        innovations: One row a camera frame: ``time_s`` of its exposure, ``innovation_deg`` and
            ``innovation_sd_deg`` (NaN where nothing was predicted), ``verdict`` (:class:`Verdict`).
    """

    estimates: Table
    innovations: Table


def _floats(numbers: ArrayLike) -> Floats:
    """As contiguous float64: a copy only of what is not."""
    return np.ascontiguousarray(numbers, dtype=np.float64)


class _Measured:
    """Measurements as the Rust side takes them."""

    camera: tuple[Floats, Floats] | None
    vibrometer: tuple[Floats, Floats] | None
    drive: tuple[Floats, Floats, Floats] | None

    def __init__(
        self,
        camera: Sequence[ArrayLike] | None,
        vibrometer: Sequence[ArrayLike] | None,
        drive: Sequence[ArrayLike] | None,
    ) -> None:
        self.camera = None if camera is None else _pair("camera", camera)
        self.vibrometer = None if vibrometer is None else _pair("vibrometer", vibrometer)
        self.drive = None
        if drive is not None:
            if len(drive) not in (2, 3):
                raise ValueError(f"drive has {len(drive)} arrays; times, drives and, if any, frequency offsets")
            times, drives = _floats(drive[0]), _floats(drive[1])
            offsets = _floats(drive[2]) if len(drive) == 3 else np.zeros_like(times)
            self.drive = (times, drives, offsets)


def _pair(name: str, arrays: Sequence[ArrayLike]) -> tuple[Floats, Floats]:
    if len(arrays) != 2:
        raise ValueError(f"{name} has {len(arrays)} arrays; times and values")
    return _floats(arrays[0]), _floats(arrays[1])


def run_filter(
    scene: Scene | None = None,
    *,
    camera: Sequence[ArrayLike],
    vibrometer: Sequence[ArrayLike] | None = None,
    drive: Sequence[ArrayLike] | None = None,
    every: int = 0,
    precision: Literal["f32", "f64"] = "f32",
) -> Filtered:
    """Run a filter over measurements, tick by tick as the controller does, frames after the camera's latency.

    Args:
        scene: The filter (``estimator.filter``: ``constant_rate``, ``impact_aided``, ``twin`` or ``best``), the design
            of the motor and what the instruments are. What it does not set of their rates and of the camera's marks
            comes from the arrays.
        camera: Times in s of the middles of the exposures, and angles in degrees, clockwise positive, each of shape
            (n,).
        vibrometer: Times in s and velocities in m/s, upwards positive, each of shape (m,).
        drive: Times in s, and the drive from each on, -1 to 1: its size is the amplitude, its sign the mode (mode B is
            positive). A third array has offsets in Hz from the frequency of the mode. Without it the drive is off, and
            the filter takes the rotor to be at rest.
        every: Ticks of 10 us from row to row of the estimates; 0 gives a row at each frame.
        precision: ``f32`` as on the microcontroller, or ``f64``.

    Arrays are not copied where they are contiguous ``float64``. A value that is not finite is left out.

    Raises:
        SceneError: A setting is refused.
        LogError: There are fewer than two measurements, or a gap of more than a minute.
        ValueError: Arrays have different lengths.
    """
    measured = _Measured(camera, vibrometer, drive)
    estimates, innovations = _micromotor.run_filter(scene or Scene(), measured, every, precision)
    return Filtered(estimates, innovations)


@dataclass(frozen=True)
class LinearFiltered:
    """What the core filter made of n measurements for k states.

    Attributes:
        states: (n, k), after each measurement.
        covariances: (n, k, k).
        innovations: (n,), measurement less prediction; NaN where there is none.
        innovation_variances: (n,).
        used: (n,), whether each measurement was used.
    """

    states: Floats
    covariances: Floats
    innovations: Floats
    innovation_variances: Floats
    used: NDArray[np.bool_]


class _Problem:
    """A linear problem as the Rust side takes it."""

    transition: list[float]
    noise_gains: list[float]
    noise_variances: list[float]
    row: list[float]
    measured_variance: float
    state: list[float]
    covariance: list[float]
    gate: float


def linear_filter(
    measurements: ArrayLike,
    *,
    transition: ArrayLike,
    process_noise: ArrayLike,
    row: ArrayLike,
    measured_variance: float,
    state: ArrayLike,
    covariance: ArrayLike,
    gate: float = math.inf,
) -> LinearFiltered:
    """Run the Kalman filter core, which keeps ``P = U D U'``, over scalar measurements of k = 1 to 4 states.

    Before each measurement ``x <- F x``, ``P <- F P F' + Q``; then ``z = h'x + noise`` is used.

    Args:
        measurements: (n,); NaN where there is none. Not copied if it is contiguous ``float64``.
        transition: F, (k, k).
        process_noise: Q, (k, k), symmetric and positive semidefinite.
        row: h, (k,).
        measured_variance: Variance of a measurement, positive.
        state: x before the first prediction, (k,).
        covariance: P before the first prediction, (k, k), positive semidefinite.
        gate: A measurement is left out when its innovation squared exceeds this many times its variance.

    Raises:
        ValueError: A shape or a matrix is refused.
    """
    start = _floats(state)
    k = start.size
    shapes = {"transition": (k, k), "process_noise": (k, k), "covariance": (k, k), "row": (k,)}
    given: dict[str, Any] = {
        "transition": transition,
        "process_noise": process_noise,
        "covariance": covariance,
        "row": row,
    }
    arrays = {name: _floats(array) for name, array in given.items()}
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise ValueError(f"{name} has the shape {arrays[name].shape}; {shape} for {k} states")
    variances, vectors = np.linalg.eigh(arrays["process_noise"])
    if variances.min(initial=0.0) < -1e-12 * variances.max(initial=0.0):
        raise ValueError("process_noise is not positive semidefinite")
    problem = _Problem()
    problem.transition = arrays["transition"].ravel().tolist()
    problem.noise_gains = vectors.T.ravel().tolist()
    problem.noise_variances = np.maximum(variances, 0.0).tolist()
    problem.row = arrays["row"].tolist()
    problem.measured_variance = float(measured_variance)
    problem.state = start.tolist()
    problem.covariance = arrays["covariance"].ravel().tolist()
    problem.gate = float(gate)
    found = _micromotor.linear_filter(problem, _floats(measurements))
    return LinearFiltered(
        states=found["state"],
        covariances=found["covariance"],
        innovations=found["innovation"],
        innovation_variances=found["innovation_variance"],
        used=found["used"],
    )
