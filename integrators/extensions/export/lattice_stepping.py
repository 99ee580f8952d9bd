"""How an exported lattice steps: text like `scene_stepping`, round the lattice's own driver.

`drive(s, task, steps)` is `lattice_driver.advance` for this lattice (`exported_lattice`): it works
on x and nu, writes mu when it is asked to, and solves the coming step at the end of each.
"""

# ruff: noqa: F821 (the names of kernels and constants are supplied)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def start(s):
    """Begin at the x, mu and parameters that are in the state."""
    own_rows(s)
    s.h[0] = 0.0


def begin_steps(s, h):
    """Compute what depends on the step and the parameters, and solve the first step."""
    s.q[0] = h
    if TIMED:
        s.t0[0] = s.x[N - 1]
    prepare_sites(s)
    for i in range(ENTRIES):
        s.totals[i] = 0.0
    s.totals[KAPPA] = HUGE
    for i in range(PLACES):
        for j in range(S):
            guess = V0[i * m + j] if j < m else 0.0
            s.w[i, j] = guess
            s.w1[i, j] = guess
            s.w2[i, j] = guess
            s.w3[i, j] = guess
    status = drive(s, BEGIN, 0)
    if LISTED and not LOCAL:
        status = drive(s, RUN, 0) if status == OK else status
    s.h[0] = h
    return status


def steps_done(s, h, steps):
    """Do steps: return 0, or a status and leave x and mu as they were."""
    for i in range(N):
        s.kept[i] = s.x[i]
    for i in range(M):
        s.kept[N + i] = s.mu[i]
    status = OK
    if h != s.h[0]:
        status = begin_steps(s, h)
    if status == OK:
        status = drive(s, RUN, steps)
    if TIMED:
        s.x[N - 1] = s.t0[0] + s.totals[STEPS] * h
    if status == OK:
        status = drive(s, SHOW, 0)
    for i in range(HELD):
        for j in range(m):
            s.mu[FIXED[i] * m + j] = 0.0
    size = 0.0  # not a number if one is none
    for i in range(N):
        size = size + 0 * s.x[i]
    for i in range(M):
        size = size + 0 * s.mu[i]
    if status == OK and size != 0:
        status = SINGULAR
    s.done[0] = steps
    if status != OK:
        undo(s)
        s.done[0] = 0
    return status


def undo(s):
    """Return to the x and mu of before; the next step is prepared anew."""
    for i in range(N):
        s.x[i] = s.kept[i]
    for i in range(M):
        s.mu[i] = s.kept[N + i]
    s.h[0] = 0.0
