"""Whatever a result depends on makes another fingerprint when it changes: field by field."""

from __future__ import annotations

import abc
import enum
import os
import random
import subprocess
import sys
import time
import typing
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import sympy
from numpy import loadtxt

from discmech import (
    Conserved,
    Control,
    Lattice,
    Scene,
    action,
    check,
    discretisation,
    exponential,
    lie_group,
    midpoint,
    one_step,
    pair,
    so,
)
from discmech.integrators.numbers import mpmath
from discmech.integrators.rules import Composition, Discretisation, OneStepMap, compose
from discmech.integrators.rules.quadrature import Nodes
from discmech.integrators.scene import ConstraintKind, Opaque, on_group, reads, velocity_rows
from discmech.studies import get
from discmech.studies.core import fingerprint
from discmech.studies.core.case import Case, scheme_of


def kinetic(x, v, p):
    return v[0] ** 2 / 2 - p.a * x[0] ** 2


def other(*given):
    return given[0][0] ** 2 / 3


J = Conserved("J", lambda x, mu, p: mu[0])
SCENE = Scene("s", pair(1), kinetic, {"a": 1}, [1], [0], duration=2)
TOUCHING = SCENE.with_values(contact=lambda x, p: [x[0] + 9], friction="1/10")
GIVEN = Scene("s", pair(1), x0=[1], v0=[0], mu0=[1],
              discrete_lagrangian=lambda x, u, h, p: h * u[0] ** 2)  # fmt: skip


def energy(q, p):
    return (p @ p + q @ q) / 2


NUMERIC = Scene("s", pair(1), x0=[1], mu0=[0], numeric_hamiltonian=energy,
                gradient=lambda q, p: (q, p))  # fmt: skip
