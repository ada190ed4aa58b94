"""Long work releases the lock, reports progress, and ends at Ctrl-C. Arrays are not copied."""

from __future__ import annotations

import _thread
import signal
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import micromotor as mm
import numpy as np
import pytest
from micromotor.filters import _floats

LONG = {"rate.duration_s": 500.0}


def progress_of_another_thread(work: Callable[[], Any]) -> int:
    """How often another thread came to its turn while the work ran."""
    running, over, turns = threading.Event(), threading.Event(), [0]

    def count() -> None:
        while not over.is_set():
            turns[0] += running.is_set()
            time.sleep(1e-3)

    counter = threading.Thread(target=count)
    counter.start()
    running.set()
    work()
    running.clear()
    over.set()
    counter.join()
    return turns[0]


def test_law_another_thread_goes_on() -> None:
    """Work that holds the lock gives it no turn but one, between its start and the work's."""
    measurements = np.zeros(2_000_000)
    for work in (
        lambda: mm.position(mm.Scene({"position.to_deg": 5})),
        lambda: mm.Motor().step(1.0, 1_000_000),
        lambda: mm.Motors(mm.Scene(), 4).step([1.0, -1.0, 0.5, 0.0], 100_000),
        lambda: mm.linear_filter(
            measurements,
            transition=[[1, 1], [0, 1]],
            process_noise=[[0.25, 0.5], [0.5, 1]],
            row=[1, 0],
            measured_variance=1.0,
            state=[0, 0],
            covariance=np.eye(2),
        ),
    ):
        assert progress_of_another_thread(work) > 3


@pytest.fixture
def ctrl_c() -> Iterator[None]:
    """Ctrl-C raises KeyboardInterrupt, also where the tests' parent ignores it, as for a background job."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c")
@pytest.mark.parametrize(
    "work",
    [
        lambda _: mm.rate(mm.Scene(LONG)),
        lambda folder: mm.rate(mm.Scene(LONG), log=folder / "run.mcap"),
        lambda _: mm.simulate(mm.Scene({"simulate.duration_s": 5000.0})),
        lambda _: mm.trials(mm.Scene(), 1_000_000),
        lambda _: mm.Motor().step(0.5, 10**12),
        lambda _: mm.Motors(mm.Scene(), 4).step(np.ones(4), 10**12),
        lambda _: mm.Loop().step(0.5, 10**9),
        lambda _: mm.Loop().run(lambda _: 0.5, 1e6),
    ],
)
def test_law_ctrl_c_ends_it(work: Callable[[Path], Any], tmp_path: Path) -> None:
    """Each of them would take minutes at least. What was logged is kept."""
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        work(tmp_path)
    timer.join()
    kept = [path.name for path in tmp_path.iterdir()]
    assert kept in ([], ["run.mcap"])
    if kept:
        assert mm.read_log(tmp_path / kept[0]).ended == "interrupted"


def test_exact_progress_is_told_and_may_end_a_study() -> None:
    told: list[tuple[int, int]] = []
    mm.trials(mm.Scene(), 4, progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (4, 4) and told == sorted(told)

    def refuse(done: int, total: int) -> None:
        raise OverflowError(f"{done} of {total}")

    with pytest.raises(OverflowError, match="of 1000000"):
        mm.trials(mm.Scene(), 1_000_000, progress=refuse)


def test_exact_arrays_are_not_copied() -> None:
    numbers = np.arange(10.0)
    assert _floats(numbers) is numbers
    course = mm.simulate(mm.Scene({"simulate.duration_s": 0.1, "simulate.settle_s": 0.0}), every_s=1e-3).course
    for name, column in course.items():
        # It refers to memory that numpy has not made.
        assert column.base is not None and not column.flags.owndata, name
