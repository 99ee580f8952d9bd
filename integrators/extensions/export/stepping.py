"""How an exported file steps, a scene or a lattice; text like that of `scene_stepping`.

`steps_done(s, h, steps)` does steps, writes how many into s.done and returns a status.
"""

# ruff: noqa: F821 (the names of kernels and constants are supplied)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def one_step(s, h):
    """Do one step of size h: return 0, or a status and leave x and mu as they were."""
    return steps_done(s, h, 1)


def rows_of_run(s, h, steps, every, xs, mus):
    """Do steps and write a row at the start and after each `every` of them; return those done."""
    row, done, going = 0, 0, every > 0  # no rows every 0 steps, and no end of them
    while going:
        for i in range(N):
            xs[row * N + i] = s.x[i]
        for i in range(M):
            mus[row * M + i] = s.mu[i]
        row = row + 1
        some = every if done + every <= steps else steps - done
        going = some == every
        if some > 0:
            going = steps_done(s, h, some) == OK and going
            done = done + s.done[0]
    return done
