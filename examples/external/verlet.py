"""Störmer–Verlet for the scenes pendulum and kepler, asked by JSON lines; without numpy."""

import json
import math
import sys


def problem(scene, p):
    """(inertia, force) of a scene."""
    if scene == "pendulum":
        weight = p["mass"] * p["gravity"] * p["length"]
        return p["mass"] * p["length"] ** 2, lambda q: [-weight * math.sin(q[0])]
    if scene == "kepler":
        return 1.0, lambda q: [-p["strength"] * e / math.hypot(*q) ** 3 for e in q]
    raise ValueError(f"I know the scenes pendulum and kepler only, not {scene}")


def verlet(inertia, force, q, p, h, steps, every):
    """Rows of x and of mu: the start, then each every-th step."""
    xs, mus = [q], [p]
    for k in range(1, steps + 1):
        p = [b + h / 2 * f for b, f in zip(p, force(q), strict=True)]
        q = [a + h * b / inertia for a, b in zip(q, p, strict=True)]
        p = [b + h / 2 * f for b, f in zip(p, force(q), strict=True)]
        if k % every == 0:
            xs.append(q)
            mus.append(p)
    return {"x": xs, "mu": mus}


for line in sys.stdin:
    run = json.loads(line)
    try:
        inertia, force = problem(run["scene"], run["parameters"])
        wanted = [run[name] for name in ("x", "mu", "h", "steps", "every")]
        answer = verlet(inertia, force, *wanted)
    except (ArithmeticError, ValueError) as error:
        answer = {"error": str(error)}
    print(json.dumps(answer), flush=True)  # an answer must not wait in a buffer
