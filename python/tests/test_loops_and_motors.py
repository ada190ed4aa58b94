"""Loops of one's own against those of the project: the same bits."""

from __future__ import annotations

import micromotor as mm
import numpy as np
import pytest


@pytest.mark.parametrize("filter_name", ["twin", "constant_rate"])
def test_dual_a_loop_with_the_controller_s_drives_is_its_move(filter_name: str) -> None:
    """Truth and estimate, tick by tick, to the last bit: the filter gets the same calls in the same order."""
    scene = mm.Scene({"position.to_deg": 0.5, "estimator.filter": filter_name})
    course = mm.position(scene, every=1).course
    drives, loop = np.concatenate(([0.0], course["drive"][:-1])), mm.Loop(scene)
    assert np.any(drives > 0)
    ticks = len(drives)
    moments = [loop.step(drive) for drive in drives]
    assert np.array_equal([moment.true_angle_deg for moment in moments], course["truth_angle_deg"])
    angles = [np.nan if moment.estimate is None else moment.estimate.angle_deg for moment in moments]
    assert np.array_equal(angles, course["estimate_angle_deg"], equal_nan=True)
    assert moments[-1].time_s == course["time_s"][-1] and np.isclose(loop.time_s, ticks * 1e-5)
    assert moments[-1].health == "Good" and moments[-1].usable


def test_exact_a_step_of_many_ticks_is_many_steps() -> None:
    one, other = mm.Loop(), mm.Loop()
    moments = [one.step(0.7) for _ in range(300)]
    whole = other.step(0.7, 300)
    assert whole.true_angle_deg == moments[-1].true_angle_deg
    for name in ("frames", "samples"):
        assert np.array_equal(np.concatenate([getattr(moment, name) for moment in moments]), getattr(whole, name))
    assert whole.frames.shape[1] == 2 and len(whole.samples) > 100
    branch = other.copy()
    assert branch.step(-1.0, 50).true_angle_deg == other.step(-1.0, 50).true_angle_deg


def test_exact_a_controller_of_one_s_own_is_called() -> None:
    seen: list[float] = []

    def controller(moment: mm.Moment) -> float:
        seen.append(moment.time_s)
        return 1.0 if moment.time_s < 0.01 else 0.0

    course = mm.Loop().run(controller, 0.02, ticks=10)
    assert len(seen) == 200 and np.allclose(np.diff(course["time_s"]), 1e-4)
    assert course["drive"].tolist() == [0.0] + [1.0] * 99 + [0.0] * 100

    def wrong(_: mm.Moment) -> float:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        mm.Loop().run(wrong, 1.0)
    with pytest.raises(mm.SceneError, match="drive = 1.5 is outside its bounds -1 to 1"):
        mm.Loop().step(1.5)
    with pytest.raises(mm.SceneError, match="acts at once"):
        mm.Loop(mm.Scene({"board.latency_ticks": 1}))


def test_dual_a_motor_is_the_plant_of_the_loop() -> None:
    scene = mm.Scene({"seed": 5})
    motor, loop = mm.Motor(scene), mm.Loop(scene)
    for _ in range(20):
        steps = round(1e-4 / motor.step_s)
        met = motor.step(1.0, steps)
        moment = loop.step(1.0, 10)
        assert motor.angle_deg == moment.true_angle_deg and motor.time_s == moment.time_s
        assert 0 <= met <= steps
    course = motor.copy().run(1.0, 1000, every=100)
    assert course["angle_deg"].shape == (10,)
    motor.step(1.0, 1000)
    assert motor.angle_deg == course["angle_deg"][-1]


def test_dual_many_motors_are_each_of_them() -> None:
    scene = mm.Scene({"seed": 20})
    drives = np.array([1.0, -1.0, 0.0, 0.4])
    motors = mm.Motors(scene, len(drives))
    motors.step(drives, 40_000)
    for place, drive in enumerate(drives):
        own = scene.copy()
        own["seed"] = 20 + place
        motor = mm.Motor(own)
        motor.step(drive, 40_000)
        assert (motors.angle_deg[place], motors.rate_rad_s[place]) == (motor.angle_deg, motor.rate_rad_s)
    assert motors.angle_deg[0] > 0 > motors.angle_deg[1] and len(motors) == 4
    with pytest.raises(ValueError, match="3 drives for 4 motors"):
        motors.step(drives[:3])
    with pytest.raises(mm.SceneError, match="a motor does not read camera.marks"):
        mm.Motors(mm.Scene({"camera.marks": 1}), 2)
