"""How an exported lattice steps: text like `stepping`, round `drive`, the lattice's own driver.

`drive(s, task, steps)` is `lattice_driver.advance` for this lattice (`exported_lattice`): it works
on x and nu, writes mu when it is asked to, and solves the coming step at the end of each.
"""

# ruff: noqa: F821 (the names of kernels and constants are supplied by the file)
# mypy: disable-error-code="name-defined,no-any-return"

from __future__ import annotations

from .stepping import Out, State


def begin_steps(s: State, h: float) -> int:
    """Compute what depends on the step and the parameters, and solve the first step."""
    status: int = OK
    s.q[0] = h
    if TIMED:
        s.t0 = s.x[N - 1]
    prepare_sites(s)
    for i in range(ENTRIES):
        s.totals[i] = 0.0
    s.totals[KAPPA] = LARGE
    for i in range(SITES):
        for j in range(SOLVED):
            s.w[i * SOLVED + j] = V0[i * MOVING + j] if j < MOVING else 0.0
            s.w1[i * SOLVED + j] = s.w[i * SOLVED + j]
            s.w2[i * SOLVED + j] = s.w[i * SOLVED + j]
            s.w3[i * SOLVED + j] = s.w[i * SOLVED + j]
    status = drive(s, BEGIN, 0)
    if LISTED and status == OK:
        status = drive(s, RUN, 0)
    s.h = h
    return status


def steps_done(s: State, h: float, steps: int) -> int:
    """Do steps: return 0, or a status and leave x and mu as they were."""
    status: int = OK
    for i in range(N):
        s.kept[i] = s.x[i]
    for i in range(M):
        s.kept[N + i] = s.mu[i]
    if h != s.h:
        status = begin_steps(s, h)
    if status == OK:
        status = drive(s, RUN, steps)
    if TIMED:
        s.x[N - 1] = s.t0 + s.totals[STEPS] * h
    if status == OK:
        status = drive(s, SHOW, 0)
    for i in range(HELD):
        for j in range(MOVING):
            s.mu[FIXED[i] * MOVING + j] = 0.0
    if status == OK and not finite(s):
        status = SINGULAR
    if status != OK:
        undo(s)
    return status


def finite(s: State) -> bool:
    """Tell whether all numbers are finite."""
    size: float = 0.0
    for i in range(N):
        size = size + 0 * s.x[i]
    for i in range(M):
        size = size + 0 * s.mu[i]
    return size == 0


def undo(s: State) -> None:
    """Return to the x and mu of before; the next step is prepared anew."""
    for i in range(N):
        s.x[i] = s.kept[i]
    for i in range(M):
        s.mu[i] = s.kept[N + i]
    s.h = 0.0


def advance(s: State, h: float) -> int:
    """Do one step of size h: return 0, or a status and leave x and mu as they were."""
    return steps_done(s, h, 1)


def rows_of_run(s: State, h: float, steps: int, every: int, xs: Out, mus: Out) -> int:
    """Do steps and write a row at the start and after each `every` of them; return those done."""
    row: int = 0
    done: int = 0
    while done <= steps:
        for i in range(N):
            xs[row * N + i] = s.x[i]
        for i in range(M):
            mus[row * M + i] = s.mu[i]
        row = row + 1
        if done + every > steps:
            break
        if steps_done(s, h, every) != OK:
            return done
        done = done + every
    if done < steps:
        return steps if steps_done(s, h, steps - done) == OK else done
    return steps


def start(s: State) -> None:
    """Begin at the x, mu and parameters that are in the state."""
    own_rows(s)
    s.h = 0.0
