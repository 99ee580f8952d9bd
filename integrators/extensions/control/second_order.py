"""Second-order tests: whether a stationary motion is a minimum, and whether inputs steer its end.

Eliminating the steps one after another leaves δz_k = −W_k δp_k + …, with W_0 = 0 and

    W′ = A (1 + W Q)⁻¹ W Aᵀ − G,

which is the Gramian of the inputs if Q = 0. The cost grows along every motion that satisfies the
equations exactly if the matrix of all steps has one negative eigenvalue for each equation and no
other. It has as many as its pivots: v of each step and (p_k, z_k) of each node.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from ...errors import BadInput, NotDecided

#: the class of this name in boundary_problem.py, which imports this file
BoundaryProblem: TypeAlias = Any

# a smaller eigenvalue, relative to the terms that its entries are sums of, is round-off
SINGULAR = 1e-13
REACHED = 1e-6  # the share of its terms by which an end is off, far above round-off of the steps
UNMOVED = 1e-10  # the same for a Gramian in units in which each state is moved by 1


class OtherMotion(NotDecided):
    """A stationary motion is not the one that is asked for; another start may lead to that."""


def unbound(name: str) -> BadInput:
    """Return the error for a cost that does not depend on some control."""
    return BadInput(
        f"{name}: the cost does not bind every control to second order, so a minimum cannot be "
        "told; let it grow with each of them, as f.dot(f) does."
    )


def check_bound(name: str, problem: BoundaryProblem) -> None:
    """Raise `BadInput` if the cost does not bound all controls of a step."""
    for reduced, terms in _curvatures(problem):
        size = np.sqrt(np.diagonal(terms, axis1=1, axis2=2))
        if not size.all():
            raise unbound(name)
        values = np.linalg.eigvalsh(reduced / size[:, :, None] / size[:, None, :])
        if (abs(values) <= SINGULAR).any():
            raise unbound(name)


def _curvatures(problem: BoundaryProblem) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return [(second derivatives of ℒ by the controls of each step, sums of absolute terms)].

    They are taken along the steps' equations, δw = −E_w⁻¹E_f δf. The list is empty if numbers are
    not finite.
    """
    H, at = problem.hessian, problem.stages.slices
    if H is None or not np.isfinite(H).all():
        return []
    w, f, kappa = at["w"], at["f"], at["kappa"]
    try:
        follows = -np.linalg.solve(H[:, kappa][:, :, w], H[:, kappa][:, :, f])
    except np.linalg.LinAlgError:
        return []
    one, both = np.eye(f.stop - f.start), np.r_[w, f]
    N = np.concatenate([follows, np.broadcast_to(one, (len(H), *one.shape))], axis=1)
    H, across = H[:, both][:, :, both], N.transpose(0, 2, 1)
    return [(across @ H @ N, abs(across) @ abs(H) @ abs(N))]


