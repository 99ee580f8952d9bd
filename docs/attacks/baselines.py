"""Methods that became worse beside a baseline, and sound changes: `python baselines.py NAME`.

A file is verified and saved as a baseline, changed, and compared; the exit code is that of the
comparison.
"""

import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

HEAD = """
import numpy as np
import sympy
from discmech import Scene, black_box, discretisation, pair

"""
STEP = """
@black_box(CLAIMS)
def m(q, p, h, system):
    p = p - h / 2 * system.gradient(q, p)
    q = q + h * system.velocity(q, p)
    p = p - h / 2 * system.gradient(q, p)
    return q, p
"""
TWO = STEP.replace("def m(", "def other(") + STEP
FORMULA = """
@discretisation(CLAIMS)
def m(L, G, x, u, h):
    return h * L(G.target(x, u, h / 2), u)
"""
SCENE = """
def lagrangian(x, v, p):
    return v[0] ** 2 / 2 + p.k * sympy.cos(x[0])


mine = Scene("mine", pair(1), lagrangian, {"k": 1}, [2], [0], duration=10, step="1/10")
"""
ORDER = "verify f.py --scene pendulum --study order"
OWN = "verify f.py --scene f.py:mine --study order"
#: name ↦ the file, its claims, what is written for what, the command, and what else it says then
CHANGES = {
    "scene": (SCENE + STEP, "order=2", {'"k": 1': '"k": "1/2"'}, OWN, ""),
    "formula": (SCENE + STEP, "order=2", {"sympy.cos(x[0])": "sympy.cos(x[0] / 2)"}, OWN, ""),
    "rounded": (STEP, "order=2", {"return q, p": "return np.round(q, 11), np.round(p, 11)"},
                ORDER, ""),
    "claim": (STEP, "order=2, reversible=True", {", reversible=True": ""},
              f"{ORDER} --study reversibility", ""),
    "rule": (TWO, "order=2", {"def other(": "def _other(", "@black_box(order=2)\ndef _": "def _"},
             ORDER, ""),
    "study": (STEP, "order=2", {}, f"{ORDER} --study symplecticity", ORDER),
    "adjoint": (FORMULA, "order=2", {"/ 2), u)": "/ 2), u) + h**4 / 20 * u[0] ** 3 * x[0]"},
                f"{ORDER} --digits 50", ""),
    "stable": (FORMULA, "", {"/ 2), u)": "/ 2), u) + h**3 * x[0] ** 2 / 8"},
               "stability harmonic --rule f.py:m", ""),
    "momentum": (STEP, "", {"return q, p": "return q + h**3 / 100 * np.array([1, 0]), p"},
                 "verify f.py --scene kepler --study momentum", ""),
    "comment": (SCENE + STEP, "order=2", {"    return": "    # a comment\n    return"}, OWN, ""),
    "finer": (STEP, "order=2", {"def m(q, p, h, system):": (
        "def m(q, p, h, system):\n    return half(*half(q, p, h / 2, system), h / 2, system)\n\n\n"
        "def half(q, p, h, system):")}, ORDER, ""),
}  # fmt: skip


def after(name: str) -> int:
    """Return the exit code of the comparison."""
    text, claims, changes, words, later = CHANGES[name]
    text = HEAD + text.replace("CLAIMS", claims)
    changed = text
    for old, new in changes.items():
        changed = changed.replace(old, new)
    with TemporaryDirectory() as folder:
        run = [sys.executable, "-c", "from discmech.studies.command import main; exit(main())"]
        cache = os.environ | {"DISCMECH_CACHE": folder}
        for content, asked, option in ((text, words, "--save-baseline"),
                                       (changed, later or words, "--baseline")):  # fmt: skip
            Path(folder, "f.py").write_text(content, encoding="utf-8")
            done = subprocess.run([*run, *asked.split(), option, name, "--jobs", "1"], cwd=folder,
                                  env=cache, check=False)  # fmt: skip
    return done.returncode


if __name__ == "__main__":
    sys.exit(after(sys.argv[1]))
