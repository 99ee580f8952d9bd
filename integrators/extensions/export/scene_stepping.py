"""How an exported scene steps, round the drivers of the bench: text of the compiler's language.

Nothing here is called directly (`specialised`). `drive(s, steps)` is the driver of the bench, which
does steps, writes how many into s.done and returns a status. s is the state of the file, whose
single numbers are read and written as s.h[0].
"""

# ruff: noqa: F821 (the names of kernels and constants are supplied)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def start(s):
    """Begin at the x, mu and parameters that are in the state."""
    for i in range(LOST):
        s.lost[i] = 0.0
    save(s.q, FIRST, OF_RULE)
    s.h[0] = 0.0
    s.fresh[0] = 1
    if STAGED:
        s.by_newton[0] = 0
        s.stretch[0] = 64


def begin_steps(s, h):
    """Compute what depends on the step and the parameters alone; sizes seen before do not count."""
    for j in range(SUBSTEPS):
        q = (h * SHARES[j],) + load(s.q, slice(1, WIDE))
        if not MIXED or KINDS[j] == 0:
            save(s.c[j], 0, RULE.prepare(q))
        else:
            save(s.c[j], 0, ADJOINT.prepare(q))
    s.q[0] = h
    if RULE.branched:
        s.branch[0] = HUGE
    if STAGED:
        prepare_stages(s)
        forget_stages(s)
    carry_on(s)
    if LAYOUT.iterated:
        if s.fresh[0] == 1:
            save(s.memory, 0, first_guess(s))
        seed(s)
    s.h[0] = h
    s.fresh[0] = 0


def carry_on(s):
    """Compute the functions of x that the coming step needs again."""
    if LAYOUT.reused > 0:
        c = load(s.c[0], slice(0, FIRST_RULE.width))
        save(s.k, 0, FIRST_RULE.carry(load(s.x, slice(0, LAYOUT.n)), c))


def seed(s):
    """Let Newton's method start from the first substep's last solution, for all substeps."""
    size = 0.0
    for i in range(SOLVED):
        size = size + abs(s.memory[i])
    for j in range(SUBSTEPS):
        at = j * LAYOUT.row
        for i in range(SOLVED):
            for k in range(PAST):
                s.memory[at + k * LAYOUT.solved + i] = s.memory[i]
        save(s.memory, at + PAST * LAYOUT.solved, (0.0, 0.0, HUGE, size))


def steps_done(s, h, steps):
    """Do steps: return 0, or a status, and leave x and mu as they were before a failed one."""
    if h != s.h[0]:
        begin_steps(s, h)
    if STAGED:
        status = by_turns(s, steps)
    else:
        status = drive(s, steps)
    if status != OK:
        undo(s)
    return status


def undo(s):
    """Let the next step be prepared anew."""
    s.h[0] = 0.0


def by_turns(s, steps):
    """Do steps by the fixed point of their stages.

    Where it does not contract, Newton's method takes over for a while, each time twice as long.
    """
    done, status = 0, OK
    while done < steps and status == OK:
        if s.by_newton[0] == 0:
            status = drive_stages(s, steps - done)
            done = done + s.done[0]
            if status != OK:
                status = OK
                s.by_newton[0] = s.stretch[0]
                s.stretch[0] = 2 * s.stretch[0]
                carry_on(s)
                if s.stages[0] == 0:
                    save(s.memory, 0, first_guess(s))
                else:
                    u = load(s.stages, slice(1, 1 + LAYOUT.m))
                    save(s.memory, 0, u + (0.0,) * (LAYOUT.solved - LAYOUT.m))
                seed(s)
        else:
            left = s.by_newton[0]
            status = drive(s, left if left < steps - done else steps - done)
            done = done + s.done[0]
            s.by_newton[0] = left - s.done[0]
            if s.by_newton[0] == 0:
                forget_stages(s)
    s.done[0] = done
    return status


def forget_stages(s):
    """Let the stages of the next step begin anew."""
    for i in range(1 + 2 * LAYOUT.m):
        s.stages[i] = 0.0


def speed(x, mu, q):
    """Return the velocity with mu = dl/dxi."""
    if CLOSED:
        return SPEED.solver(x, mu, mu, q)
    c = SPEED.prepare(q)
    if SPEED.affine:
        return SPEED.solver(x, mu, (), c)
    site = Record(
        correct=correct_site, again=start_again, still=moves_always, system=SPEED, x=x, mu=mu,
        k=(), c=c, own=(), last=V0,
    )  # fmt: skip
    return newton(site, V0, HUGE, 0.0, 0)[0]


def here(s):
    """Return x, mu and q."""
    return load(s.x, slice(0, LAYOUT.n)), load(s.mu, slice(0, LAYOUT.m)), load(s.q, slice(0, WIDE))


def energy(s):
    """Return the energy of a state."""
    x, mu, q = here(s)
    return energy_at(x, mu if CLOSED else speed(x, mu, q), mu, q)[0]


def momenta(s, values):
    """Write the quantities that the scene declares, in the order of MOMENTA."""
    x, mu, q = here(s)
    save(values, 0, momenta_at(x, mu, mu, q))


def multipliers(s, values):
    """Write the multipliers of the constraints at the start of the last step."""
    for i in range(MULTIPLIERS):
        values[i] = 2 / (s.h[0] * SHARES[0]) * s.memory[LAYOUT.m + i]
