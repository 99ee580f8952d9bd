"""Maps as a beginner gets them wrong, and two that are right, each as a formula and as a program.

A form takes the vector field f, the state z and the step h, symbols or numbers.
"""

import numpy as np

from discmech import black_box, one_step

BROKEN = {
    "doubled": lambda f, z, h: 2 * z,
    "turned-over": lambda f, z, h: -2 * z,
    "half-too-much": lambda f, z, h: z * 3 / 2,
    "factor-of-z": lambda f, z, h: 7 * z / 5 + h * f(z),
    "z-twice": lambda f, z, h: z + z / 2 + h * f(z),
    "forgot-h": lambda f, z, h: z + f(z),
    "forgot-h-and-sign": lambda f, z, h: z - f(z),
    "forgot-z": lambda f, z, h: h * f(z),
    "field-alone": lambda f, z, h: f(z),
    "divided-by-h": lambda f, z, h: z + f(z) / h,
    "backwards": lambda f, z, h: z - h * f(z),
    "half-a-step": lambda f, z, h: z + h / 2 * f(z),
    "h-squared": lambda f, z, h: z + h * h * f(z),
    "stands-still": lambda f, z, h: z,
    "nothing-left": lambda f, z, h: 0 * z,
}
SOUND = {
    "explicit-euler": (1, lambda f, z, h: z + h * f(z)),
    "explicit-midpoint": (2, lambda f, z, h: z + h * f(z + h / 2 * f(z))),
}


def formula(name, form, order=1):
    return one_step(order=order, name=name)(lambda s, z, h: form(s.f, z, h))


def program(name, form, order=1):
    def step(q, p, h, system):
        def field(z):
            return np.concatenate(system.f(z[: len(q)], z[len(q) :]))

        z = form(field, np.concatenate([q, p]), h)
        return z[: len(q)], z[len(q) :]

    return black_box(order=order, name=name)(step)


FORMS = {"formula": formula, "program": program}