def check_steered(
    name: str, problem: BoundaryProblem, y: tuple[np.ndarray, ...], found: bool = True
) -> None:
    """Raise `BadInput` if the inputs do not move the end in all of its directions.

    This uses the Gramian of the linear equations alone, not the cost. A direction is missed if no
    step moves it, whatever weights the steps have; the weights keep growing motions from hiding the
    effect of the last steps. That the end cannot be reached is only said of steps that are affine,
    where the motion without a control is off it in such a direction. found: False if y is no
    motion; then a direction that is missed to first order there says nothing.
    """
    g, H = problem.derivatives(y)
    d, at, (z, _, _) = problem.d, problem.stages.slices, y
    if not np.isfinite(H).all():
        return
    rows = H[:, at["kappa"]], H[:, at["p"]]
    (E_z, E_w, E_f), (Z_z, Z_w, Z_f) = (
        (r[:, :, :d], r[:, :, at["w"]], r[:, :, at["f"]]) for r in rows
    )
    missed_rows = g[:, at["kappa"], None]
    solved = np.linalg.pinv(E_w) @ np.concatenate([E_z, E_f, missed_rows], axis=2)
    A, B = Z_z - Z_w @ solved[:, :, :d], Z_f - Z_w @ solved[:, :, d:-1]
    off = g[:, at["p"]] - z - (Z_w @ solved[:, :, -1:])[:, :, 0]
    letters, basis = _ends(problem)
    if (count := B.shape[0] * B.shape[2]) < basis.shape[1]:
        raise BadInput(
            f"{name}: the end has {basis.shape[1]} conditions, but these steps have {count} values "
            "of the controls; take more steps."
        )
    moved, onward = np.zeros((basis.shape[1],) * 2), basis
    for k in reversed(range(len(B))):
        seen = B[k].T @ onward
        moved += seen.T @ seen
        onward = A[k].T @ onward
        onward = onward / max(1, np.abs(onward).max(initial=0))
    size = np.sqrt(np.abs(np.diag(moved)))
    size[size <= UNMOVED * size.max(initial=0)] = np.inf  # then its row is 0
    values, vectors = np.linalg.eigh(moved / np.outer(size, size))
    vectors = basis @ (vectors / np.where(np.isinf(size), 1, size)[:, None])[:, values <= UNMOVED]
    if not vectors.size:
        return
    at_end = np.zeros(d)  # where the steps lead with the controls of y, less its own end
    for k in range(len(A)):
        at_end = A[k] @ at_end + off[k]
    gap = np.abs(vectors.T @ (problem.z1 - z[-1] - at_end))
    terms = np.abs(vectors.T) @ (np.abs(problem.z1) + np.abs(z[-1]) + np.abs(at_end))
    shares = np.divide(gap, terms, out=np.zeros_like(gap), where=terms > 0)
    worst = int(np.argmax(shares))
    missed = letters[int(np.argmax(np.abs(vectors[:, worst])))]
    if problem.stages.affine and shares[worst] > REACHED:
        raise BadInput(
            f"{name}: the end cannot be reached: the inputs do not steer {missed} there "
            "independently of the other conditions, and the motion leads elsewhere."
        )
    if found or problem.stages.affine:
        raise OtherMotion(
            f"{name}: along the motion that was tried the inputs do not steer {missed} at the end "
            "independently of the other conditions, to first order, so its costate is not "
            "determined; leave a condition out (None), or give a path= that is steered."
        )


def check_minimum(name: str, problem: BoundaryProblem) -> None:
    """Raise `NotDecided` if the stationary motion is not a minimum."""
    (A, G, Q), (_, basis), steps = problem.steps, _ends(problem), problem.N
    inner = problem.hessian[:, problem.v][:, :, problem.v]
    W = _gramians(A, G, Q)
    one = np.broadcast_to(np.eye(problem.d), Q[1:].shape)
    parts = inner, np.block([[-W[:-1], -one], [-one, Q[1:]]]), -basis.T @ W[-1] @ basis
    equations = steps * problem.equations + (steps - 1) * problem.d + basis.shape[1]
    finite = all(np.isfinite(part).all() for part in parts)
    if not finite or sum(np.sum(np.linalg.eigvalsh(e) < 0) for e in parts) != equations:
        for reduced, _ in _curvatures(problem):
            values = np.linalg.eigvalsh(reduced)
            least = abs(values).min(axis=1)
            if (least <= SINGULAR * abs(reduced).max()).any():
                raise NotDecided(
                    f"{name}: the second derivative of the cost by its controls vanishes in step "
                    f"{int(least.argmin())} of the motion that was found, so a minimum cannot be "
                    "told; take one step more or fewer, or add a small multiple of f.dot(f)."
                )
            if values.min() < 0:
                step = int(values.min(axis=1).argmin())
                raise OtherMotion(
                    f"{name}: the motion that was found is stationary, but no minimum of the cost: "
                    f"its second derivative by the controls of step {step} is negative; take a "
                    "rule without negative weights, which turn the sign of the cost at a point, "
                    "and a cost that grows with its controls."
                )
        raise OtherMotion(
            f"{name}: the motion that was found is stationary, but no minimum of the cost, which "
            "falls along others near it; take a shorter duration, a cost that grows with its "
            "controls, or a path= near another motion."
        )


def _ends(problem: BoundaryProblem) -> tuple[list[str], np.ndarray]:
    """Return names of the states, and an orthonormal basis of the end's conditions, (n+m, r)."""
    n = problem.stages.n
    names = [f"x[{i}]" for i in range(n)] + [f"mu[{i}]" for i in range(problem.d - n)]
    values, vectors = np.linalg.eigh(problem.fixed)
    return names, vectors[:, values > 0.5]


def _gramians(A: np.ndarray, G: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """Return W_1 … W_N."""
    W = -G.copy()
    one = np.eye(G.shape[1])
    for k in range(1, len(A)):
        moved = A[k] @ np.linalg.solve(one + W[k - 1] @ Q[k], W[k - 1]) @ A[k].T
        W[k] += (moved + moved.T) / 2
    return W
