"""Bodies in chains: links hung from a fixed first site, held by constraints on bonds."""

from __future__ import annotations

import numpy as np

from ....algebras import se
from ....groupoids import lie_group, pair
from ....numbers.types import Parameters, Point, Scalar, Velocity
from .. import Lattice
from . import symmetries

VERTICAL = "vertical angular momentum"
DIRECTION = np.array([0.6, 0, -0.8])  # direction of the links at the start
#: an attitude that turns e₁ into that direction, with neither e₂ nor e₃ level
ATTITUDE = np.array([[0.6, 0.48, 0.64], [0, 0.8, -0.6], [-0.8, 0.36, 0.48]])


def rods(links: int = 8, spin: float = 0.3) -> Lattice:
    """Point masses on massless rods, one below the other: a pendulum with that many links in space.

    It begins straight, and turns about the vertical.
    """
    x0 = np.arange(links + 1)[:, None] * DIRECTION
    return Lattice(
        "rods", pair(3), links + 1, {"gravity": 1, "length": 1},
        lambda x, v, p: v.dot(v) / 2 - p.gravity * x[2],
        constraint=lambda x, y, p: [((y - x).dot(y - x) - p.length**2) / 2],
        x0=x0, v0=np.cross([0, 0, spin], x0), fixed=[0], duration=10, step="1/100",
        title="Chain of masses on rods", source="Marsden, West, Acta Numerica 10 (2001), 3.5",
        symmetries={VERTICAL: symmetries.turn_about_the_vertical},
    )  # fmt: skip


def linkage(links: int = 8, joint: str = "spherical", rate: float = 0.3) -> Lattice:
    """Rigid links of length 1 on SE(3) with axis e₁, each joined to the end of the one before.

    joint: "spherical", or "revolute" with hinges about e₂ and e₃ of alternating links. It begins
    straight, and turns as one body: about the vertical, or about its first hinge.
    """
    hinged = joint == "revolute"
    axes = np.eye(3)[1 + np.arange(links) % 2]

    def at_body(g: Point, v: Velocity, p: Parameters) -> Scalar:
        turning = p.spinning * v[0] ** 2 + p.tilting * (v[1] ** 2 + v[2] ** 2)
        moving = p.mass * (v[3] ** 2 + v[4] ** 2 + v[5] ** 2)
        return (turning + moving) / 2 - p.mass * p.gravity * g[2, 3]

    def held(g: Point, k: Point, p: Parameters) -> Scalar:
        one, other = g[:3, :3], k[:3, :3]
        gap = k[:3, 3] - g[:3, 3] - (one[:, 0] + other[:, 0]) / 2
        if not hinged:
            return list(gap)
        axis = other * p.axis
        return [*gap, one[:, 0].dot(axis), (one * p.across).dot(axis)]

    place = (np.arange(links + 1) - 0.5)[:, None] * DIRECTION
    turning = rate * (ATTITUDE[:, 1] if hinged else np.array([0, 0, 1]))
    x0 = np.broadcast_to(np.eye(4), (links + 1, 4, 4)).copy()
    x0[:, :3, :3], x0[:, :3, 3] = ATTITUDE, place
    v0 = np.concatenate([np.broadcast_to(turning, place.shape), np.cross(turning, place)], axis=1)
    v0 = np.concatenate([v0[:, :3] @ ATTITUDE, v0[:, 3:] @ ATTITUDE], axis=1)
    v0[0] = 0
    hinges = {"axis": axes, "across": np.cross([1, 0, 0], axes)} if hinged else {}
    return Lattice(
        f"links-{joint}", lie_group(se(3)), links + 1,
        {"mass": 1, "spinning": "1/100", "tilting": "1/12", "gravity": 1, **hinges}, at_body,
        constraint=held, x0=x0, v0=v0, fixed=[0], duration=10, step="1/100",
        title=f"Rigid links on {joint} joints",
        source="Lee, Liu, Park, Srinivasa, A linear-time variational integrator for multibody "
        "systems (WAFR 2016)",
        # a joint at a point of the axis leaves a link free to spin about that axis
        symmetries={} if hinged else {VERTICAL: symmetries.turn_about_the_vertical,
                                      "spin": symmetries.own_spin},
    )  # fmt: skip
