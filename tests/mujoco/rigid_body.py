"""The rigid rotor in MuJoCo: free flight of a tilted spinning rotor, and one frictionless contact at a tooth.

    python3 -m venv V && V/bin/pip install mujoco==4.0.0 && V/bin/python tests/mujoco/rigid_body.py

writes tests/mujoco/rigid_body.json, which `tests/system/motor/tilting/dual_mujoco.rs` reads. MuJoCo's contacts are
springs: a stiff one without damping is an impact with restitution 1. Restitution between 0 and 1, friction in an impact
and several contacts at once depend on its springs and are not compared.
"""

import json
import math
import pathlib

import mujoco
import numpy as np

MASS, SPIN, TRANSVERSE, RADIUS = 46e-6, 4.59e-10, 4.59e-10 / 2 + 46e-6 * 350e-6**2 / 12, 3.063e-3

XML = """<mujoco><option timestep="{step}" integrator="{integrator}" gravity="0 0 {gravity}"/>
<worldbody>{tooth}<body><freejoint/>
<inertial pos="0 0 0" mass="{mass}" diaginertia="{i} {i} {j}"/>{disc}</body></worldbody></mujoco>"""


def model(step, gravity, unit=1.0, tooth="", disc="", integrator="RK4"):
    """Lengths in metres divided by `unit`, masses in units of the rotor's if there is a contact."""
    scale = 1.0 if unit == 1.0 else MASS
    text = XML.format(step=step, gravity=gravity, tooth=tooth, disc=disc, integrator=integrator, mass=MASS / scale,
                      i=TRANSVERSE / scale / unit**2, j=SPIN / scale / unit**2)
    return mujoco.MjModel.from_xml_string(text)


def flight(clockwise, slope, rate, time_s):
    m = model(1e-5, -9.81)
    d = mujoco.MjData(m)
    n = np.array([-slope[0], -slope[1], 1.0])
    n /= np.linalg.norm(n)
    turn = np.array([-rate[0], -rate[1], 0.0]) / math.sqrt(1 + slope[0] ** 2 + slope[1] ** 2)
    turn -= n * n.dot(turn)
    axis = np.cross([0, 0, 1], n)
    angle = math.asin(np.linalg.norm(axis))
    mujoco.mju_axisAngle2Quat(d.qpos[3:7], axis / np.linalg.norm(axis), angle)
    frame = np.zeros(9)
    mujoco.mju_quat2Mat(frame, d.qpos[3:7])
    d.qvel[3:6] = frame.reshape(3, 3).T @ (-clockwise * n + np.cross(n, turn))
    d.qvel[:3] = [1e-3, -2e-3, 0.1]
    for _ in range(round(time_s / 1e-5)):
        mujoco.mj_step(m, d)
    mujoco.mju_quat2Mat(frame, d.qpos[3:7])
    n = frame.reshape(3, 3)[:, 2]
    turn = np.cross(frame.reshape(3, 3) @ d.qvel[3:6], n)
    return {"clockwise_rad_s": clockwise, "slope": slope, "slope_rate_rad_s": rate, "time_s": time_s,
            "end_place_m": list(d.qpos[:3]), "end_velocity_m_s": list(d.qvel[:3]),
            "end_slope": [-n[0] / n[2], -n[1] / n[2]],
            "end_slope_rate_rad_s": [-(turn[k] * n[2] - n[k] * turn[2]) / n[2] ** 2 for k in (0, 1)]}


def impact(fall_m_s):
    """A level rotor falls on one fixed tooth. In millimetres and rotor masses, which suit the solver's tolerances."""
    ball = 'type="sphere" size="0.1" friction="0 0 0" condim="1" solref="-1e9 0" solimp="0.9999 0.9999 1 0.5 2"'
    tooth = f'<geom {ball} pos="{RADIUS * 1e3} 0 -0.1"/>'
    disc = '<geom type="cylinder" size="4.35 0.175" pos="0 0 0.176" condim="1" friction="0 0 0" ' \
        'solref="-1e9 0" solimp="0.9999 0.9999 1 0.5 2"/>'
    m = model(2e-8, 0, 1e-3, tooth, disc, "Euler")
    d = mujoco.MjData(m)
    d.qvel[2] = -fall_m_s * 1e3
    touched = False
    for _ in range(2_000_000):
        mujoco.mj_step(m, d)
        if d.ncon:
            touched = True
        elif touched:
            break
    assert touched
    frame = np.zeros(9)
    mujoco.mju_quat2Mat(frame, d.qpos[3:7])
    turn = frame.reshape(3, 3) @ d.qvel[3:6]
    return {"fall_m_s": fall_m_s, "rise_m_s": d.qvel[2] * 1e-3, "tilt_rad_s": math.hypot(turn[0], turn[1])}


table = {
    "mujoco": mujoco.__version__,
    "flights": [flight(w, s, p, t) for w, s, p, t in [
        (15.0, [0.01, -0.02], [0.3, 0.5], 0.02),
        (-300.0, [0.01, -0.02], [3.0, 5.0], 0.05),
        (300.0, [0.0, 0.01], [2.0, 0.0], 0.1),
    ]],
    "impacts": [impact(v) for v in (0.02, 0.1)],
}
if __name__ == "__main__":
    path = pathlib.Path(__file__).with_suffix(".json")
    path.write_text(json.dumps(table, indent=1) + "\n")
