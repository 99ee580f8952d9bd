"""Programs that turn a free body: μ and the attitude, as a matrix or as a quaternion."""

import numpy as np
from scipy.spatial.transform import Rotation

from discmech import Conserved, Scene, black_box, lie_group, so


def hat(w):
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def times(a, b):
    return np.r_[a[0] * b[0] - a[1:] @ b[1:], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])]


def split(q, p, h, inertia, turn, rate=1.0, casimir=0.0, loss=0.0):
    """Turn about each axis in turn, there and back; then by a Casimir added to H, and lose μ."""
    for i, part in ((0, 0.5), (1, 0.5), (2, 1), (1, 0.5), (0, 0.5)):
        w = part * h * p[i] / inertia[i] * np.eye(3)[i]
        by = Rotation.from_rotvec(w)
        p, q = by.as_matrix().T @ p, turn(q, by if rate == 1 else Rotation.from_rotvec(rate * w))
    return turn(q, Rotation.from_rotvec(casimir * h * p)), p * (1 - loss)


def turn_matrix(R, by):
    return R @ by.as_matrix()


def turn_quaternion(q, by):
    return -times(q, np.roll(by.as_quat(), 1))  # the other sign is the same attitude


CLAIMS = {"order": 2, "symplectic": True, "reversible": True, "keeps": "momentum"}


def program(state, turn, name, **fault):
    @black_box(**CLAIMS, state=state, name=name)
    def made(q, p, h, system):
        return split(q, p, h, np.array(system.parameters.inertia), turn, **fault)

    return made


matrix = program("Rp", turn_matrix, "matrix")
quaternion = program("quaternion p", turn_quaternion, "quaternion")
fast = program("quaternion p", turn_quaternion, "fast", rate=1 + 1e-6)
casimir = program("Rp", turn_matrix, "casimir", casimir=1e-6)
lossy = program("Rp", turn_matrix, "lossy", loss=1e-6)
little = program("Rp", turn_matrix, "little", loss=1e-14)


@black_box(order=2, reversible=True, keeps=("energy", "momentum"), state="Rv")
def lie_midpoint(R, v, h, system):
    inertia, e = np.array(system.parameters.inertia), np.eye(3)
    p = P = inertia * v
    for _ in range(20):
        m = (p + P) / 2
        P = p + h * np.cross(m, m / inertia)
    w = hat(h * (p + P) / 2 / inertia)
    return R @ np.linalg.solve(e - w / 2, e + w / 2), P / inertia


@black_box(**CLAIMS, state="quaternion p")
def last(q, p, h, system):
    """The quaternion as (x, y, z, w)."""
    q, p = split(np.roll(q, 1), p, h, np.array(system.parameters.inertia), turn_quaternion)
    return np.roll(q, -1), p


@black_box(**CLAIMS, state="quaternion p")
def long(q, p, h, system):
    """The quaternion grows by 10⁻⁹ in a unit of time."""
    q, p = split(q, p, h, np.array(system.parameters.inertia), turn_quaternion)
    return q * (1 + 1e-9 * h), p


@black_box(**CLAIMS, state="Rp")
def in_space(R, p, h, system):
    """The attitude from space to the body."""
    R, p = split(R.T, p, h, np.array(system.parameters.inertia), turn_matrix)
    return R.T, p


@black_box(**CLAIMS, state="Rp")
def first(R, p, h, system):
    """The attitude by an explicit Euler step."""
    inertia = np.array(system.parameters.inertia)
    by = Rotation.from_rotvec(h * p / inertia)
    return turn_matrix(R, by), split(R, p, h, inertia, turn_matrix)[1]


#: it declares the momentum in a frame that turns the wrong way
steady = Scene(
    "steady", lie_group(so(3)), lambda x, v, p: v[0] ** 2 / 2 + v[1] ** 2 + 3 * v[2] ** 2 / 2,
    v0=[0, 0, 1], duration=5, step="1/20",
    symmetries=[Conserved("wrong way", lambda A, mu, p: A.T * mu, attitude=True)],
)  # fmt: skip