PLANE = Scene(
    "s", pair(2), x0=[1, 0], one_form=lambda x, p: [x[1], 0],
    hamiltonian=lambda x, p: x[0] ** 2 + x[1] ** 2,
)  # fmt: skip
BY_H = Scene("s", pair(1), x0=[1], mu0=[0], hamiltonian=lambda x, mu, p: mu[0] ** 2 + x[0] ** 2)
OWN_KIND = ConstraintKind("held", velocity_rows)
#: by field: a kind of constraint with the change
OF_A_KIND = {
    "name": replace(OWN_KIND, name="tied"), "no_form": replace(OWN_KIND, no_form="none"),
    "no_energy": replace(OWN_KIND, no_energy="none"),
    "parts": replace(OWN_KIND, parts=lambda given, m: velocity_rows([given[0]], m)),
}  # fmt: skip
#: by field: a scene without and with the change
SCENES = {
    "name": (SCENE, SCENE.with_values(name="t")),
    "groupoid": (Scene("s", lie_group(so(3)), other, v0=[1, 1, 1]),
                 Scene("s", lie_group(so(3), exponential), other, v0=[1, 1, 1])),
    "lagrangian": (SCENE, SCENE.with_values(lagrangian=other)),
    "parameters": (SCENE, SCENE.with_values(parameters={"a": 2})),
    "x0": (SCENE, SCENE.with_values(x0=[2])), "v0": (SCENE, SCENE.with_values(v0=[1])),
    "duration": (SCENE, SCENE.with_values(duration=3)),
    "step": (SCENE, SCENE.with_values(step="1/7")),
    "symmetries": (SCENE, SCENE.with_values(symmetries=[J])),
    "source": (SCENE, SCENE.with_values(source="a book")),
    "title": (SCENE, SCENE.with_values(title="a title")),
    "discrete_lagrangian": (GIVEN, replace(GIVEN, discrete_lagrangian=lambda x, u, h, p: u[0])),
    "fast": (SCENE, SCENE.with_values(fast=lambda x, p: x[0] ** 2)),
    "sigma": (SCENE, SCENE.with_values(sigma=lambda x, mu, p: 1 + x[0] ** 2)),
    "force": (SCENE, SCENE.with_values(force=lambda x, v, p: [v[0]])),
    "mu0": (GIVEN, replace(GIVEN, mu0=[2])),
    "holonomic": (SCENE, SCENE.with_values(holonomic=lambda x, p: [x[0] - 1])),
    "nonholonomic": (SCENE, SCENE.with_values(nonholonomic=lambda x, p: [[1]])),
    "constraints": (SCENE, SCENE.with_values(constraints=[OWN_KIND(lambda x, p: [[1]])])),
    "contact": (TOUCHING, TOUCHING.with_values(contact=lambda x, p: [x[0] + 8])),
    "friction": (TOUCHING, TOUCHING.with_values(friction="1/5")),
    "restitution": (TOUCHING, TOUCHING.with_values(restitution="1/2")),
    "impacts": (TOUCHING, TOUCHING.with_values(impacts="located")),
    "hamiltonian": (BY_H, replace(BY_H, hamiltonian=lambda x, mu, p: mu[0] ** 2 + x[0])),
    "one_form": (PLANE, replace(PLANE, one_form=lambda x, p: [x[1] + 1, 0])),
    "numeric_hamiltonian": (NUMERIC, replace(NUMERIC, numeric_hamiltonian=lambda q, p: p @ p)),
    "gradient": (NUMERIC, replace(NUMERIC, gradient=lambda q, p: (2 * q, p))),
}  # fmt: skip
CHAIN = Lattice(
    "l", pair(1), 4, {"a": 1}, kinetic, lambda x, y, p: x[0] * y[0], x0=np.ones((4, 1)),
    v0=np.zeros((4, 1)), contact=lambda x, p: [x[0] + 9],
)  # fmt: skip
WITHOUT = replace(CHAIN, contact=None)
LATTICES = {
    "name": replace(CHAIN, name="m"), "parameters": replace(CHAIN, parameters={"a": 2}),
    "site": Lattice("l", pair(2), 4, {"a": 1}, kinetic, lambda x, y, p: x[0] * y[0],
                    x0=np.ones((4, 2)), v0=np.zeros((4, 2))),
    "sites": replace(CHAIN, sites=3, x0=np.ones((3, 1)), v0=np.zeros((3, 1))),
    "on_site": replace(CHAIN, on_site=other), "on_bond": replace(CHAIN, on_bond=other),
    "bonds": replace(CHAIN, bonds="ring"), "x0": replace(CHAIN, x0=2 * np.ones((4, 1))),
    "v0": replace(CHAIN, v0=np.ones((4, 1))), "duration": replace(CHAIN, duration=3),
    "step": replace(CHAIN, step="1/7"), "fixed_ends": replace(CHAIN, fixed_ends=True),
    "fixed": replace(CHAIN, fixed=[1]),
    "constraint": replace(WITHOUT, constraint=lambda x, y, p: [y[0] - x[0]]),
    "contact": replace(CHAIN, contact=lambda x, p: [x[0] - 1]),
    "bond_contact": replace(CHAIN, bond_contact=lambda x, y, p: [y[0] - x[0] + 9]),
    "force": replace(CHAIN, force=lambda x, v, p: [-v[0]]),
    "bond_force": replace(CHAIN, bond_force=lambda x, y, v, w, p: [w[0] - v[0], v[0] - w[0]]),
    "restitution": replace(CHAIN, restitution="1/2"),
    "symmetries": replace(CHAIN, symmetries={"J": lambda x, p: [1]}),
    "source": replace(CHAIN, source="a book"), "title": replace(CHAIN, title="a title"),
}  # fmt: skip
COST = Control(SCENE, lambda x, v, f, p: f.dot(f), ([1], [0]))
CONTROLS = {
    "scene": SCENE.with_values(x0=[3]), "cost": lambda x, v, f, p: 2 * f.dot(f),
    "end": ([1], [1]), "inputs": lambda x, v, f, p: [2 * f[0]], "controls": 1, "duration": 5,
    "path": lambda t: [t if t < 0.123 else 1],  # between any samples
}  # fmt: skip


@discretisation(order=2)
def rule(L, G, x, u, h):
    return h * L(x, u)


