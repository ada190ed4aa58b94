"""A scene as a mapping and as a file."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import micromotor as mm
import numpy as np
import pytest


def test_exact_values_come_back() -> None:
    scene = mm.Scene()
    for key, value in [
        ("position.to_deg", 37),
        ("position.to_deg", np.float64(-2.5)),
        ("seed", 2**64 - 1),
        ("seed", np.int32(7)),
        ("ldv.installed", "no"),
        ("camera.noise_m", 1e-7),
        ("faults", ["camera:lost@1..2", "drive:weak:0.7@0.."]),
    ]:
        scene[key] = value
        assert np.all(scene[key] == value) or key == "faults", key
    assert len(scene["faults"]) == 2
    assert scene.keys_set() == sorted(["position.to_deg", "seed", "ldv.installed", "camera.noise_m", "faults"])
    assert set(scene) == set(mm.Scene.keys()) and len(scene) > 100 and "seed" in scene and "sed" not in scene
    with pytest.raises(KeyError):
        scene["sed"]
    with pytest.raises(TypeError):
        scene["seed"] = None  # type: ignore[assignment]
    assert scene["seed"] == 7, "a refused value changes nothing"


def test_exact_text_copies_and_pickles_are_the_scene(tmp_path: Path) -> None:
    scene = mm.Scene({"position.to_deg": 12.5, "motor.mode_b.frequency_hz": 6301})
    path = tmp_path / "scene.toml"
    path.write_text(scene.toml())
    for other in (mm.Scene.load(path), copy.deepcopy(scene), scene.copy(), pickle.loads(pickle.dumps(scene))):
        assert other == scene
        other["seed"] = 5
        assert other != scene
    assert mm.Scene.load(path, {"seed": 9})["seed"] == 9
    assert mm.Scene.load("heavy-rotor").keys_set() and "heavy_rotor" in mm.Scene.gallery()
    assert "#to_deg" not in scene.toml(only_set=False) and "#hold_s" in scene.toml(only_set=False)
    assert scene.origin("seed") == "default" and eval(repr(scene), {"Scene": mm.Scene}) == scene


def test_exact_a_file_is_refused_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text("seed = 2\n[motor]\nfrictoin = 0.3\n")
    with pytest.raises(mm.SceneError, match=r"scene\.toml:3:1: unknown key motor\.frictoin") as refused:
        mm.Scene.load(path)
    assert refused.value.key == "motor.frictoin" and refused.value.hint == "did you mean motor.friction?"
    with pytest.raises(mm.SceneError, match="cannot read"):
        mm.Scene.load(tmp_path / "none" / "scene.toml")


def test_exact_every_key_is_described() -> None:
    for key in mm.Scene.keys():
        about = mm.Scene.describe(key)
        assert about["key"] == key and about["meaning"] and about["default"] == mm.Scene()[key], key
    assert mm.Scene.describe("position.to_deg")["unit"] == "deg"
