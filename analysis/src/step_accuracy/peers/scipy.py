"""A ball that bounces on a vibrating plate, by SciPy's solve_ivp with events.

The problem comes on standard input, the results go to standard output, both as JSON.
"""

import json
import math
import sys
import time

from scipy.integrate import solve_ivp

problem = json.load(sys.stdin)
amplitude, rate = problem["plate"]["amplitude_m"], problem["plate"]["rate_rad_s"]
damping, gravity = problem["plate"]["damping_per_s"], problem["plate"]["gravity_m_s2"]
restitution = problem["plate"]["restitution"]


def plate_height(t):
    return amplitude * math.sin(rate * t)


def plate_velocity(t):
    return amplitude * rate * math.cos(rate * t)


def flight(t, y):
    return (y[1], -gravity - damping * y[1])


def gap(t, y):
    return y[0] - plate_height(t)


gap.terminal = True
gap.direction = -1


def released(t):
    """Instant at which a ball that rides on the plate from `t` leaves it."""
    lag = math.atan(damping / rate)
    first = lag + math.asin(gravity / (amplitude * rate * math.hypot(rate, damping)))
    last = math.pi + 2.0 * lag - first
    phase = (rate * t) % math.tau
    wait = first - phase if phase < first else 0.0 if phase < last else first + math.tau - phase
    return t + wait / rate


def impacts(method, start, until):
    t, y, times = 0.0, (start, 0.0), []
    while t < until:
        found = solve_ivp(
            flight,
            (t, until),
            y,
            method=method,
            events=gap,
            max_step=problem["step_s"],
            rtol=problem["relative_tolerance"],
            atol=problem["absolute_tolerance"],
        )
        if found.status != 1:
            break
        t, velocity = float(found.t_events[0][0]), float(found.y_events[0][0][1])
        times.append(t)
        approach = plate_velocity(t) - velocity
        if approach < problem["stick_m_s"]:
            t = released(t)
            velocity = plate_velocity(t)
        else:
            velocity = plate_velocity(t) + restitution * approach
        y = (plate_height(t) + problem["clear_m"], velocity)
    return times


results = []
for method in problem["methods"]:
    firsts = [impacts(method, start, problem["first_before_s"])[0] for start in problem["starts_m"]]
    begin = time.perf_counter()
    count = len(impacts(method, problem["start_m"], problem["time_s"]))
    taken = time.perf_counter() - begin
    results.append({"method": method, "taken_s": taken, "impacts": count, "first_impacts_s": firsts})
json.dump(results, sys.stdout)
