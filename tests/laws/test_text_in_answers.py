"""A number that a user's function gives as text is that number, for rules and references alike."""

from dataclasses import fields

import numpy as np
import pytest
import sympy

from discmech import Conserved, Control, Lattice, Scene, midpoint, pair
from discmech.integrators.equations import SceneSymbols
from discmech.integrators.equations.constraints import (
    constraint,
    constraint_matrix,
    constraint_shift,
)
from discmech.integrators.errors import BadInput
from discmech.integrators.extensions.contact.gaps import gap_expressions
from discmech.integrators.extensions.lattices.as_scene import scene_of
from discmech.integrators.extensions.steps.poincare import in_own_time
from discmech.integrators.scene import ConstraintKind, velocity_rows
from discmech.reference.equations.euler_lagrange import mechanics_of
from discmech.reference.equations.fingerprint import fingerprint

OWN_KIND = ConstraintKind("own", velocity_rows)


def flat(**more):
    ends = {"duration": 2, "x0": [1, 0], "v0": [0, 1]}
    return Scene("s", pair(2), **{"lagrangian": lambda x, v, p: v.dot(v) / 2, **ends, **more})


def phase(**more):
    return Scene("s", pair(2), x0=[1, 0], **more)


#: field → a scene in which its function gives a number c
SCENES = {
    "lagrangian": lambda c: flat(lagrangian=lambda x, v, p: c),
    "force": lambda c: flat(force=lambda x, v, p: [c, x[0]]),
    "nonholonomic": lambda c: flat(nonholonomic=lambda x, p: ([[x[0], c]], [c])),
    "constraints": lambda c: flat(constraints=[OWN_KIND(lambda x, p: np.array([[c, x[1]]]))]),
    "contact": lambda c: flat(contact=lambda x, p: [(x[1] + 1, [c])]),
    "fast": lambda c: flat(fast=lambda x, p: c),
    "hamiltonian": lambda c: phase(mu0=[0, 1], hamiltonian=lambda x, mu, p: c),
    "one_form": lambda c: phase(one_form=lambda x, p: [c, x[0]], hamiltonian=lambda x, p: c),
    "symmetries": lambda c: flat(symmetries=[Conserved("J", lambda x, mu, p: [c, mu[0]])]),
    "discrete_lagrangian": lambda c: phase(mu0=[0, 1], discrete_lagrangian=lambda x, u, h, p: c),
    "sigma": lambda c: in_own_time(flat(sigma=lambda x, mu, p: c), lambda x, mu, p: c, 1),
}
CHAIN = {"x0": np.ones((3, 1)), "v0": np.zeros((3, 1))}


def chain(**more):
    energies = {"on_site": lambda x, v, p: v[0] ** 2, "on_bond": lambda x, y, p: x[0] * y[0]}
    return scene_of(Lattice("l", pair(1), 3, **{**CHAIN, **energies, **more}))


LATTICES = {
    "on_site": lambda c: chain(on_site=lambda x, v, p: c),
    "on_bond": lambda c: chain(on_bond=lambda x, y, p: c),
    "force": lambda c: chain(force=lambda x, v, p: [c]),
    "bond_force": lambda c: chain(bond_force=lambda x, y, v, w, p: [c, w[0]]),
}
#: fields that are no function of symbols, and those where a number alone is refused
FREE = {"name", "groupoid", "parameters", "x0", "v0", "mu0", "duration", "step", "source", "title",
        "friction", "restitution", "impacts", "numeric_hamiltonian", "gradient", "holonomic",
        "site", "sites", "bonds", "fixed_ends", "fixed", "constraint", "bond_contact"}  # fmt: skip


def by_rules(scene):
    """What a rule reads of each function, as text."""
    s = SceneSymbols(scene)
    read = [s.lagrangian] if scene.has_lagrangian else []
    read += [s.force] if scene.force else []
    read += [s.one_form, s.hamiltonian] if scene.one_form else []
    read += [s.hamiltonian] if scene.hamiltonian else []
    read += [s.fast_at(s.x)] if scene.fast else []
    read += [s.conserved(e) for e in scene.symmetries]
    for part in (constraint, constraint_matrix, constraint_shift):
        read += [part(s, s.x)] if scene.all_constraints else []
    read += [gap_expressions(s, scene.contact)] if scene.contact else []
    if scene.discrete_lagrangian:
        read.append(s.discrete_lagrangian_at(s.x, s.u, s.h))
    return str(read)


def test_every_function_of_a_scene_and_a_lattice_is_here():
    assert {f.name for kind in (Scene, Lattice) for f in fields(kind)} == FREE | {
        *SCENES, *LATTICES}  # fmt: skip


@pytest.mark.parametrize("name, made", [*SCENES.items(), *LATTICES.items()])
def test_text_is_the_exact_number(name, made):
    text, number = made("0.3"), made(sympy.Rational(3, 10))
    assert by_rules(text) == by_rules(number)
    if text.is_continuous:
        assert fingerprint(mechanics_of(text)) == fingerprint(mechanics_of(number))


def test_a_formula_in_text_is_refused_by_references_too():
    with pytest.raises(BadInput, match="formula is written without quotes"):
        mechanics_of(SCENES["force"]("x[0]"))


def test_controls_take_text_too():
    def optimum(c):
        pushed = flat(force=lambda x, v, p: [c, 0], step="1/4")
        problem = Control(pushed, lambda x, v, f, p: f.dot(f) / 2, ([0, 0], [0, 0]),
                          inputs=lambda x, v, f, p: [f[0], f[1]], controls=2)  # fmt: skip
        return problem.solve(4, midpoint).cost

    assert optimum("0.3") == optimum(sympy.Rational(3, 10))
