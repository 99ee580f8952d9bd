"""Well-known lattices: chains, fields, a membrane, beams and linkages of rigid bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from ....algebras import se, so
from ....errors import unknown
from ....groupoids import lie_group, pair
from ....hooks import getter
from ....numbers import exact_rational, sympy
from ....numbers.types import Given, Parameters, Point, Scalar, Velocity
from .. import Lattice
from . import symmetries
from .linkages import linkage, rods


def _kinetic(x: Point, v: Velocity, p: Parameters) -> Scalar:
    return v.dot(v) / 2


def fput(sites: int = 32, alpha: Given = "1/4", beta: Given = "1/10", mode: int = 1) -> Lattice:
    """Fermi, Pasta, Ulam, Tsingou: unit masses, springs of force r + αr² + βr³, fixed ends.

    It begins at rest in the given mode of the linear chain, with amplitude 1.
    """

    def spring(x: Point, y: Point, p: Parameters) -> Scalar:
        r = y[0] - x[0]
        return -(r**2 / 2 + p.alpha * r**3 / 3 + p.beta * r**4 / 4)

    x0 = np.sin(np.pi * mode * np.arange(sites) / (sites - 1))[:, None]
    return Lattice(
        "fput", pair(1), sites, {"alpha": alpha, "beta": beta}, _kinetic, spring,
        x0=x0, v0=np.zeros_like(x0), duration=100, step="1/10", fixed_ends=True,
        title="Fermi–Pasta–Ulam–Tsingou chain",
        source="Fermi, Pasta, Ulam, Los Alamos LA-1940 (1955)",
    )  # fmt: skip


def toda(x0: np.ndarray | None = None, v0: np.ndarray | None = None) -> Lattice:
    """Toda's chain, springs of energy e^(−r) + r − 1: integrable, with solitons; x0, v0 (N,).

    The default start has 64 sites and a soliton with κ = 1 at site 24, which moves to the right.
    """
    if x0 is None or v0 is None:
        wave = np.exp(-2 * (np.arange(-1.0, 64) - 24)) / (1 - np.exp(-2))
        rate = np.sinh(1) * 2 * wave / (1 + wave)
        x0, v0 = -np.diff(np.log1p(wave)), -np.diff(rate)

    def spring(x: Point, y: Point, p: Parameters) -> Scalar:
        r = y[0] - x[0]
        return -(sympy.exp(-r) + r - 1)

    return Lattice(
        "toda", pair(1), len(x0), {}, _kinetic, spring, x0=x0[:, None], v0=v0[:, None],
        duration=100, step="1/10", title="Toda's chain",
        symmetries={"total momentum": symmetries.along},
        source="Toda, J. Phys. Soc. Japan 22 (1967)",
    )  # fmt: skip


def rotors(sites: int = 32, coupling: Given = 1) -> Lattice:
    """A ring of rotors with bonds of energy K(1 − cos(y − x)); it begins as a wave, and turns."""
    angle = 2 * np.pi * np.arange(sites) / sites
    return Lattice(
        "rotors", pair(1), sites, {"K": coupling}, _kinetic,
        lambda x, y, p: p.K * (sympy.cos(y[0] - x[0]) - 1), "ring",
        np.sin(angle)[:, None], (0.5 + np.cos(angle))[:, None], duration=100, step="1/20",
        symmetries={"total momentum": symmetries.along},
        title="Ring of rotors", source="Livi, Pettini, Ruffo, Vulpiani, J. Stat. Phys. 48 (1987)",
    )  # fmt: skip


def sine_gordon(
    x0: np.ndarray,
    v0: np.ndarray,
    spacing: Given,
    name: str = "sine-gordon",
    title: str = "sine-Gordon equation",
) -> Lattice:
    """φ_tt − φ_xx + sin φ = 0 by central differences on a grid with this spacing; x0, v0 (N,).

    The first and last value stay: the field is at rest there. Starts in closed form are in
    `discmech.reference.closed_forms.lattice_waves`.
    """

    def at_point(x: Point, v: Velocity, p: Parameters) -> Scalar:
        return p.a * (v[0] ** 2 / 2 - 1 + sympy.cos(x[0]))

    return Lattice(
        name, pair(1), len(x0), {"a": spacing}, at_point,
        lambda x, y, p: -((y[0] - x[0]) ** 2) / (2 * p.a), x0=x0[:, None], v0=v0[:, None],
        duration=20, step="1/100", fixed_ends=True, title=title,
    )  # fmt: skip


def sine_gordon_box(x0: np.ndarray, v0: np.ndarray, spacing: Given, **words: str) -> Lattice:
    """The same field, by values of its Lagrangian at the middle of each square of the grid.

    With the midpoint rule this is the variational integrator of Marsden, Patrick and Shkoller
    (1998, 5), and the box scheme of Preissmann with its other fields eliminated (Bridges, Reich,
    Phys. Lett. A 284 (2001), 184): a bond contains the velocities of both its ends.
    """

    def in_square(x: Point, y: Point, v: Velocity, w: Velocity, p: Parameters) -> Scalar:
        moved, rise, value = (v[0] + w[0]) / 2, (y[0] - x[0]) / p.a, (x[0] + y[0]) / 2
        return p.a * (moved**2 / 2 - rise**2 / 2 - 1 + sympy.cos(value))

    by_sites = sine_gordon(x0, v0, spacing, **words)
    return replace(by_sites, on_site=None, on_bond=in_square)


def breather(spacing: Given = "1/4", frequency: float = 0.6, box: bool = False) -> Lattice:
    """The sine-Gordon breather on [−20, 20], at its turning point; box: use `sine_gordon_box`."""
    places = grid(spacing)
    width = np.sqrt(1 - frequency**2)
    x0 = 4 * np.arctan(width / (frequency * np.cosh(width * places)))
    if box:
        return sine_gordon_box(x0, 0 * x0, spacing, name="breather-box",
                               title="sine-Gordon breather, box scheme")  # fmt: skip
    return sine_gordon(x0, 0 * x0, spacing, "breather", "sine-Gordon breather")


def kink(spacing: Given = "1/4", speed: float = 0.5) -> Lattice:
    """The sine-Gordon kink on [−20, 20], which begins in the middle and moves to the right."""
    gamma = 1 / np.sqrt(1 - speed**2)
    phase = gamma * grid(spacing)
    x0, v0 = 4 * np.arctan(np.exp(phase)), -2 * gamma * speed / np.cosh(phase)
    return sine_gordon(x0, v0, spacing, "kink", "sine-Gordon kink")


def grid(spacing: Given) -> np.ndarray:
    """Return places from −20 to 20 with that spacing."""
    return np.linspace(-20, 20, round(40 / float(exact_rational(spacing, "spacing"))) + 1)


def membrane(rows: int = 16, columns: int = 16, beta: Given = 1) -> Lattice:
    """A rectangular net of unit masses that move across its plane, bonds of energy r²/2 + βr⁴/4.

    Its rim is fixed; it begins at rest in its lowest mode.
    """

    def bond(x: Point, y: Point, p: Parameters) -> Scalar:
        r = y[0] - x[0]
        return -(r**2 / 2 + p.beta * r**4 / 4)

    at = np.arange(rows * columns).reshape(rows, columns)
    bonds = np.concatenate([
        np.stack([at[:, :-1].ravel(), at[:, 1:].ravel()], axis=1),
        np.stack([at[:-1].ravel(), at[1:].ravel()], axis=1),
    ])  # fmt: skip
    i, j = np.divmod(np.arange(rows * columns), columns)
    x0 = np.sin(np.pi * i / (rows - 1)) * np.sin(np.pi * j / (columns - 1))
    rim = np.flatnonzero((i % (rows - 1) == 0) | (j % (columns - 1) == 0))
    return Lattice(
        "membrane", pair(1), rows * columns, {"beta": beta}, _kinetic, bond, bonds, x0[:, None],
        np.zeros((rows * columns, 1)), duration=100, step="1/10", fixed=rim,
        title="Nonlinear membrane",
    )  # fmt: skip


def bodies(sites: int = 16, coupling: Given = 1) -> Lattice:
    """A ring of rigid bodies on SO(3); bonds of energy −K tr(AᵀB) pull them parallel.

    Nothing else turns them, so the sum of their angular momenta in space is conserved.
    """
    angle = 2 * np.pi * np.arange(sites) / sites

    def at_body(g: Point, v: Velocity, p: Parameters) -> Scalar:
        return (v[0] ** 2 + 2 * v[1] ** 2 + 3 * v[2] ** 2) / 2

    v0 = np.stack([np.cos(angle), np.sin(angle), 1 + np.cos(angle) / 2], axis=1)
    return Lattice(
        "bodies", lie_group(so(3)), sites, {"K": coupling}, at_body,
        lambda g, k, p: p.K * (g.T * k).trace(), "ring", v0=v0, duration=50, step="1/20",
        title="Ring of rigid bodies", symmetries={"angular momentum": symmetries.turns_of_attitude},
    )  # fmt: skip


def beam(sites: int = 20, stiffness: Given = 100, bending: Given = 1) -> Lattice:
    """A geometrically exact beam: rigid bodies on SE(3) with springs of stretch and of bending.

    The strain of a bond is Γ = ½(R + R′)ᵀ(r′ − r)/a − e₁. Its energy is a·EA|Γ|²/2 + EI·tr(1 −
    RᵀR′)/2a; the second term is a·EI|κ|²/2 for the curvature κ, that of Reissner and Simo to second
    order in the spacing a. EA resists stretch and shear, EI bending and torsion. A site carries the
    mass and inertia of the `length` of beam nearest to it: a, but a/2 at the two ends. The beam is
    free, so it conserves its momenta. It begins straight along e₁, with length and mass 1, and
    turns and flexes. The step is 1/2000 for 20 sites, and shorter for a smaller spacing.
    """
    a = sympy.Rational(1, sites - 1)
    length = np.full(sites, float(a))
    length[[0, -1]] /= 2

    def at_body(g: Point, v: Velocity, p: Parameters) -> Scalar:
        turning = p.inertia * (v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
        return p.length * (turning + v[3] ** 2 + v[4] ** 2 + v[5] ** 2) / 2

    def bond(g: Point, k: Point, p: Parameters) -> Scalar:
        one, other = g[:3, :3], k[:3, :3]
        strain = (one + other).T * (k[:3, 3] - g[:3, 3]) / (2 * a) - sympy.Matrix([1, 0, 0])
        bent = 3 - sum(one[i, j] * other[i, j] for i in range(3) for j in range(3))
        return -(a * p.EA * strain.dot(strain) + p.EI * bent / a) / 2

    place = np.linspace(0, 1, sites)
    x0 = np.broadcast_to(np.eye(4), (sites, 4, 4)).copy()
    x0[:, 0, 3] = place
    v0 = np.zeros((sites, 6))
    v0[:, 1], v0[:, 4], v0[:, 5] = 1, place**2 - 1 / 3, -(place - 1 / 2)
    return Lattice(
        "beam", lie_group(se(3)), sites,
        {"EA": stiffness, "EI": bending, "inertia": "1/100", "length": length},
        at_body, bond, x0=x0, v0=v0, duration=10, step=19 * a / 2000, title="Beam of rigid bodies",
        source="Simo, Comput. Methods Appl. Mech. Engng. 49 (1985); Reissner (1973)",
        symmetries={"momentum": symmetries.shifts, "angular momentum": symmetries.turns},
    )  # fmt: skip


def spaghetti(sites: int = 41) -> Lattice:
    """The flying spaghetti: a free beam, so soft that its own motion rolls it up.

    A thin beam of length 1 is thrown straight, turning and bending in its plane and out of it; Simo
    and Vu-Quoc throw theirs by forces at one end, in other units.
    """
    s = np.linspace(-1, 1, sites)
    v0 = np.zeros((sites, 6))
    # the slopes of these velocities along the beam are the angular ones: nothing shears at first
    v0[:, 2], v0[:, 4] = 6 + 12 * s, 3 * s + 3 * s**2 - 1
    v0[:, 1], v0[:, 5] = 3 * s**2, -(s**3) / 2
    v0[:, 3] = 1
    soft = beam(sites, 100, "1/250")
    return replace(
        soft, name="spaghetti", parameters={**soft.parameters, "inertia": "1/1000"}, v0=v0,
        title="Flying spaghetti",
        source="Simo, Vu-Quoc, Comput. Methods Appl. Mech. Engng. 66 (1988), 125",
    )  # fmt: skip


def bead_chain(sites: int = 40) -> Lattice:
    """Beads on a string above a table: waves of different heights, so that they land one by one.

    A rebound has half the speed of the approach.
    """
    angle = 2 * np.pi * np.arange(sites) / min(sites, 40)
    height = 0.3 + 0.2 * np.sin(angle) + 0.1 * np.cos(3 * angle + 1)
    return Lattice(
        "bead-chain", pair(1), sites, {"stiffness": 4, "gravity": 1},
        lambda x, v, p: v[0] ** 2 / 2 - p.gravity * x[0],
        lambda x, y, p: -p.stiffness * (y[0] - x[0]) ** 2 / 2, x0=height[:, None],
        v0=0.1 * np.cos(2 * angle)[:, None], duration=4, step="1/50",
        contact=lambda x, p: [x[0]], restitution="1/2", title="Beads on a string above a table",
        source="a string over an obstacle: Schatzman, J. Math. Anal. Appl. 73 (1980)",
    )  # fmt: skip


def cradle(sites: int = 6, lifted: int = 2, slack: Given = "1/20") -> Lattice:
    """Newton's cradle: equal balls on strings side by side; as many leave as have been lifted.

    x is a ball's way from its place of rest, its string that of a small swing with the period 2π.
    Between two balls is a slack, so that they strike one after another: impacts at one time are one
    system, as of a scene, after which all balls that touch move.
    """
    x0 = np.where(np.arange(sites) < lifted, -1.0, 0.0)[:, None]
    return Lattice(
        "cradle", pair(1), sites, {"slack": slack}, lambda x, v, p: (v[0] ** 2 - x[0] ** 2) / 2,
        bond_contact=lambda x, y, p: [y[0] - x[0] + p.slack], restitution=1, x0=x0,
        v0=np.zeros_like(x0), duration=20, step="1/100", title="Newton's cradle",
        source="Hutzler, Delaney, Weaire, MacLeod, Am. J. Phys. 72 (2004)",
    )  # fmt: skip


_BUILT_IN: dict[str, Callable[[], Lattice]] = {
    "fput": fput, "toda": toda, "rotors": rotors, "breather": breather,
    "breather-box": lambda: breather(box=True), "kink": kink,
    "membrane": membrane, "bodies": bodies, "beam": beam, "spaghetti": spaghetti,
    "bead-chain": bead_chain, "cradle": cradle, "rods": rods, "links-spherical": linkage,
    "links-revolute": lambda: linkage(8, "revolute"),
}  # fmt: skip
NAMES = tuple(_BUILT_IN)


@getter
@cache
def get(name: str) -> Lattice:
    """Return the named lattice with its default size; an unknown name raises `BadInput`."""
    if name not in _BUILT_IN:
        raise unknown("lattice", name, NAMES)
    return _BUILT_IN[name]()
