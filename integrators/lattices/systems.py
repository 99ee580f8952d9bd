"""Lattices that are known: chains, fields on a grid, a membrane, a beam of rigid bodies."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..algebras import se
from ..groupoids import lie_group, pair
from ..numbers import sympy
from .lattice import Lattice


def _kinetic(x: Any, v: Any, p: Any) -> Any:
    return v.dot(v) / 2


def fput(sites: int = 32, alpha: Any = "1/4", beta: Any = "1/10", mode: int = 1) -> Lattice:
    """Fermi, Pasta, Ulam, Tsingou: unit masses, springs of force r + αr² + βr³, ends fixed.

    It begins at rest in that mode of the linear chain, of amplitude 1.
    """

    def spring(x: Any, y: Any, p: Any) -> Any:
        r = y[0] - x[0]
        return -(r**2 / 2 + p.alpha * r**3 / 3 + p.beta * r**4 / 4)

    x0 = np.sin(np.pi * mode * np.arange(sites) / (sites - 1))[:, None]
    return Lattice(
        "fput", pair(1), sites, {"alpha": alpha, "beta": beta}, _kinetic, spring,
        x0=x0, v0=np.zeros_like(x0), duration=100, step="1/10", fixed_ends=True,
        title="Fermi–Pasta–Ulam–Tsingou chain",
        source="Fermi, Pasta, Ulam, Los Alamos LA-1940 (1955)",
    )  # fmt: skip


def toda(x0: np.ndarray, v0: np.ndarray) -> Lattice:
    """Toda's chain, springs of energy e^(−r) + r − 1: integrable, with solitons; x0, v0 (N,)."""

    def spring(x: Any, y: Any, p: Any) -> Any:
        r = y[0] - x[0]
        return -(sympy.exp(-r) + r - 1)

    return Lattice(
        "toda", pair(1), len(x0), {}, _kinetic, spring, x0=x0[:, None], v0=v0[:, None],
        duration=100, step="1/10", title="Toda's chain",
        source="Toda, J. Phys. Soc. Japan 22 (1967)",
    )  # fmt: skip


def rotors(sites: int = 32, coupling: Any = 1) -> Lattice:
    """A ring of rotors with bonds of energy K(1 − cos(y − x)); it begins as a wave."""
    angle = 2 * np.pi * np.arange(sites) / sites
    return Lattice(
        "rotors", pair(1), sites, {"K": coupling}, _kinetic,
        lambda x, y, p: p.K * (sympy.cos(y[0] - x[0]) - 1), "ring",
        np.sin(angle)[:, None], np.cos(angle)[:, None], duration=100, step="1/20",
        title="Ring of rotors", source="Livi, Pettini, Ruffo, Vulpiani, J. Stat. Phys. 48 (1987)",
    )  # fmt: skip


def sine_gordon(x0: np.ndarray, v0: np.ndarray, spacing: Any) -> Lattice:
    """φ_tt − φ_xx + sin φ = 0 by central differences on a grid of that spacing; x0, v0 (N,).

    The first and last value stay: the field is at rest there.
    """

    def at_point(x: Any, v: Any, p: Any) -> Any:
        return p.a * (v[0] ** 2 / 2 - 1 + sympy.cos(x[0]))

    return Lattice(
        "sine-gordon", pair(1), len(x0), {"a": spacing}, at_point,
        lambda x, y, p: -((y[0] - x[0]) ** 2) / (2 * p.a), x0=x0[:, None], v0=v0[:, None],
        duration=20, step="1/100", fixed_ends=True, title="sine-Gordon equation",
    )  # fmt: skip


def membrane(rows: int = 16, columns: int = 16, beta: Any = 1) -> Lattice:
    """A rectangular net of unit masses moving across its plane, bonds of energy r²/2 + βr⁴/4.

    Its rim is fixed; it begins at rest in its lowest mode.
    """

    def bond(x: Any, y: Any, p: Any) -> Any:
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


def beam(sites: int = 20, stiffness: Any = 100, bending: Any = 1) -> Lattice:
    """A geometrically exact beam: rigid bodies on SE(3) with springs of stretch and of bending.

    The strain of a bond is Γ = ½(R + R′)ᵀ(r′ − r)/a − e₁, its energy a·EA|Γ|²/2 +
    EI·tr(1 − RᵀR′)/a, that of Reissner and Simo to second order in the spacing a; nothing holds the
    beam, so it keeps its momenta. It begins straight along e₁, of length 1, and turns and flexes.
    """
    a = sympy.Rational(1, sites - 1)

    def at_body(g: Any, v: Any, p: Any) -> Any:
        turning = p.inertia * (v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
        return a * (turning + v[3] ** 2 + v[4] ** 2 + v[5] ** 2) / 2

    def bond(g: Any, k: Any, p: Any) -> Any:
        one, other = g[:3, :3], k[:3, :3]
        strain = (one + other).T * (k[:3, 3] - g[:3, 3]) / (2 * a) - sympy.Matrix([1, 0, 0])
        bent = 3 - sum(one[i, j] * other[i, j] for i in range(3) for j in range(3))
        return -(a * p.EA * strain.dot(strain) / 2 + p.EI * bent / a)

    place = np.linspace(0, 1, sites)
    x0 = np.broadcast_to(np.eye(4), (sites, 4, 4)).copy()
    x0[:, 0, 3] = place
    v0 = np.zeros((sites, 6))
    v0[:, 1], v0[:, 4], v0[:, 5] = 1, place**2 - 1 / 3, -(place - 1 / 2)
    return Lattice(
        "beam", lie_group(se(3)), sites, {"EA": stiffness, "EI": bending, "inertia": "1/100"},
        at_body, bond, x0=x0, v0=v0, duration=10, step="1/2000", title="Beam of rigid bodies",
        source="Simo, Comput. Methods Appl. Mech. Engng. 49 (1985); Reissner (1973)",
    )  # fmt: skip
