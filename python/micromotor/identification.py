"""A motor's parameters from recordings of it."""

from __future__ import annotations

import os
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from . import _micromotor
from ._micromotor import Scene
from .results import Result
from .runs import Progress


class Identification(Result):
    """What recordings tell of a motor: ``parameters`` with means and 90 % intervals, ``fit`` of each statistic.

    Attributes:
        toml: The design with what was identified, as a scene file.
        sample: Draws from the posterior by key, each of shape (draws,).
    """

    toml: str
    sample: dict[str, NDArray[np.float64]]

    @property
    def scene(self) -> Scene:
        """The design with what was identified."""
        return Scene.from_toml(self.toml)


def identify(
    recordings: Iterable[str | os.PathLike[str]],
    *,
    rotor: str | None = None,
    motors: int = 1000,
    prior_width: float = 1.5,
    advice: bool = True,
    seed: int = 1,
    progress: Progress | None = None,
) -> Identification:
    """Identify a motor from recordings of it, on all processors. Takes minutes.

    Args:
        recordings: MCAP logs of :func:`micromotor.record` or :func:`micromotor.write_recording`.
        rotor: How the rotor moves, in place of what the logs say: ``height_only``, ``tilting`` or
            ``tilting_without_shift``.
        motors: Motors that are drawn to learn from, 100 to 100,000: more give narrower intervals.
        prior_width: Width of what is known before, per the tolerance from which motors are drawn, 0.1 to 10.
        advice: Whether to say which further recording would tell what these do not.
        seed: Names the motors that are drawn.
        progress: Is told how many motors are done, of how many.

    Raises:
        IdentificationError: The recordings tell nothing, or are of different motors.
        LogError: A log cannot be read.
    """
    effort = (motors, prior_width, advice, seed)
    text, toml, told, sample = _micromotor.identify(list(recordings), rotor, effort, progress)
    found = Identification(text)
    found.toml = toml
    found.sample = {key: sample[:, place] for place, key in enumerate(told)}
    return found