RULES = {
    "name": "other", "formula": lambda L, G, x, u, h: 2 * h * L(x, u), "order": 3,
    "source": "a book", "stages": 1, "splits": True, "groupoids": ("pair",), "effective": 4,
    "nodes": Nodes("gauss", 2), "parameters": ("w",),
}  # fmt: skip
QUANTITIES = {"name": "K", "formula": lambda x, mu, p: 2 * mu[0], "kind": "Casimir",
              "attitude": True, "value": 1, "stretch": 7}  # fmt: skip


def test_every_field_of_a_scene_counts():
    assert {f.name for f in fields(Scene)} == {*SCENES}
    for name, (one, another) in SCENES.items():
        assert [*fingerprint.of_scene(one)] != [*fingerprint.of_scene(another)], name
        assert [*fingerprint.of_scene(one)] == [*fingerprint.of_scene(replace(one))], name


def test_every_field_of_a_kind_of_constraint_counts():
    assert {f.name for f in fields(ConstraintKind)} == {*OF_A_KIND}
    held = [
        SCENE.with_values(constraints=[kind(other)]) for kind in (OWN_KIND, *OF_A_KIND.values())
    ]
    assert len({"".join(fingerprint.of_scene(e)) for e in held}) == 1 + len(OF_A_KIND)


def test_every_field_of_a_lattice_counts():
    assert {f.name for f in fields(Lattice)} == {*LATTICES}
    keys = {name: "".join(fingerprint.of_scene(e)) for name, e in LATTICES.items()}
    assert len({*keys.values(), "".join(fingerprint.of_scene(CHAIN))}) == 1 + len(keys)


def test_every_field_of_a_control_problem_counts():
    assert {f.name for f in fields(Control)} == {*CONTROLS}
    keys = {name: reads(COST.with_values(**{name: e})) for name, e in CONTROLS.items()
            if name != "controls"}  # fmt: skip
    assert len({*keys.values(), reads(COST)}) == 1 + len(keys)
    two = Control(SCENE, COST.cost, COST.end, inputs=CONTROLS["inputs"], controls=2)
    assert reads(two) != keys["inputs"]


@pytest.mark.parametrize("name", RULES)
def test_every_field_of_a_rule_counts(name):
    assert {f.name for f in fields(Discretisation)} - {"claims"} == {*RULES}
    assert reads(rule) != reads(replace(rule, **{name: RULES[name]}))


def test_what_maps_and_compositions_add_counts():
    explicit = one_step(order=1, name="m")(lambda s, z, h: z)
    added = {f.name for f in fields(OneStepMap)} - {f.name for f in fields(Discretisation)}
    assert added == {"implicit", "one_form"}
    for more in ({"implicit": True}, {"one_form": "any"}):
        assert reads(explicit) != reads(replace(explicit, **more))
    assert {f.name for f in fields(Composition)} - {f.name for f in fields(Discretisation)} == {
        "base", "method"}  # fmt: skip
    made = [compose(midpoint, "suzuki"), compose(midpoint, "triple-jump"), compose(rule, "suzuki")]
    assert len(set(map(reads, made))) == 3


def test_every_field_of_a_conserved_quantity_counts():
    assert {f.name for f in fields(Conserved)} == {*QUANTITIES}
    keys = {name: reads(replace(J, **{name: e})) for name, e in QUANTITIES.items()}
    assert len({*keys.values(), reads(J)}) == 1 + len(keys)


HELD, LIST, ARRAY, NESTED = 1, [1], np.ones(2), {"a": [1]}


def reading():
    return HELD, LIST, ARRAY, NESTED, (lambda: HELD)()


def test_what_a_function_reads_counts(monkeypatch):
    before = reads(reading)
    for name, value in (("HELD", 2), ("LIST", [2]), ("ARRAY", np.zeros(2)), ("NESTED", {"a": []})):
        with monkeypatch.context() as patch:
            patch.setitem(globals(), name, value)
            assert reads(reading) != before, name
    assert reads(reading) == before
    LIST.append(2)
    assert reads(reading) != before
    LIST.pop()

    def around(value, default=1):
        return lambda x=default: x + value

    assert len({reads(around(1)), reads(around(2)), reads(around(1, 2))}) == 3
    with open(__file__) as file, pytest.raises(Opaque):
        reads(file)


