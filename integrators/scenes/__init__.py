"""The scenes that come with discmech: one file a mechanical system, found by name."""

from __future__ import annotations

from importlib import import_module
from typing import cast

from ..errors import unknown
from ..scene import Scene

NAMES = (
    "harmonic", "pendulum", "double-pendulum", "kepler", "henon-heiles", "charged-particle",
    "fpu", "spring-pendulum", "outer-solar-system",
    "rigid-body", "rigid-body-so4", "kirchhoff", "sl2", "moser-veselov",
    "heavy-top", "lagrange-top", "kovalevskaya-top", "spherical-pendulum",
    "reduced-kepler", "rotor-body", "wong",
    "damped-pendulum", "duffing", "driven-heavy-top", "kapitza-pendulum",
    "cartesian-pendulum", "double-spherical-pendulum", "pivoted-body",
    "suslov", "chaplygin-sleigh", "rolling-disc", "knife-edge", "contact-oscillator",
)  # fmt: skip


def names() -> tuple[str, ...]:
    """The names of all scenes, simplest first."""
    return NAMES


def get(name: str) -> Scene:
    """The scene of that name; raises `BadInput` with the nearest name."""
    if name not in NAMES:
        raise unknown("scene", name, NAMES)
    return cast(Scene, import_module(f".{name.replace('-', '_')}", __name__).scene)


def all_scenes() -> list[Scene]:
    """Every scene, in the order of `names`."""
    return [get(name) for name in NAMES]
