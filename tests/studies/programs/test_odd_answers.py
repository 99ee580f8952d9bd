"""Programs with odd answers: none of them passes, and each has one sentence."""

import json
import sys

import numpy as np
import pytest

from discmech import black_box, external, scenes
from discmech.integrators.errors import Displaced
from discmech.studies.command.output import strict_json

from .judging import judged
from .methods import kick_drift_kick

#: Verlet's method for the pendulum, in a program that starts as `begin` says and ends as `end` says
PROGRAM = """
import json, math, sys
for line in sys.stdin:
    asked = json.loads(line)
    (q,), (p,), h = asked["x"], asked["mu"], asked["h"]
    {begin}
    rows = [[q], [p]]
    xs, mus = [[q]], [[p]]
    for k in range(1, asked["steps"] + 1):
        p -= h / 2 * math.sin(q)
        q += h * p
        p -= h / 2 * math.sin(q)
        if k % asked["every"] == 0:
            xs.append([q])
            mus.append([p])
    answer = {{"x": xs, "mu": mus}}
    {end}
    print(json.dumps(answer), flush=True)
"""
#: what makes it odd, and the verdict on its order
ODD = {
    "ignores mu": ("p = 0.0", "pass", "fail"),
    "ignores x": ("q = 2.0", "pass", "fail"),
    "starts from six digits": ("q, p = float('%.6g' % q), float('%.6g' % p)", "pass", "fail"),
    "hides where it starts": ("p = 0.0", "mus[0] = asked['mu']", "fail"),
    "ignores h": ("h = 0.1", "pass", "fail"),
    "stands still": ("pass", "xs, mus = [[xs[0]] * len(xs), [mus[0]] * len(xs)]; "
                     "answer = {'x': xs, 'mu': mus}", "fail"),
    "refuses small steps": ("pass", "answer = {'error': 'too short'} if h < 1e-3 else answer",
                            "inconclusive"),
    "refuses other starts": ("pass", "answer = {'error': 'no'} if asked['mu'] != [0.0] else answer",
                             "inconclusive"),
    "ends at small steps": ("h > 1e-3 or sys.exit(3)", "pass", "inconclusive"),
    "is sound": ("pass", "pass", "pass"),
}  # fmt: skip


@pytest.mark.dear(but=("ignores mu", "stands still", "starts from six digits"))
@pytest.mark.parametrize("what", ODD)
def test_no_program_passes_whose_single_steps_are_unknown_or_others(what, tmp_path):
    begin, end, wanted = ODD[what]
    file = tmp_path / "code.py"
    file.write_text(PROGRAM.format(begin=begin, end=end))
    program = external([sys.executable, "-S", str(file)], order=2, name="odd")
    told = json.loads(strict_json(judged("order", "pendulum", program, causes=False)))
    program.formula.program.close(0.0)
    assert told["verdict"] == wanted, told["reason"]
    assert wanted == "pass" or told["reason"]


@black_box(order=2, symplectic=True, keeps=("momentum",))
def shy(q, p, h, system):
    if abs(h) < 1e-3:
        raise ValueError("too short a step")
    return kick_drift_kick(q, p, h, system)


@pytest.mark.dear(but=("kepler",))
@pytest.mark.parametrize(("study", "scene"), [
    ("order", "pendulum"), ("energy", "pendulum"), ("momentum", "kepler"),
])  # fmt: skip
def test_a_function_that_raises_at_small_steps_passes_nowhere(study, scene):
    found = judged(study, scene, shy, steps=2000 * (study != "order") or None, causes=False)
    assert found["verdict"] == "inconclusive" and "too short a step" in found["reason"]


@pytest.mark.parametrize("off", [0.0, 1e-15, 1e-12])
def test_a_run_that_begins_elsewhere_fails_as_itself(off):
    def displaced(q, p, h, steps, every, system):
        qs, ps = np.tile(q, (steps // every + 1, 1)), np.tile(p, (steps // every + 1, 1))
        return qs * (1 + off), ps

    flow = black_box(order=1, runs=True)(displaced).discretise(scenes.get("pendulum")).flow(0.1)
    if off < 1e-14:  # roundings on a way through coordinates of its own
        assert flow.trajectory(4).x.tolist() == [[2.0]] + 4 * [[2.0 * (1 + off)]]
        return
    with pytest.raises(Displaced, match=r"off by 2\.0e-12 at step 0.*%\.17g"):
        flow.trajectory(4)


def test_a_start_that_was_rounded_to_single_precision_is_called_so():
    def rounded(q, p, h, steps, every, system):
        rows = np.tile(np.float32([*q, *p]), (steps // every + 1, 1)).astype(float)
        return rows[:, :1], rows[:, 1:]

    flow = black_box(order=1, runs=True)(rounded).discretise(scenes.get("pendulum")).flow(0.1)
    with pytest.raises(Displaced, match="as its rounding to single precision is"):
        flow.trajectory(4, x0=[0.1], mu0=[0.0])


@pytest.mark.slow
def test_a_program_of_high_order_is_judged_by_its_runs():
    """Its errors are round-off before they show their power of the step."""

    @black_box(order=8, numbers="double")
    def taylor(q, p, h, system):
        a, b = q.copy(), p.copy()
        for k in range(8, 0, -1):
            a, b = q + h / k * b, p - h / k * a
        return a, b

    scene = scenes.get("harmonic").with_values(name="unit", parameters={"mass": 1, "stiffness": 1})
    assert judged("order", scene, taylor, causes=False)["verdict"] == "pass"
