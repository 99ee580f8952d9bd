"""How an exported file makes a step of collocation: by sweeps of a fixed point over its stages.

Text like that of `stepping`, of which it is a part: the iteration of `compiler.sweeps` and its rule
of termination, in arrays. An array at the nodes has LANES entries for each component; beyond the
last node its values repeat, with the weight 0, so that a compiler may work on several at once.
Where the sweeps do not contract, Newton's method takes over for a while, each time twice as long.
"""

# ruff: noqa: F821 (the names of kernels and constants are supplied by the file)
# mypy: disable-error-code="name-defined,no-any-return"

from __future__ import annotations

from ...numbers import over
from .stepping import Out, State, Vector


def staged(s: State) -> bool:
    """Do a step by the fixed point of its stages; False if Newton's method is to do it."""
    if s.by_newton > 0:
        s.by_newton = s.by_newton - 1
        return False
    if collocate(s) == OK and inside(s):
        update_of_stages(s.dx, s.dmu, s.x, s.end, s.last, s.sum_p, s.sum_f, s.ex, s.emu, s.stage_c)
        accumulate(N, s.x, s.ex, s.dx)
        accumulate(M, s.mu, s.emu, s.dmu)
        s.known = 1
        return True
    s.known = 0
    s.by_newton = s.stretch - 1
    s.stretch = 2 * s.stretch
    for i in range(M):
        s.ahead[i] = 0.0
    s.fresh = 1
    seed(s)
    s.fresh = 0
    return False


def inside(s: State) -> bool:
    """Tell whether a step stays inside its chart."""
    if WATCHED:
        extents_of_stages(s.sizes, s.rests, s.x, s.end, s.stage_c)
        return farthest(s) <= REACH
    return True


def collocate(s: State) -> int:
    """Solve the stages of a step by sweeps, until the next one would change round-off alone."""
    before: float = LARGE
    best: float = LARGE
    stale: int = 0
    count: int = 0
    uneven: bool = False
    going: bool = True
    status: int = NOT_CONVERGED
    guess(s)
    for i in range(2 * M):
        s.left[i] = LARGE
    while going:
        sweep(s, count)
        if count < 2:
            uneven = scaled(s)
            if SHIFTED:
                s.gate = size_of(s.ahead) * least_unit(s) / 8 if s.known == 1 else 0.015625
        change: float = 0.0
        for i in range(2 * M):
            if not s.moved[i] * s.units[i] <= change:
                change = s.moved[i] * s.units[i]
        pending: bool = uneven and any_shrinks(s)
        count = count + 1
        rate: float = change / before if before < LARGE else 1.0
        stale = 0 if change < best else stale + 1
        best = change if change < best else best
        at_end: bool = stale > 0 and change < 64 * EPS
        done: bool = over(change, before, EPS / 4, change * rate, at_end) and not pending
        done = done and count > 1
        before = change
        if stale > 2 or count >= MOST_SWEEPS or not change < LARGE:
            done = stale > 2 and change < ROOT_EPS / 16
            going = False
        status = OK if done else NOT_CONVERGED
        going = going and not done
        if (done or (SHIFTED and change < s.gate)) and corrected(s, done, change):
            before = LARGE
            best = LARGE
            stale = 0
            going = count < MOST_SWEEPS
            status = NOT_CONVERGED
    if status == OK and not size_of(s.end) + size_of(s.last) < LARGE:
        status = SINGULAR
    return status


