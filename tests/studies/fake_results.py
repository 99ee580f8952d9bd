"""Results made up for the report's tests: six scenes, three rules, two precisions, controls."""

from __future__ import annotations

import math
import random
from typing import Any

RULES = ("rectangle", "midpoint", "trapezoidal")
SCENES: dict[str, list[str]] = {
    "harmonic": [],
    "pendulum": [],
    "kepler": ["angular momentum"],
    "rigid-body": ["spatial angular momentum", "|μ|²"],
    "heavy-top": ["μ·Γ", "|Γ|²"],
    "lagrange-top": ["μ·Γ", "|Γ|²", "μ₃"],
}
RECORD = {
    "python": "3.11.7", "numpy": "2.4.6", "scipy": "1.17", "mpmath": "1.3", "sympy": "1.14",
    "mpmath_backend": "gmpy2", "gmpy2": "2.2", "blas": "openblas",
    "machine": "x86_64", "cpu": "a processor", "cores": 2, "commit": "0123abc", "clean": False,
    "date": "2025-01-01", "seconds": 12.3, "settings": {"steps": 1000000},
}  # fmt: skip
MATHML = (
    "<mrow><mfrac><msub><mi>x</mi><mi>0</mi></msub><mi>h</mi></mfrac><mo>\u2062</mo>"
    "<mrow><mo>(</mo><mi>μ</mi><mo>)</mo></mrow></mrow>"
)


def case(study: str, scene: str, rule: str, digits: int, **more: Any) -> dict[str, Any]:
    top = scene in ("rigid-body", "heavy-top", "lagrange-top")
    return {
        "scene": scene, "rule": rule, "retraction": "cayley" if top else None, "digits": digits,
        "verdict": "pass", "reason": "", "seconds": 0.1, "expected": {}, "measured": {},
        "rows": [], "command": f"discmech {study} {scene} --rule {rule} --digits {digits}", **more,
    }  # fmt: skip


def order_case(scene: str, rule: str, digits: int, chance: random.Random) -> dict[str, Any]:
    order = 1 if rule == "rectangle" and scene != "rigid-body" else 2
    factor, rows = 1.0 if scene == "rigid-body" else chance.uniform(0.2, 2), []
    for k in range(8 if digits == 50 else 13):
        steps = (128 if digits == 50 else 8) * 2**k
        step = 2 / steps
        error = factor * step**order * (1 + 3 * step**2)
        rough = 1e-12 * math.sqrt(steps) * chance.uniform(0.2, 9) if digits == 16 else 0.0
        why = "pre-asymptotic" if step > 0.1 else "round-off" if rough > 0.02 * error else ""
        error += rough
        rows.append({"steps": steps, "step": step, "error": error, "error_x": error,
                     "error_mu": error / 2, "used": not why, "why_not": why})  # fmt: skip
    value, used = order + chance.gauss(0, 0.002), sum(row["used"] for row in rows)
    measured = {"order": value, "interval": [value - 0.003, value + 0.003], "points": used}
    expected = {"order": order, "tolerance": 0.05}
    return case("order", scene, rule, digits, measured=measured, expected=expected, rows=rows)


def defect_case(scene: str, rule: str, digits: int, chance: random.Random) -> dict[str, Any]:
    unit = 2.2e-16 if digits == 16 else 1e-49
    rows = [
        {"step": 0.2, "index": k, "time": 0.2 * k, "pullback": unit * chance.uniform(0.05, 4),
         "poisson": unit * chance.expovariate(1)}
        for k in range(60)
    ]  # fmt: skip
    worst = {kind: max(row[kind] for row in rows) for kind in ("pullback", "poisson")}
    expected = {"limit": 1e-13 if digits == 16 else 1e-45}
    return case("symplecticity", scene, rule, digits, measured=worst, expected=expected, rows=rows)


def control_cases(digits: int, chance: random.Random) -> list[dict[str, Any]]:
    unit, found = (2.2e-16 if digits == 16 else 1e-49), []
    for scene in ("pendulum", "heavy-top"):
        for rule, slope, size in (("classical Runge-Kutta", 5, 0.02), ("Heun", 3, 0.1)):
            steps = [0.4 / 2**k for k in range(12)]
            rows = [{"step": h, "index": k, "time": h * k, "pullback": None,
                     "poisson": size * h**slope * chance.uniform(0.5, 1) + unit}
                    for h in steps for k in range(5)]  # fmt: skip
            found.append((scene, rule, rows))
    for scene, rule in (("heavy-top", "damped residual"), ("heavy-top", "flipped bracket")):
        size = 1e-7 if rule == "damped residual" else 0.03
        rows = [{"step": 0.2, "index": 1, "time": 0.2, "pullback": size, "poisson": 0.3 * unit}]
        found.append((scene, rule, rows))
    expected = {"at_least": 1e-10 if digits == 16 else 1e-25}
    return [
        case("symplecticity", scene, rule, digits, rows=rows, expected=expected, control=True,
             measured={"pullback": None, "poisson": max(row["poisson"] for row in rows)})
        for scene, rule, rows in found
    ]  # fmt: skip


