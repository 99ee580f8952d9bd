"""Verlet that does something else in the steps in which the motion turns, and nowhere else."""

import numpy as np

from discmech import black_box


def verlet(q, p, h, system):
    p = p - h / 2 * system.gradient(q, p)
    q = q + h * system.velocity(q, p)
    return q, p - h / 2 * system.gradient(q, p)


@black_box(order=2)
def stops(q, p, h, system):
    before = p
    q, p = verlet(q, p, h, system)
    return q, np.where(before * p < 0, 0.0, p)


@black_box(order=2)
def slower(q, p, h, system):
    before = p
    q, p = verlet(q, p, h, system)
    return q, np.where(before * p < 0, 0.99 * p, p)