def guess(s: State) -> None:
    """Extrapolate velocities and momenta of the last step to the nodes of this one."""
    if s.known == 0:
        for i in range(M * LANES):
            s.node_w[i] = 0.0
            s.node_xi[i] = 0.0
            s.node_p[i] = s.mu[i // LANES]
        return
    at_nodes(s.turned, OF_VELOCITY, s.node_xi)
    for i in range(M * LANES):
        s.node_xi[i] = s.turned[i]
    at_nodes(s.node_p, OF_MOMENTUM, s.node_mu)
    for i in range(M * LANES):
        s.node_p[i] = s.node_p[i] + LAST_OF_MOMENTUM[i % LANES] * s.mu[i // LANES]
    weigh(s.turned, s.stage_c[0])
    at_nodes(s.node_w, MU, s.turned)
    if ROTATING:
        for _ in range(INNER):
            moved_of_stages(s.turned, s.x, s.node_w, s.node_xi, s.stage_c)
            weigh(s.turned, s.stage_c[0])
            at_nodes(s.node_w, MU, s.turned)
        pulled_of_stages(s.turned, s.x, s.node_w, s.node_p, s.stage_c)
        for i in range(M * LANES):
            s.node_p[i] = s.turned[i]


def at_nodes(out: Out, table: Vector, values: Vector) -> None:
    """Write the sums of values at the nodes, each times its entry of a table."""
    for i in range(M):
        for j in range(LANES):
            out[i * LANES + j] = table[j] * values[i * LANES]
        for k in range(1, STAGES):
            for j in range(LANES):
                out[i * LANES + j] = out[i * LANES + j] + (
                    table[k * LANES + j] * values[i * LANES + k]
                )


def weigh(values: Out, h: float) -> None:
    """Multiply values at the nodes by h times the weight of each."""
    for i in range(M):
        for j in range(LANES):
            values[i * LANES + j] = h * WEIGHTS[j] * values[i * LANES + j]


def sweep(s: State, count: int) -> None:
    """Compute momenta from the forces at the nodes, then places from the new momenta."""
    force_of_stages(s.gains, s.turns, s.x, s.node_w, s.node_p, s.node_xi, s.stage_c)
    weigh(s.gains, s.stage_c[0])
    at_nodes(s.turned, MU_OF_MOMENTUM, s.gains)
    for i in range(M):
        begin: float = s.ahead[i] + s.mu[i]
        for j in range(LANES):
            s.turned[i * LANES + j] = s.turned[i * LANES + j] + begin
    put(s, s.node_p, M, count)
    velocity_of_stages(s.moves, s.node_xi, s.node_mu, s.x, s.node_w, s.node_p, s.stage_c)
    weigh(s.moves, s.stage_c[0])
    at_nodes(s.turned, MU, s.moves)
    put(s, s.node_w, 0, count)


def put(s: State, values: Out, first: int, count: int) -> None:
    """Put new values in place of the old; note how far each component moves, and its size."""
    for i in range(M):
        far: float = 0.0
        size: float = 0.0
        for j in range(LANES):
            apart: float = abs(values[i * LANES + j] - s.turned[i * LANES + j])
            far = far if apart <= far else apart
            apart = abs(s.turned[i * LANES + j])
            size = size if apart <= size else apart
            values[i * LANES + j] = s.turned[i * LANES + j]
        s.moved[first + i] = far
        if count < 2:
            s.large[first + i] = size


def scaled(s: State) -> bool:
    """Write one over each component's size; tell whether these hide the digits of a small one."""
    uneven: bool = False
    for part in range(2):
        most: float = 0.0
        for i in range(M):
            most = s.large[part * M + i] if s.large[part * M + i] > most else most
        floor: float = most / 1024 + 1 / LARGE
        for i in range(M):
            size: float = s.large[part * M + i]
            s.units[part * M + i] = 1 / (size if size > floor else floor)
            uneven = uneven or (size > 0 and 1024 * size < most)
    return uneven


def least_unit(s: State) -> float:
    """Return the least unit of a momentum."""
    least: float = LARGE
    for i in range(M):
        least = s.units[M + i] if s.units[M + i] < least else least
    return least


def any_shrinks(s: State) -> bool:
    """Tell whether a component's change shrinks, and is above its own round-off."""
    pending: bool = False
    for i in range(2 * M):
        far: float = s.moved[i]
        if 2 * far < s.left[i] and far * far > EPS / 4 * s.large[i] * s.left[i]:
            pending = True
        s.left[i] = far if far < s.left[i] else s.left[i]
    return pending


def ends(s: State) -> float:
    """Sum over the nodes to the end of a step; return the error of the momenta at its start."""
    for i in range(M):
        s.end[i] = 0.0
        s.sum_p[i] = 0.0
        for j in range(STAGES):
            s.end[i] = s.end[i] + s.moves[i * LANES + j]
            s.sum_p[i] = s.sum_p[i] + s.gains[i * LANES + j]
        s.last[i] = s.sum_p[i] + s.ahead[i] + s.mu[i]
    for i in range(TURNING):
        s.sum_f[i] = 0.0
        for j in range(STAGES):
            s.sum_f[i] = s.sum_f[i] + s.stage_c[0] * WEIGHTS[j] * s.turns[i * LANES + j]
    if SHIFTED:
        shift_of_stages(s.more, s.x, s.end, s.last, s.sum_p, s.sum_f, s.ahead, s.stage_c)
        for i in range(M):
            s.last[i] = s.last[i] + s.more[i]
        return size_of(s.more)
    return 0.0


def corrected(s: State, done: bool, change: float) -> bool:
    """Sum up a step; tell whether the momenta at its start were off by more than its stages."""
    if SHIFTED:
        off: float = ends(s) * least_unit(s)
        if (done or 2 * change < off) and off > 8 * EPS:
            shift_on(s)
            s.gate = off / 16
            return True
    else:
        ends(s)
    return False


def shift_on(s: State) -> None:
    """Correct the momenta at the start of a step, and those at its nodes with them."""
    for i in range(M):
        s.ahead[i] = s.ahead[i] + s.more[i]
        for j in range(LANES):
            s.node_p[i * LANES + j] = s.node_p[i * LANES + j] + s.more[i]


def size_of(values: Vector) -> float:
    """Return the sum of absolute values."""
    size: float = 0.0
    for i in range(M):
        size = size + abs(values[i])
    return size