def momentum_case(scene: str, rule: str, digits: int, chance: random.Random) -> dict[str, Any]:
    unit, total = (2.2e-16, 10**6) if digits == 16 else (1e-49, 100)
    walk, rows = dict.fromkeys(SCENES[scene], 0.0), []
    for k in range(1, 1 + min(total, 500)):
        step = k * total // min(total, 500)
        gain = math.sqrt(total / min(total, 500)) * unit * chance.uniform(0.2, 0.6)
        walk = {name: value + chance.gauss(0, gain) for name, value in walk.items()}
        drift = {name: 0.0 if name == "μ₃" else value for name, value in walk.items()}
        rows.append({"step": step, "time": 0.01 * step, "drift": drift})
    worst = {name: max(abs(row["drift"][name]) for row in rows) for name in walk}
    expected = {"limit": 1e-12 if digits == 16 else 1e-46, "random_walk": unit * math.sqrt(total)}
    return case("momentum", scene, rule, digits, measured={"drift": worst}, expected=expected,
                rows=rows)  # fmt: skip


def energy_case(scene: str, rule: str, digits: int, chance: random.Random) -> dict[str, Any]:
    size = {"rectangle": 4e-3, "midpoint": 3e-6, "trapezoidal": 6e-6}[rule]
    pace = chance.uniform(0.7, 1.3)
    rows = [
        {"time": 5.0 * k + 2 * (sign > 0), "error": sign * size * math.cos(0.002 * k) ** 2 * pace}
        for k in range(400)
        for sign in (-0.8, 1.0)
    ]
    if scene == "harmonic" and rule == "midpoint":
        walk = 0.0
        for row in rows:
            row["error"] = walk = walk + chance.gauss(0, 3e-16)
    band = max(abs(row["error"]) for row in rows)
    measured = {"band": band, "slope": 1e-12, "slope_interval": [-2e-12, 4e-12]}
    return case("energy", scene, rule, digits, measured=measured, rows=rows)


def results(digits: tuple[int, ...] = (16, 50)) -> list[dict[str, Any]]:
    chance = random.Random(1)
    makers = {"order": order_case, "symplecticity": defect_case, "momentum": momentum_case,
              "energy": energy_case}  # fmt: skip
    found = []
    for study, make in makers.items():
        scenes = [s for s in SCENES if study != "momentum" or SCENES[s]]
        precisions = digits if study != "energy" else digits[:1]
        cases = [make(s, r, d, chance) for d in precisions for s in scenes for r in RULES]
        if study == "symplecticity":
            cases += [control for d in precisions for control in control_cases(d, chance)]
        found.append({"schema": 1, "study": study, "verdict": "pass", "record": RECORD,
                      "command": f"discmech {study}", "cases": cases})  # fmt: skip
    return found


def spoiled() -> list[dict[str, Any]]:
    """Results with everything that can be wrong with them."""
    found = results((16,))
    newton = "Newton stopped at step 17 of pendulum, midpoint: FL is singular at t = 0.34."
    bad = found[0]["cases"][4]
    bad |= {"verdict": "fail", "reason": newton, "rows": [], "measured": {}}
    short = {"verdict": "inconclusive", "reason": "Only 3 points are left in the fit; 4 needed."}
    found[0]["cases"][7] |= short
    found[0]["cases"][7]["rows"][3] |= {"error": None, "used": False, "why_not": "failed"}
    found[0]["cases"][8]["measured"] = {"order": math.nan, "interval": None, "points": None}
    found[1]["cases"][-1]["verdict"] = "fail"
    found[2]["cases"] = [case("momentum", "kepler", "midpoint", 16, verdict="fail", reason="<b>")]
    found[3] |= {"cases": [], "verdict": "inconclusive"}
    found.append({"study": "twist", "verdict": "pass", "command": "discmech twist", "cases": [
        case("twist", "so(3)", "two & a_half", 16, measured={"cover": 4, "gap": [0.5, math.inf]})
    ]})  # fmt: skip
    return found


def equations() -> list[dict[str, Any]]:
    fields = {"lagrangian_mathml": MATHML, "discrete_lagrangian_mathml": MATHML,
              "points_mathml": [MATHML], "momentum_mathml": [MATHML],
              "residual_mathml": [MATHML] * 3, "notation": "x is where a step starts."}  # fmt: skip
    facts = {"self_adjoint": True, "affine": False, "source": "the paper, section 4"}
    return [{"scene": s, "rule": r, "retraction": None, **fields, **facts}
            for s in SCENES for r in RULES]  # fmt: skip


def scenes() -> list[dict[str, Any]]:
    return [{"name": name, "title": name.replace("-", " ").capitalize(), "source": "a book",
             "groupoid": "pair(1)", "dim_x": 1, "dim_u": 1, "parameters": "length = 1",
             "symmetries": maps} for name, maps in SCENES.items()]  # fmt: skip
