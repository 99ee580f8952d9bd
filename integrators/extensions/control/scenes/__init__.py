"""The problems of optimal control that come with discmech, found by name."""

from __future__ import annotations

import math
from functools import cache

from ....errors import unknown
from ....groupoids import pair
from ....numbers import sympy
from ....scene import Column, Parameters, Point, Scalar, Scene, Velocity
from ....scenes import get as scene_of
from .. import Control


def _effort(x: Point, v: Velocity, f: Column, p: Parameters) -> Scalar:
    return f.dot(f) / 2


def _double_integrator() -> Control:
    scene = Scene(
        name="double-integrator",
        title="Mass from rest to rest",
        groupoid=pair(1),
        lagrangian=lambda x, v, p: v[0] ** 2 / 2,
        x0=[0],
        v0=[0],
        duration=1,
        source="Bryson, Ho, Applied Optimal Control, 2.7",
    )
    return Control(scene, _effort, end=([1], [0]))


def _oscillator() -> Control:
    scene = scene_of("harmonic").with_values(
        name="oscillator",
        title="Oscillator brought to rest",
        parameters={"mass": 1, "stiffness": 1},
        x0=[1],
        v0=["0.5"],
        duration=2,
        symmetries=(),
    )
    return Control(scene, _effort, end=([0], [0]))


def _reorientation(name: str, inertia: list[int], title: str) -> Control:
    """A motion from rest to rest: a third of a turn about the diagonal of the axes."""
    body = scene_of("rigid-body").with_values(
        name=name, title=title, parameters={"inertia": inertia}, v0=[0, 0, 0], duration=2,
        symmetries=(),
    )  # fmt: skip
    turned = [0, -1, 0, 0, 0, -1, 1, 0, 0]
    return Control(body.with_attitude(), _effort, end=(turned, [0, 0, 0]))


def _transfer() -> Control:
    """A transfer from the circle of radius 1 to that of 5/4 in one turn, to the point (−3/4, 1)."""
    scene = Scene(
        name="low-thrust-transfer",
        title="Transfer by small thrust",
        groupoid=pair(2),
        lagrangian=lambda x, v, p: v.dot(v) / 2 + 1 / sympy.sqrt(x.dot(x)),
        x0=[1, 0],
        v0=[0, 1],
        duration=10,
        source="Bryson, Ho, Applied Optimal Control, 2.5; Junge, Marsden, Ober-Blöbaum 2005, 5",
    )
    whole = math.atan2(1, -0.75) + 2 * math.pi

    def path(t: float) -> list[float]:
        r, angle = 1 + t / 40, whole * t / 10
        return [r * math.cos(angle), r * math.sin(angle)]

    v1 = [-sympy.sqrt(sympy.Rational(4, 5)) * 4 / 5, -sympy.sqrt(sympy.Rational(4, 5)) * 3 / 5]
    return Control(scene, _effort, ((-0.75, 1), tuple(map(float, v1))), path=path)


def _upright() -> Control:
    """A top set upright; Γ, which points up, is the centre of mass's axis when the top stands."""
    scene = scene_of("lagrange-top").with_values(
        name="upright-top",
        title="Heavy top set upright",
        x0=["2/3", "2/3", "-1/3"],
        v0=[0, 0, 0],
        duration=3,
        symmetries=(),
    )
    return Control(scene, _effort, end=([0, 0, 1], [0, 0, 0]))


_PROBLEMS = {
    "double-integrator": _double_integrator,
    "oscillator": _oscillator,
    "reorientation": lambda: _reorientation("reorientation", [1, 2, 3], "Rigid body turned"),
    "symmetric-reorientation": lambda: _reorientation(
        "symmetric-reorientation", [2, 2, 1], "Symmetric body turned"
    ),
    "low-thrust-transfer": _transfer,
    "upright-top": _upright,
}
NAMES = tuple(_PROBLEMS)


@cache
def get(name: str) -> Control:
    """Return the problem with that name; raises `BadInput` with the nearest name."""
    if name not in _PROBLEMS:
        raise unknown("control problem", name, NAMES)
    return _PROBLEMS[name]()
