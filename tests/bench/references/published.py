"""Numbers that other people published, against certified ones: how many of their digits are right.

scd = -log10 of the largest |(y - y^)/y^| over the numbers, of |y - y^| where y^ = 0 (IVP test set).
Periodic orbits are published as a start and a period: after it, the state is the start again.

There is no row of the outer solar system: its data are printed in many places (Hairer, Lubich,
Wanner, Geometric Numerical Integration, I.2.4), and the runs there as pictures; no printed numbers
of its solution were found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any

from discmech import reference
from discmech.integrators import Scene, pair, scenes
from discmech.integrators.numbers import mpmath, sympy
from discmech.studies.core.case import Progress, silent

MARGIN = 8  # certain digits beyond the printed ones


@dataclass(frozen=True)
class Published:
    """A problem, a time, and the state (x, v) that was published for it."""

    problem: str
    scene: Scene
    time: str
    values: Sequence[str]
    source: str


def _three_stars(x: Any, v: Any, p: Any) -> Any:
    """Three points of mass 1 in a plane; the coordinates are x1, x2, x3, y1, y2, y3."""
    pairs = combinations([sympy.Matrix([x[i], x[i + 3]]) for i in range(3)], 2)
    return v.dot(v) / 2 + sum(1 / sympy.sqrt((a - b).dot(a - b)) for a, b in pairs)


PLEIADES = """
 0.3706139143970502  3.237284092057233 -3.222559032418324  0.6597091455775310  0.3425581707156584
 1.562172101400631  -0.7003092922212495 -3.943437585517392 -3.271380973972550  5.225081843456543
-2.590612434977470   1.198213693392275 -0.2429682344935824  1.091449240428980  3.417003806314313
 1.354584501625501  -2.590065597810775  2.025053734714242  -1.155815100160448 -0.8072988170223021
 0.5952396354208710 -3.741244961234010  0.3773459685750630  0.9386858869551073  0.3667922227200571
-0.3474046353808490  2.344915448180937 -1.947020434263292
"""


def _arenstorf(loops: str, speed: str, period: str) -> Published:
    orbit = scenes.get("arenstorf")  # whose momentum is ẏ + x
    scene = orbit.with_values(mu0=[0, Fraction(speed) + orbit.x0[0]])
    words = "Arenstorf's orbits; Hairer, Norsett, Wanner, Solving ODEs I, II.0"
    return Published(f"arenstorf, {loops}", scene, period, ["0.994", "0", "0", speed], words)


def _choreography(name: str, x: list[str], v: list[str], period: str, source: str) -> Published:
    scene = Scene(name=name, groupoid=pair(6), lagrangian=_three_stars, x0=x, v0=v)
    return Published(name.replace("-", " "), scene, period, [*x, *v], source)


def problems() -> list[Published]:
    """What is compared."""
    eight = ["0.97000435669734", "-0.97000435669734", "0", "-0.24308753153583", "0.24308753153583",
             "0"]  # fmt: skip
    speeds = ["0.46620368572052", "0.46620368572052", "-0.93240737144104", "0.43236573046051",
              "0.43236573046051", "-0.86473146092102"]  # fmt: skip
    butterfly = ["0.3068934205", "0.3068934205", "-0.613786841", "0.1255065670", "0.1255065670",
                 "-0.251013134"]  # fmt: skip
    return [
        Published("pleiades", scenes.get("pleiades"), "3", PLEIADES.split(),
                  "IVP test set 2.4, problem plei"),
        _arenstorf("four loops", "-2.00158510637908252240537862224",
                   "17.0652165601579625588917206249"),
        _arenstorf("three loops", "-2.0317326295573368357302057924",
                   "11.124340337266085134999734047"),
        _choreography("figure-eight", eight, speeds, "6.32591398292621",
                      "Simo, in Chenciner, Montgomery, Annals of Math. 152 (2000); Fenucci 2022"),
        _choreography("butterfly", ["-1", "1", "0", "0", "0", "0"], butterfly, "6.2346748391",
                      "orbit I.A.2 of Li, Liao, Science China 60 (2017)"),
    ]  # fmt: skip


def measure(progress: Progress = silent) -> list[dict[str, Any]]:
    """A row a problem: its numbers, ours, and the digits that are right, one by one and in all."""
    rows = []
    asked = problems()
    for i, entry in enumerate(asked):

        def share(label: str, fraction: float, i: int = i) -> None:
            progress(label, (i + fraction) / len(asked))

        printed = max(map(_digits, entry.values))
        with reference.progress_to(share):
            found = reference.solution(entry.scene, entry.time, printed + MARGIN)
        rows.append(compared(entry, [*found.x, *found.v], printed, found.certain_digits))
    return rows


def compared(entry: Published, ours: Sequence[Any], printed: int, certain: int) -> dict[str, Any]:
    """One row; ``ours`` are the certified numbers in the order of the published ones."""
    values, right = [], []
    with mpmath.workdps(printed + MARGIN):
        for text, number in zip(entry.values, ours, strict=True):
            published = mpmath.mpf(text)
            error = abs(number - published) / (abs(published) or 1)
            right.append(float(-mpmath.log10(error)) if error else float(certain))
            shown = mpmath.nstr(number, printed + 2)
            values.append({"published": text, "certified": shown, "right": round(right[-1], 2)})
    worst = right.index(min(right))
    names = [*(f"x[{i}]" for i in range(entry.scene.groupoid.dim_x))]
    names += [f"v[{i}]" for i in range(entry.scene.groupoid.dim_u)]
    return {
        "problem": entry.problem, "time": entry.time, "printed": printed, "certain": certain,
        "scd": round(min(right), 2), "worst": names[worst], "source": entry.source,
        "values": values,
    }  # fmt: skip


def _digits(text: str) -> int:
    """Significant digits of a printed number."""
    return len(text.lstrip("-+").replace(".", "").lstrip("0"))
