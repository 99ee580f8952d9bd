"""Programs that answer wrongly, and runs that are none of the scene's."""

import atexit
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np

from discmech import external, recorded

LOOP = """
import json, math, sys
def verlet(q, p, h, steps, every, force=math.sin):
    xs, ps = [[q]], [[p]]
    for k in range(1, steps + 1):
        p -= h / 2 * force(q)
        q += h * p
        p -= h / 2 * force(q)
        if k % every == 0:
            xs.append([q])
            ps.append([p])
    return {"x": xs, "mu": ps}
"""


def program(name, body, first="", **claims):
    """A program that answers each run, asked of it as `a`, by what the body prints."""
    text = f"{LOOP}\n{first}\nfor a in map(json.loads, sys.stdin):\n    "
    text += "(q,), (p,), h, n, e = (a[k] for k in ('x', 'mu', 'h', 'steps', 'every'))\n    "
    words = [sys.executable, "-S", "-c", text + body.replace("\n", "\n    ")]
    return external(words, order=2, name=name, **claims)


SAY = "print(json.dumps(found), flush=True)"
sound = program("sound", f"found = verlet(q, p, h, n, e)\n{SAY}", symplectic=True)
talks = program("talks", f"found = verlet(q, p, h, n, e)\n{SAY}", "print('version 1.0')")
crashes = program("crashes", "sys.exit('out of range')")
no_number = program(
    "no-number", f"found = verlet(q, p, h, n, e)\nfound['x'][-1] = [math.nan]\n{SAY}"
)
short = program("short", f"found = verlet(q, p, h, n, e)\nfound['mu'].pop()\n{SAY}")
few_digits = program(
    "few-digits", "print(repr(verlet(q, p, h, n, e)).replace(\"'\", '\"')[:30], flush=True)"
)
#: the sign of the last kick
flipped = program(
    "flipped",
    f"found = verlet(q, p, h, n, e, lambda q: -math.sin(q))\n{SAY}",
)


def save(gravity=1.0, digits=17, uneven=0.0):
    """A folder of runs of Störmer–Verlet on the pendulum, from its own start."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for k in range(5):
        steps = 100 * 2**k
        h, q, p = 10 / steps, 2.0, 0.0
        rows = [(0.0, q, p)]
        for n in range(1, steps + 1):
            p -= h / 2 * gravity * np.sin(q)
            q += h * p
            p -= h / 2 * gravity * np.sin(q)
            rows.append((n * h + uneven * (n == steps // 2), q, p))
        np.savetxt(folder / f"run{k}.csv", rows, f"%.{digits}g", ",", header="t,q1,p1", comments="")
    return str(folder / "*.csv")


runs = recorded(save(), order=2, name="runs")
heavier = recorded(save(gravity=1.001), order=2, name="heavier")
rounded = recorded(save(digits=4), order=2, name="rounded")
lower = recorded(save(), order=4, name="lower")