def test_a_thing_that_was_used_reads_as_before():
    scene = Scene("s", action(so(3)), lambda x, v, p: v.dot(v) / 2, x0=[0, 0, 1], v0=[1, 0, 0])
    before = reads(scene, midpoint)
    scheme_of(scene, midpoint).flow("1/10").trajectory(2)
    assert reads(scene, midpoint) == before
    assert reads(on_group(other)) == reads(on_group(other))


@pytest.mark.slow
def test_another_process_reads_the_same():
    text = ("from discmech import *; from discmech.integrators.scene import reads; "
            "from discmech.integrators.rules import gauss; "
            "print(reads(scenes.get('wong'), scenes.get('heavy-top'), gauss(3)))")  # fmt: skip
    said = {subprocess.run([sys.executable, "-c", text], env={"PYTHONHASHSEED": seed},
                           capture_output=True, text=True, check=True).stdout
            for seed in "12"}  # fmt: skip
    assert len(said) == 1


STRENGTH, WEIGHT = [1], 0.5


def lagrangian(x, v, p):
    return v[0] ** 2 / 2 - STRENGTH[0] * x[0] ** 2 / 2


@discretisation(order=2)
def weighted(L, G, x, u, h):
    c = G.constant(lambda digits: mpmath.mpf(WEIGHT))
    return h * (c * L(x, u) + (1 - c) * L(G.target(x, u, h), u))


@pytest.mark.slow
def test_a_global_that_changes_in_one_process_is_seen(monkeypatch):
    scene = Scene("s", pair(1), lagrangian, x0=[1], v0=[0], duration=4)

    def measured(rule):
        (case,) = check("order", [scene], [rule], digits=[16], steps=16)["cases"]
        key = fingerprint.of_case(get("order"), Case("order", scene, rule, 16), timed=False)
        return case["verdict"], key

    first, key = measured(weighted)
    assert first == "pass"
    monkeypatch.setitem(globals(), "WEIGHT", 1 / 3)
    second, another = measured(weighted)
    assert second == "fail" and another != key  # of order 1
    monkeypatch.setitem(globals(), "WEIGHT", 0.5)
    assert measured(weighted) == ("pass", key)
    STRENGTH[0] = sympy.Integer(2)
    found = scheme_of(scene, midpoint).flow("1/100").trajectory(100)
    assert abs(float(found.x[-1][0]) - np.cos(np.sqrt(2))) < 1e-4
    import discmech

    assert abs(float(discmech.solution(scene, 1, digits=20).x[0]) - np.cos(np.sqrt(2))) < 1e-12
    STRENGTH[0] = 1
    assert abs(float(discmech.solution(scene, 1, digits=20).x[0]) - np.cos(1)) < 1e-12


def test_scales_and_references_in_one_process_see_a_changed_global():
    from discmech.reference import solution, surroundings
    from discmech.studies.energy.balance import acts
    from discmech.studies.systems.moving_energy import moving_energy

    pushed = SCENE.with_values(force=lambda x, v, p: [STRENGTH[0] - 1], v0=[1])
    numeric = replace(NUMERIC, numeric_hamiltonian=lambda q, p: (p @ p + STRENGTH[0] * q @ q) / 2,
                      gradient=lambda q, p: (STRENGTH[0] * q, p))  # fmt: skip
    heavy = SCENE.with_values(lagrangian=lambda x, v, p: STRENGTH[0] * v[0] ** 2 / 2, v0=[1])

    def found():
        ask = (acts(pushed, 2), solution(numeric, 1, 10).x[0], moving_energy(heavy))
        return ask, surroundings(pushed)

    before, motion = found()
    STRENGTH[0] = 4
    after, another = found()
    STRENGTH[0] = 1
    assert not before[0] and after[0] and motion is not another
    assert abs(float(before[1]) - np.cos(1)) < 1e-9 and abs(float(after[1]) - np.cos(2)) < 1e-9
    assert after[2] == pytest.approx(4 * before[2])


