"""The scenes that come with discmech: one file a mechanical system, found by name.

Other systems are in rooms of the extensions, which are loaded when they are first used: well-known
lattices in `scenes.lattices`, problems of optimal control in `scenes.control`.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, cast

from ..errors import BadInput, unknown
from ..hooks import getter, rooms_of_systems
from ..scene import Scene

NAMES = (
    "harmonic", "pendulum", "double-pendulum", "kepler", "henon-heiles", "charged-particle",
    "fpu", "spring-pendulum", "outer-solar-system",
    "rigid-body", "rigid-body-so4", "kirchhoff", "sl2", "moser-veselov",
    "heavy-top", "lagrange-top", "kovalevskaya-top", "spherical-pendulum",
    "reduced-kepler", "rotor-body", "wong",
    "damped-pendulum", "duffing", "driven-heavy-top", "kapitza-pendulum",
    "cartesian-pendulum", "double-spherical-pendulum", "pivoted-body", "bead-on-hoop",
    "suslov", "chaplygin-sleigh", "rolling-disc", "knife-edge", "contact-oscillator",
    "ball-on-turntable", "ball-in-cylinder",
)  # fmt: skip


#: scenes with contact: what holds of them is another study's (`contact`)
CONTACT = (
    "bouncing-ball", "wedge-billiard", "sliding-block", "falling-stick",
    "impacting-double-pendulum", "beads", "tumbling-box",
)  # fmt: skip


#: problems that other codes are compared on: run by name, and in no study's own choice
COMMON = (
    "argon", "morse", "mathews-lakshmanan", "abc-flow", "water", "torus", "arenstorf", "pleiades",
    "pythagorean",
)  # fmt: skip

#: Lagrangians that are linear in the velocity, by their one-forms; run by name as well
DEGENERATE = (
    "lotka-volterra", "lotka-volterra-half", "vortex-pair", "four-vortices", "magnetic-mirror",
    "guiding-centre", "ablowitz-ladik",
)  # fmt: skip


if not TYPE_CHECKING:  # which would take any name for one of them

    def __getattr__(name: str) -> ModuleType:
        if name in rooms_of_systems:
            return rooms_of_systems[name][1]()
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def names() -> tuple[str, ...]:
    """The names of the scenes without contact that every study takes, simplest first."""
    return NAMES


def every_name() -> tuple[str, ...]:
    """The names of all scenes, those with contact and those run by name last."""
    return (*NAMES, *CONTACT, *COMMON, *DEGENERATE)


@getter
def get(name: str) -> Scene:
    """The scene of that name; raises `BadInput` with the nearest name."""
    if name not in every_name():
        for room, (kind, load) in rooms_of_systems.items():
            if name in load().NAMES:
                raise BadInput(f'{name} is a {kind}: say scenes.{room}.get("{name}").')
        raise unknown("scene", name, every_name())
    return cast(Scene, import_module(f".{name.replace('-', '_')}", __name__).scene)


def all_scenes() -> list[Scene]:
    """Every scene without contact, in the order of `names`."""
    return [get(name) for name in NAMES]


def with_contact() -> list[Scene]:
    """Every scene with contact."""
    return [get(name) for name in CONTACT]
