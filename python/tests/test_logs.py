"""Logs: MCAP as tables, Parquet in pandas and polars, and a motor from its recording."""

from __future__ import annotations

from pathlib import Path

import micromotor as mm
import numpy as np
import pandas
import polars
import pytest

SCENE = mm.Scene({"position.to_deg": 1.0})


def test_exact_a_log_holds_the_run(tmp_path: Path) -> None:
    run = mm.position(SCENE, every=10, log=tmp_path / "run.mcap")
    log = mm.read_log(tmp_path / "run.mcap")
    assert (log.command, log.ended, log.scene["position.to_deg"]) == ("position", "whole", 1.0)
    assert log.result == run and log.result.json == run.json
    # The log begins with the first tick, the course with the tenth.
    truth, estimate = log.tables["/truth"], log.tables["/estimate"]
    at = np.isin(truth["time_s"].round(9), run.course["time_s"].round(9))
    course = np.isin(run.course["time_s"].round(9), truth["time_s"].round(9))
    assert np.array_equal(truth["angle_deg"][at], run.course["truth_angle_deg"][course])
    assert {"/camera", "/vibrometer", "/innovation", "/drive", "/phase", "/health"} <= set(log.tables)
    assert set(log.tables["/phase"]["phase"]) >= {"Waiting", "Holding"}
    assert estimate["resting"].dtype == bool and np.all(estimate["angle_rad2"] > 0)
    with pytest.raises(mm.LogError, match="no MCAP file") as refused:
        mm.read_log(__file__)
    assert refused.value.hint


def test_exact_pandas_and_polars_read_parquet(tmp_path: Path) -> None:
    run = mm.position(SCENE, every=10, log=tmp_path / "run.parquet")
    frame, other = pandas.read_parquet(tmp_path / "run.parquet"), polars.read_parquet(tmp_path / "run.parquet")
    assert list(frame.columns) == other.columns and len(frame) == len(other) > 1000
    frames = frame["camera_angle_deg"].count()
    assert frames == other["camera_angle_deg"].count() > 10
    assert frame["truth_angle_deg"].max() == other["truth_angle_deg"].max() > 0.9
    # A course is a frame as it is.
    assert len(pandas.DataFrame(run.course)) == len(polars.DataFrame(run.course)) == len(run.course["time_s"])
    with pytest.raises(mm.LogError, match="does not say which kind"):
        mm.position(SCENE, log=tmp_path / "run.txt")


def test_law_a_recording_of_one_s_own_identifies_a_motor(tmp_path: Path) -> None:
    """From as few motors and as short a recording as are allowed: intervals are wide, and hold the truth nine times of
    ten. This motor has a friction that its prior, 0.4 +- 0.06, does not exclude.
    """
    recorded = mm.record(mm.Scene({"record.schedule": "b:1 for 0.1, off for 0.05, c:1 for 0.1, off for 0.05"}))
    camera, vibrometer, drive = (recorded.tables[name] for name in ("camera", "vibrometer", "drive"))
    mm.write_recording(
        tmp_path / "own.mcap",
        mm.Scene({"camera.marks": 2}),
        camera=(camera["time_s"], camera["angle_deg"]),
        vibrometer=(vibrometer["time_s"], vibrometer["velocity_m_s"]),
        drive=(drive["time_s"], drive["drive"], drive["frequency_offset_hz"]),
    )
    told: list[tuple[int, int]] = []
    found = mm.identify(
        [tmp_path / "own.mcap"], motors=100, advice=False, progress=lambda done, total: told.append((done, total))
    )
    assert told[-1] == (100, 100)
    of_parameters = {parameter["key"]: parameter for parameter in found["parameters"]}
    assert "motor.friction" in of_parameters
    keys = [key for key, parameter in of_parameters.items() if parameter["told"]]
    assert sorted(found.sample) == sorted(keys)
    for key in keys:
        low, high = of_parameters[key]["interval"]
        assert np.mean((found.sample[key] >= low) & (found.sample[key] <= high)) == pytest.approx(0.9, abs=0.02)
        assert found.scene[key] == pytest.approx(of_parameters[key]["mean"], rel=1e-3)
    with pytest.raises(ValueError, match="motors = 5 is outside its bounds 100 to 100000"):
        mm.identify([tmp_path / "own.mcap"], motors=5)
    with pytest.raises(mm.IdentificationError, match="there is no recording"):
        mm.identify([])