def test_the_processor_counts(monkeypatch):
    def key():
        return fingerprint.of_case(get("order"), Case("order", SCENE, midpoint, 16), timed=False)

    before = key()
    monkeypatch.setattr(fingerprint, "processor", lambda: "one that fuses")
    assert key() != before


def test_what_hides_what_it_holds_is_measured_each_time():
    from discmech.studies.core.side_by_side import key_of

    file = open(__file__)  # noqa: SIM115
    scene = SCENE.with_values(lagrangian=lambda x, v, p: v[0] ** 2 / 2 + 0 * (file is None))
    assert key_of(get("order"), Case("order", scene, midpoint, 16)) is None
    file.close()


class Base:
    strength = 1


class Inner:
    strength = 1


class Model(Base):
    matrix = np.eye(2)
    inner = Inner


class Table(dict):
    strength = 1


TABLE = Table()
PACKAGE, PART = ModuleType("a_package"), ModuleType("a_package.part")
PACKAGE.part = PART


def of_a_local_import():
    import a_package.part

    return a_package.part.strength


def of_an_import():
    from os import environ

    return environ["HOME"]


#: functions of which nobody can see whether what they read has changed
HIDING = {
    "import of a user's module in a function": of_a_local_import,
    "eval": lambda: eval("Base.strength"), "a file": lambda: open(__file__),  # noqa: SIM115
    "a path": lambda: Path(__file__).read_text(), "the environment": lambda: os.environ["HOME"],
    "an imported name": of_an_import, "an array of a file": lambda: np.load("a.npy"),
    "a table of a file": lambda: loadtxt("a.txt"), "chance": lambda: random.random(),
    "chance of numpy": lambda: np.random.default_rng(), "the time": lambda: time.time(),
    "modules": lambda: sys.modules["a_package"].part,
}  # fmt: skip


READERS = {
    "base class": (lambda: Model.strength, Base),
    "class within a class": (lambda: Model.inner.strength, Inner),
    "array of a class": (lambda: Model.matrix, Model),
    "class of a dictionary": (lambda: TABLE.strength, Table),
    "module of a package": (lambda: PACKAGE.part.strength, PART),
}


@pytest.mark.parametrize("name", READERS)
def test_what_a_function_reads_counts_wherever_it_stands(name, monkeypatch):
    function, holder = READERS[name]
    monkeypatch.setitem(sys.modules, "a_package", PACKAGE)
    monkeypatch.setitem(sys.modules, "a_package.part", PART)
    word = "matrix" if holder is Model else "strength"
    keys = set()
    for value in (1, 2, 1):
        monkeypatch.setattr(holder, word, value * np.eye(2) if word == "matrix" else value,
                            raising=False)  # fmt: skip
        keys.add(reads(function))
    assert len(keys) == 2


@pytest.mark.parametrize("name", HIDING)
def test_a_function_that_may_read_anything_is_not_remembered(name):
    with pytest.raises(Opaque):
        reads(HIDING[name])


def test_names_of_parameters_and_paths_hide_nothing():
    place, word = Path("a"), "time"
    assert reads(lambda p: (p.load, p.fromfile, np.pi, place, word, "random", "os"))


def test_usual_classes_can_be_read():
    class Colour(enum.Enum):
        RED = 1

    class Law(abc.ABC):
        @abc.abstractmethod
        def of(self, x): ...

    class Point(typing.NamedTuple):
        x: float = 1.0

    class Slotted:
        __slots__ = ("x",)

    @dataclass(frozen=True)
    class Held:
        x: float = 1.0

        @cached_property
        def twice(self):
            return 2 * self.x

    for thing in (Colour, Colour.RED, Law, Point, Point(), Slotted, Held, Held()):
        assert reads(thing) == reads(thing)
