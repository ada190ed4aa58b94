"""The same scene gives the same bytes, and the same refusals, as the command."""

from __future__ import annotations

import json
from typing import Any

import micromotor as mm
import pytest
from conftest import Command

SHORT_RECORD = {"record.schedule": "b:1 for 0.03, off for 0.02, c:0.5 for 0.02"}
COARSE = {"plant.step_s": 1e-5}
SHORT_CALIBRATION = {"calibrate.duration_s": 2, "calibrate.rest_s": 0.05} | COARSE
CASES: list[tuple[str, dict[str, Any], list[str], Any]] = [
    ("position", {"position.to_deg": 2, "seed": 3, "ldv.installed": False}, [], mm.position),
    ("position", {"position.to_deg": -37.5}, ["--plan"], mm.plan),
    ("rate", {"rate.deg_s": -40, "rate.duration_s": 0.5} | COARSE, [], mm.rate),
    ("record", SHORT_RECORD, [], mm.record),
    ("calibrate", SHORT_CALIBRATION, ["--runs", "2"], lambda scene: mm.calibrate(scene, runs=2)),
    ("positioning-trials", {"seed": 11}, ["--motors", "3"], lambda scene: mm.trials(scene, 3)),
]


def as_flags(sets: dict[str, Any]) -> list[str]:
    texts = {True: "yes", False: "no"}
    words = [f"{key}={texts[value] if isinstance(value, bool) else value}" for key, value in sets.items()]
    return [word for text in words for word in ("--set", text)]


@pytest.mark.parametrize(("name", "sets", "flags", "run"), CASES)
def test_exact_the_bytes_are_the_command_s(
    name: str, sets: dict[str, Any], flags: list[str], run: Any, command: Command
) -> None:
    ran = command("-q", name, *as_flags(sets), *flags, "--format", "json")
    assert ran.returncode == 0, ran.stderr
    result = run(mm.Scene(sets))
    assert result.json.encode() == ran.stdout
    assert result == json.loads(ran.stdout)


@pytest.mark.parametrize("model", ["motor", "stator"])
def test_exact_an_open_loop_is_the_command_s_but_for_the_time_it_took(model: str, command: Command) -> None:
    sets = {"simulate.model": model, "simulate.duration_s": 0.2, "simulate.settle_s": 0.05}
    ran = command("-q", "simulate", *as_flags(sets), "--format", "json")
    found, of_command = mm.simulate(mm.Scene(sets), every_s=1e-3), json.loads(ran.stdout)
    found.pop("wall_s"), of_command.pop("wall_s")
    assert found == of_command and list(found) == list(of_command)
    assert len(found.course["time_s"]) == (201 if model == "motor" else 0)


@pytest.mark.parametrize(
    ("sets", "key", "value", "bounds"),
    [
        ({"position.to_deg": 1e9}, "position.to_deg", "1e9", "-360000 to 360000 deg"),
        ({"positon.to_deg": 3}, "positon.to_deg", None, None),
        ({"camera.marks": "seven"}, "camera.marks", "seven", None),
        ({"estimator.filter": "kalman"}, "estimator.filter", "kalman", "best, constant_rate, impact_aided, twin"),
        ({"ldv.installed": "maybe"}, "ldv.installed", "maybe", "yes, no"),
        ({"plant.step_s": 3e-6}, None, None, None),
        ({"faults": ["camera:gone"]}, None, None, None),
        ({"motor.friction": float("nan")}, "motor.friction", "NaN", None),
        ({"rate.deg_s": 10}, None, None, None),
    ],
)
def test_exact_refusals_are_the_command_s(
    sets: dict[str, Any], key: str | None, value: str | None, bounds: str | None, command: Command
) -> None:
    with pytest.raises(mm.SceneError) as refused:
        mm.position(mm.Scene(sets))
    flags = as_flags({key: ",".join(value) if isinstance(value, list) else value for key, value in sets.items()})
    said = command("-q", "position", *flags).stderr.decode()
    # The command names a value as it was typed.
    typed = str(*sets.values())
    assert f"error: {refused.value}\n" == said.replace(typed, refused.value.value or typed)
    assert (refused.value.key, refused.value.value) == (key, value)
    assert bounds is None or refused.value.bounds == bounds
    assert refused.value.hint is None or str(refused.value).endswith(f"; hint: {refused.value.hint}")
