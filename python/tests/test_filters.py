"""Filters over arrays: against the truth, against the command's own import, and the core against the textbook."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import micromotor as mm
import numpy as np
import pytest
from conftest import Command
from micromotor import _micromotor

SCENE = {"record.schedule": "b:1 for 0.2, off for 0.1"}


@pytest.fixture(scope="module")
def recording() -> mm.Result:
    return mm.record(mm.Scene(SCENE), every=1)


def columns(table: mm.Table, *names: str) -> tuple[Any, ...]:
    return tuple(table[name] for name in names)


def measured(recording: mm.Result) -> dict[str, Any]:
    return {
        "camera": columns(recording.tables["camera"], "time_s", "angle_deg"),
        "vibrometer": columns(recording.tables["vibrometer"], "time_s", "velocity_m_s"),
        "drive": columns(recording.tables["drive"], "time_s", "drive"),
    }


@pytest.mark.parametrize("precision", ["f32", "f64"])
@pytest.mark.parametrize("name", ["constant_rate", "impact_aided", "twin"])
def test_law_estimates_hold_what_their_covariance_says(name: str, precision: Any, recording: mm.Result) -> None:
    """Truth within three standard deviations in 95 % of all rows: 99.7 % if all were Gaussian and the model exact."""
    scene = mm.Scene({"estimator.filter": name, "camera.marks": 2})
    found = mm.run_filter(scene, **measured(recording), precision=precision)
    estimates, truth = found.estimates, recording.tables["truth"]
    assert len(found.innovations["time_s"]) == len(recording.tables["camera"]["time_s"])
    true_deg = np.interp(estimates["time_s"], truth["time_s"], truth["angle_deg"])
    sd_deg = np.sqrt(estimates["covariance"][:, 0, 0])
    assert estimates["covariance"].shape == (len(true_deg), 2, 2)
    off = np.abs(estimates["angle_deg"] - true_deg)[5:]
    assert np.mean(off < 3 * sd_deg[5:]) > 0.95
    assert true_deg[-1] > 1.0 and off.max() < 0.1 * true_deg[-1]
    used = found.innovations["verdict"] == mm.Verdict.USED
    assert np.mean(used) > 0.5 and found.innovations["verdict"][0] == mm.Verdict.RESTARTED
    assert np.mean(estimates["health"][5:] <= mm.Health.DEGRADED) > 0.9


def test_exact_rows_come_at_every_so_many_ticks(recording: mm.Result) -> None:
    found = mm.run_filter(**measured(recording), every=100)
    assert np.allclose(np.diff(found.estimates["time_s"]), 1e-3)
    assert abs(found.estimates["time_s"][0] - 1e-3) < 1e-5, "counted from a tick before the first measurement"


def test_exact_a_bad_frame_is_refused_and_said(recording: mm.Result) -> None:
    arrays = measured(recording)
    times, angles = arrays["camera"]
    angles = angles.copy()
    angles[-200] += 20.0
    found = mm.run_filter(camera=(times, angles), vibrometer=arrays["vibrometer"], drive=arrays["drive"])
    assert found.innovations["verdict"][-200] == mm.Verdict.GATE
    assert abs(found.innovations["innovation_deg"][-200] - 20.0) < 1.0


def test_exact_names_of_codes_are_those_of_rust() -> None:
    def plain(word: str) -> str:
        return word.replace("Rejected(", "").replace(")", "").upper()

    for names, enumeration in ((_micromotor.VERDICTS, mm.Verdict), (_micromotor.REASONS, mm.Reason)):
        assert [plain(name) for name in names] == [member.name.replace("_", "") for member in enumeration]
        assert [int(member) for member in enumeration] == list(range(len(names)))


def test_exact_wrong_arrays_are_refused() -> None:
    times = np.arange(5.0)
    with pytest.raises(ValueError, match="camera: 5 times and 4 values"):
        mm.run_filter(camera=(times, times[:-1]))
    with pytest.raises(ValueError, match="drive: 5 times and 4 values"):
        mm.run_filter(camera=(times, times), drive=(times, times[:-1]))
    with pytest.raises(ValueError, match="camera has 3 arrays"):
        mm.run_filter(camera=(times, times, times))
    with pytest.raises(mm.SceneError, match="drive = 2 is outside its bounds -1 to 1"):
        mm.run_filter(camera=(times, times), drive=(times, times))
    with pytest.raises(mm.LogError, match="camera has 1 rows with time and value"):
        mm.run_filter(camera=(times[:1], times[:1]))


def test_exact_a_log_of_arrays_is_that_of_the_command(
    recording: mm.Result, tmp_path: Path, command: Command
) -> None:
    """The same numbers as CSV through `host-sim import`."""
    camera = recording.tables["camera"]
    rows = [f"{time_s!r},{angle!r}\n" for time_s, angle in zip(*columns(camera, "time_s", "angle_deg"), strict=True)]
    rows = [row.replace("np.float64(", "").replace(")", "") for row in rows]
    (tmp_path / "camera.csv").write_text("time_s,angle_deg\n" + "".join(rows))
    ran = command("import", "--camera", "camera.csv", "--log", "command.mcap", "--format", "json")
    assert ran.returncode == 0, ran.stderr
    written = mm.write_recording(tmp_path / "module.mcap", camera=columns(camera, "time_s", "angle_deg"))
    assert written == json.loads(ran.stdout)
    assert (tmp_path / "module.mcap").read_bytes() == (tmp_path / "command.mcap").read_bytes()


@pytest.mark.parametrize("states", [1, 2, 3, 4])
def test_dual_the_core_filter_is_the_textbook_s(states: int) -> None:
    """Against P <- (I - K h') P in float64, over 200 measurements, some of them missing."""
    draw = np.random.default_rng(states)
    transition = np.eye(states) + 0.1 * draw.normal(size=(states, states))
    gain = draw.normal(size=(states, 2))
    noise = gain @ gain.T
    row, state, covariance = draw.normal(size=states), draw.normal(size=states), 10.0 * np.eye(states)
    measurements = draw.normal(size=200)
    measurements[::17] = np.nan
    found = mm.linear_filter(
        measurements,
        transition=transition,
        process_noise=noise,
        row=row,
        measured_variance=0.3,
        state=state,
        covariance=covariance,
    )
    for place, measurement in enumerate(measurements):
        state, covariance = transition @ state, transition @ covariance @ transition.T + noise
        if np.isfinite(measurement):
            variance = row @ covariance @ row + 0.3
            kalman_gain = covariance @ row / variance
            assert np.isclose(found.innovations[place], measurement - row @ state, rtol=1e-6, atol=1e-9)
            assert np.isclose(found.innovation_variances[place], variance, rtol=1e-9)
            state = state + kalman_gain * (measurement - row @ state)
            covariance = covariance - np.outer(kalman_gain, row @ covariance)
        assert found.used[place] == np.isfinite(measurement)
        assert np.allclose(found.states[place], state, rtol=1e-6, atol=1e-9)
        assert np.allclose(found.covariances[place], covariance, rtol=1e-6, atol=1e-9)


def test_exact_the_gate_of_the_core() -> None:
    given = {"transition": [[1]], "process_noise": [[0]], "row": [1], "state": [0], "covariance": [[1]]}
    found = mm.linear_filter([0.1, 50.0, 0.1], **given, measured_variance=1.0, gate=9.0)
    assert found.used.tolist() == [True, False, True]
    with pytest.raises(ValueError, match=r"row has the shape \(2,\); \(1,\) for 1 states"):
        mm.linear_filter([0.1], **{**given, "row": [1, 2]}, measured_variance=1.0)
    with pytest.raises(ValueError, match="positive semidefinite"):
        mm.linear_filter([0.1], **{**given, "process_noise": [[-1]]}, measured_variance=1.0)
