"""The trajectory driver of compositions: one text for compiled and high-precision runs.

As in `driver` these functions are text for `composed_kernels`. A step is
a row of substeps, each with its own coefficients (its own step size) and its own memory of past
solutions, from which Newton starts; x, μ, their compensations and the carried functions go on from
one substep to the next. `substep` is there once for the rule and, where it occurs, once for its
adjoint (`substep_of_adjoint`).
"""

# ruff: noqa: F821
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"

from .driver import OK


def advance(
    state, memory, coefficients, kinds, index, stop, last, every, xs, us, mus, counts, totals
):
    """As `driver.advance`; memory and coefficients have one row each substep, kinds 1 for Φ*.

    A row's u is that of the first substep, its count the corrections of all of them.
    """
    x, mu, ex, emu, k, k_of_adjoint = load_whole(state)
    guard = load_guard(totals)
    status, most, total, size = OK, totals[1], totals[0], totals[2]
    row = (index + every - 1) // every
    wait = row * every - index
    end = stop + 1 if stop == last else stop
    substeps = len(kinds)
    while index < end:
        start_x, start_mu, start_ex, start_emu = x, mu, ex, emu
        count_of_step = 0
        for j in range(substeps):
            same = kinds[j] == kinds[j - 1]
            if kinds[j] == 0:
                x, mu, ex, emu, k, w, guard, count, size, status = substep(
                    x, mu, ex, emu, k, same, memory, guard, coefficients, j
                )
            else:
                x, mu, ex, emu, k_of_adjoint, w, guard, count, size, status = substep_of_adjoint(
                    x, mu, ex, emu, k_of_adjoint, same, memory, guard, coefficients, j
                )
            count_of_step += count
            if status != OK:
                break
            if j == 0 and wait == 0:
                save_x(xs, row, start_x)
                save_u(us, row, w)
                save_u(mus, row, start_mu)
            if index == last:
                break
        total += count_of_step
        if count_of_step > most:
            most = count_of_step
        if status == OK and wait == 0:
            counts[row] = count_of_step
            row += 1
            wait = every
        if status != OK or index == last:
            x, mu, ex, emu = start_x, start_mu, start_ex, start_emu
            break
        wait -= 1
        index += 1
    save_whole(state, x, mu, ex, emu, k, k_of_adjoint)
    totals[0], totals[1], totals[2] = total, most, size
    save_guard(totals, guard)
    return index, status


def substep(x, mu, ex, emu, k, same, memory, guard, coefficients, j):
    """One step of one kind; k is computed anew where the step before was of the other."""
    c = load_row_c(coefficients, j)
    if not same:
        k = carry(x, c)
    w, memo, count, size, status = solve(x, mu, k, load_memo(memory, j), c)
    if status == OK:
        guard, status, near = watch(x, w, guard, c)
        if near:
            memo = forget(memo)
    if status == OK:
        save_memo(memory, j, memo)
        dx, dmu, k = update(x, w, mu, k, ex, emu, c)
        x, ex = accumulate_x(x, dx)
        mu, emu = accumulate_u(mu, dmu)
    return x, mu, ex, emu, k, w, guard, count, size, status
