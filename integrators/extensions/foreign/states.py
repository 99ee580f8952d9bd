"""The states that a program takes and returns: q or an attitude, and momenta or velocities.

An attitude A = R(q) ∈ SO(3) leads from the body to space, as x does in `Scene.with_attitude`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from ...algebras import so
from ...groupoids import LieGroup, RowAction
from ...numbers.types import Vector
from ...scene import Scene

#: a `SceneInNumbers`, whose file comes after this one
System: TypeAlias = Any

#: the functions of a scene in numbers, whose first argument is q
OF_Q = {
    "f", "H", "gradient", "velocity", "force", "tensor", "momentum", "constraint",
    "constraint_jacobian",
}  # fmt: skip
#: largest entry of A Aᵀ − e of a rotation that is written in decimals
NO_ROTATION = 1e-9


@dataclass(frozen=True)
class State:
    """A program's state: the scene's x itself, and p or v, the letter `second`."""

    second: str = "p"
    first = "q"
    has_attitude = False

    def written(self, x: Vector) -> Vector:
        """Return x (n,) in the program's coordinates; x (n, k) are k states."""
        return x

    def read(self, q: Vector) -> Vector:
        """Return x from the program's coordinates."""
        return q

    def scene(self, scene: Scene) -> Scene:
        """Return the scene on which it is a state."""
        return scene

    def refusal(self, scene: Scene) -> str:
        """Return why a scene has no such state, or ""."""
        return ""

    def asked(self, system: System) -> System:
        """Return the scene in numbers as a function of the program's own coordinates."""
        return system

    def off_group(self, x: Vector) -> tuple[float, str]:
        """Return how far x (n,), as it was read, is from every attitude, and what to do."""
        return 0.0, ""


@dataclass(frozen=True)
class Rotation(State):
    """A body's attitude as the matrix R (3, 3), and p or v in the body.

    R comes as a rotation to round-off, also where differences move x beside the group; what is read
    is x as the program gives it.
    """

    first = "R"
    has_attitude = True

    def written(self, x: Vector) -> Vector:
        """Return R (3, 3), the rotation nearest to x (9,)."""
        return _matrix(_quaternion(x)).reshape(3, 3, *x.shape[1:])

    def read(self, q: Vector) -> Vector:
        """Return R row by row, (9,)."""
        return q.reshape(9, *q.shape[2:])

    def scene(self, scene: Scene) -> Scene:
        """Return the scene with the attitude as base."""
        return scene.with_attitude()

    def refusal(self, scene: Scene) -> str:
        """Return why a scene is no body that turns, or ""."""
        group = scene.groupoid
        turning = isinstance(group, LieGroup) or (isinstance(group, RowAction) and group.rows == 3)
        if turning and getattr(group, "algebra", None) == so(3):
            A = np.array([float(e) for e in scene.x0] or np.eye(3).ravel()).reshape(3, 3)
            if abs(A @ A.T - np.eye(3)).max() < NO_ROTATION and np.linalg.det(A) > 0:
                return ""
        return (
            f"{scene.name} has no attitude for a program's state: take a scene on lie_group(so(3)) "
            "or its with_attitude(), such as rigid-body."
        )

    def asked(self, system: System) -> System:
        """Return the scene in numbers with functions of R, or of the quaternion."""
        return _OfAttitude(self, system)

    def off_group(self, x: Vector) -> tuple[float, str]:
        """Return the largest entry of RᵀR − 1, and what to do."""
        R = x.reshape(3, 3)
        off = float(np.abs(R.T @ R - np.eye(3)).max())
        return off, (
            f"the matrix that it returns is no rotation (RᵀR differs from 1 by {off:.1e}): return "
            "the rotation nearest to it"
        )


class Quaternion(Rotation):
    """A body's attitude as a unit quaternion (w, x, y, z), and p or v in the body.

    q and −q are one attitude, and either may come. What is read is |q|² A: a program that loses the
    length of q is no rotation.
    """

    first = "quaternion"

    def written(self, x: Vector) -> Vector:
        """Return the unit quaternion (4,) of the rotation nearest to x (9,)."""
        return _quaternion(x)

    def read(self, q: Vector) -> Vector:
        """Return |q|² A row by row, (9,)."""
        return _matrix(q)

    def off_group(self, x: Vector) -> tuple[float, str]:
        """Return | |q| − 1 |, where det(|q|² A) = |q|⁶, and what to do."""
        off = abs(abs(float(np.linalg.det(x.reshape(3, 3)))) ** (1 / 6) - 1)
        return off, (
            f"the quaternion that it returns is not of unit length (by {off:.1e}): divide it by "
            "its norm"
        )


class _OfAttitude:
    """A scene in numbers whose functions take a program's attitude in the place of x."""

    def __init__(self, state: State, system: System) -> None:
        self._state, self._system = state, system

    def __getattr__(self, name: str) -> Any:
        if name in ("_state", "_system"):  # of a copy, before it has them
            raise AttributeError(name)
        value = getattr(self._system, name)
        if name not in OF_Q:
            return value
        return lambda q, *rest: value(self._state.read(np.asarray(q)), *rest)


def _matrix(q: Vector) -> Vector:
    """Return v ↦ q v q̄ of a quaternion, nine numbers row by row."""
    w, x, y, z = q
    return np.array([
        w*w + x*x - y*y - z*z, 2*(x*y - w*z), 2*(x*z + w*y),
        2*(x*y + w*z), w*w - x*x + y*y - z*z, 2*(y*z - w*x),
        2*(x*z - w*y), 2*(y*z + w*x), w*w - x*x - y*y + z*z,
    ])  # fmt: skip


def _quaternion(a: Vector) -> Vector:
    """Return the unit quaternion, w ≥ 0, of the rotation nearest to a matrix (9,).

    4 q qᵀ is linear in the entries of a rotation; of another matrix the eigenvector of the largest
    eigenvalue belongs to the nearest rotation and is smooth in it (Bar-Itzhack, J. Guid. Control
    Dyn. 23 (2000), 1085). Numbers of more digits are those of a rotation.
    """
    xx, xy, xz, yx, yy, yz, zx, zy, zz = a
    products = np.array([
        [1 + xx + yy + zz, zy - yz, xz - zx, yx - xy],
        [zy - yz, 1 + xx - yy - zz, xy + yx, xz + zx],
        [xz - zx, xy + yx, 1 - xx + yy - zz, yz + zy],
        [yx - xy, xz + zx, yz + zy, 1 - xx - yy + zz],
    ])  # fmt: skip
    if products.dtype == object:
        column = products[:, int(np.argmax(np.diag(products)))]
        q = column / sum(column * column) ** 0.5
    else:
        finite = np.isfinite(products).all(axis=(0, 1))  # eigh raises at what is no number
        at = np.moveaxis(np.where(finite, products, 0.0), (0, 1), (-2, -1))
        q = np.moveaxis(np.linalg.eigh(at)[1][..., -1], -1, 0)
        q = (products * q).sum(axis=1)  # to the last digits
        q = q / np.sqrt((q * q).sum(axis=0))
    return np.where(q[0] < 0, -q, q)


#: the states that a program may take and return
STATES: dict[str, State] = {
    "qp": State(), "qv": State("v"), "Rp": Rotation(), "Rv": Rotation("v"),
    "quaternion p": Quaternion(), "quaternion v": Quaternion("v"),
}  # fmt: skip
