"""What an exported file of a lattice holds: its driver, with loops over sites and bonds.

The driver is the text that the bench compiles (`lattices.lattice_driver`), specialised for the
lattice; the state has the arrays of `lattices.lattice_run`, row after row.
"""

from __future__ import annotations

import ast
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ...compiler import KNOWN_ZEROS, Entry, texts_of
from ...compiler.llvm_values import Value
from ...numbers import Double, flatten
from ..lattices.lattice_run import ranges_of, segments_of
from ..lattices.lattice_text import lattice_text
from .exported import EPS, HERE, LARGE, STATUSES, STEPS, Parameter
from .specialised import Specialised
from .written import Entries, Table

MOST = 4  # segments of bonds that have loops of their own; more of them are a table
ORDER = ("x", "nu", "mu", "w", "w1", "w2", "w3", "work", "ties", "p", "b", "coefficients", "given")


class ExportedLattice:
    """A lattice's scheme as data for the writers, like `Exported`."""

    has_energy = False
    quantities: tuple[str, ...] = ()

    def __init__(self, scheme: Any) -> None:
        self.scheme, self.scene = scheme, scheme.lattice
        lattice = scheme.lattice
        self.flow, self.timed = scheme.flow(lattice.step), scheme.timed
        self.order, self.segments = segments_of(lattice.pairs)
        parts = lattice_text(scheme.system, lattice.shape, bool(scheme.substeps)), self.own_rows
        self.module = Specialised(
            "\n\n".join([*parts, texts_of(HERE / "lattice_stepping", HERE / "stepping")]),
            {**KNOWN_ZEROS, "BEGIN": 0, "SHOW": 2, "HELD": 0}, {}, {},
        )  # fmt: skip
        self.names = self.module.names
        listed = self.names["LISTED"] and not self.scheme.local
        self.names["RUN"] = 5 if listed else 1  # tasks of the driver
        known = (*STATUSES, "KINDS", "RANGES", "SEGMENTS")
        self.module.constants = {k: v for k, v in self.constants.items() if k not in known}
        self.module.fields = self.fields

    @cached_property
    def start(self) -> tuple[list[float], list[float]]:
        """x, with the time, and μ of the lattice's own start."""
        x, mu = self.flow.own_start
        return [*map(float, x.ravel()), *[0.0] * self.timed], [*map(float, mu.ravel())]

    @cached_property
    def parameters(self) -> list[Parameter]:
        """The shared parameters, and those that each site or bond has."""
        parameters = list[Parameter]()
        for word, parts in self.scene.split_parameters.items():
            for name, value in parts.items():
                if all(e.name != name for e in parameters):
                    values = tuple(map(float, flatten(value) if word == "shared"
                                       else np.ravel(value)))  # fmt: skip
                    parameters.append(Parameter(name, tuple(np.shape(value)), values))
        return parameters

    @cached_property
    def places(self) -> dict[str, int]:
        """Where each parameter begins in q."""
        places, at = {}, 1
        for parameter in self.parameters:
            places[parameter.name] = at
            at += len(parameter.values)
        return places

    @property
    def own_rows(self) -> str:
        """The text that brings parameters into rows of sites and of bonds."""
        parts = self.scene.split_parameters
        width = {k: a[0].size for part in ("site", "bond") for k, a in parts[part].items()}

        def copied(array: str, row: str, columns: list[tuple[str, str]]) -> list[str]:
            sources = [f"{self.places[key]} + {which} * {width[key]} + {j}"
                       for key, which in columns for j in range(width[key])]  # fmt: skip
            return [f"        s.{array}[{row}, {at}] = s.q[{source}]"
                    for at, source in enumerate(sources)]  # fmt: skip

        of_sites = copied("p", "i", [(k, "i") for k in parts["site"]])
        of_bonds = [(k, "ENDS[3 * k]") for k in parts["bond"]]
        ends = [(k, f"ENDS[3 * k + {e}]") for k in parts["site"] if k not in parts["bond"]
                for e in (1, 2)]  # fmt: skip
        ties = copied("b", "k", [*of_bonds, *ends])
        lines = ["    for i in range(PLACES):", *of_sites] if of_sites else []
        lines += ["    for k in range(TIES):", *ties] if ties else []
        return "\n".join(["def own_rows(s):", *(lines or ["    pass"])])

    def _drive(self, of: Any, s: Any, task: Any, steps: Any) -> Any:
        """Write the driver; return the status."""
        routine = self.module.routine
        arrays = {**vars(s), **{e: replace(getattr(s, e), columns=self.names["WIDTHS"][e])
                                for e in ("x", "mu")}}  # fmt: skip
        kinds = Entries("i", "KINDS", None, routine)
        tables: list[Any] = []
        for name, rows in (("RANGES", ranges_of(self.scene.free)), ("SEGMENTS", self.segments)):
            if len(rows) <= MOST:
                tables += [Table(rows.tolist(), routine), len(rows)]
            else:  # a count that no loop is unrolled for
                tables += [Entries("i", name, rows.shape[1], routine),
                           Value("i", str(len(rows)), routine)]  # fmt: skip
        return of("advance")(task, steps, *map(arrays.get, ORDER), kinds, len(self.scheme.kinds),
                             *tables, s.totals)[1]  # fmt: skip

    def _prepare(self, _: Any, s: Any) -> None:
        """Write the coefficients of each substep, and what they come from if the time is there."""
        rows = self.scheme.q_values(self.flow.step, Double())
        shared = len(flatten(tuple(self.scene.split_parameters["shared"].values())))
        before = 0.0
        for j, (kind, row) in enumerate(zip(self.scheme.kinds, rows, strict=True)):
            share = float(row[0]) / float(self.flow.step)
            own = [s.q[1 + i] for i in range(shared)]
            numbers = map(float, row[1 + self.timed + shared :])
            values = (s.q[0] * share, *[0.0] * self.timed, *own, *numbers)
            system = self.names["ADJOINT" if kind else "RULE"]
            if self.timed:
                for i, e in enumerate((s.t0[0] + before * s.q[0], s.q[0], *values)):
                    s.given[j, i] = e
                before += share
            else:
                for i, e in enumerate(system.prepare(values)):
                    s.coefficients[j, i] = e

    @cached_property
    def functions(self) -> list[ast.FunctionDef]:
        """The functions of a file, each after those that it calls."""
        module, state = self.module, "(s: State) -> None:"
        module.function("def drive(s: State, task: int, steps: int) -> int:", self._drive,
                        "Do a task: 0 begins, 1 does steps, 2 writes mu.")  # fmt: skip
        module.function(f"def prepare_sites{state}", self._prepare,
                        "Write what depends on the step and the parameters alone.")  # fmt: skip
        module.function(f"def own_rows{state}", None, "Give each site and bond its own parameters.")
        for head in (f"undo{state}", f"start{state}", "begin_steps(s: State, h: float) -> int:",
                     *STEPS):  # fmt: skip
            module.function(f"def {head}")
        return [*module.made.values()]

    @cached_property
    def constants(self) -> dict[str, Any]:
        """The numbers of a file by their names."""
        lattice = self.scene
        pairs = np.c_[self.order, lattice.pairs[self.order]]
        fixed = np.flatnonzero(~lattice.free).tolist()
        v0 = (lattice.start[1] * lattice.free[:, None]).ravel()
        return {
            **{e: i for i, e in enumerate(STATUSES)}, "N": len(self.start[0]),
            "M": len(self.start[1]), "PLACES": lattice.sites, "TIES": len(pairs),
            "ENTRIES": len(Entry), "EPS": EPS, "HUGE": LARGE, "LARGE": LARGE,
            "KINDS": self.scheme.kinds, "V0": [*map(float, v0)],
            **({"FIXED": fixed, "HELD": len(fixed)} if fixed else {}),
            "ENDS": [int(e) for e in pairs.ravel()],
            "RANGES": ranges_of(lattice.free).ravel().tolist(),
            "SEGMENTS": self.segments.ravel().tolist(),
        }  # fmt: skip

    @cached_property
    def fields(self) -> dict[str, tuple[str, tuple[int, ...]]]:
        """Name → (kind, lengths) of the state's fields."""
        widths, c = self.names["WIDTHS"], self.constants
        count = len(self.scheme.kinds)
        rows = {**dict.fromkeys(("nu", "w", "w1", "w2", "w3", "p", "work"), c["PLACES"]),
                "coefficients": count, "given": count, "ties": c["TIES"]}  # fmt: skip
        size = 1 + sum(len(e.values) for e in self.parameters)
        return {
            "x": ("float", (c["N"],)), "mu": ("float", (c["M"],)), "q": ("float", (size,)),
            "b": ("float", (c["TIES"], widths["q"])), "h": ("float", ()), "t0": ("float", ()),
            "totals": ("float", (len(Entry),)), "kept": ("float", (c["N"] + c["M"],)),
            "done": ("int", ()), **{e: ("float", (k, widths[e])) for e, k in rows.items()},
        }  # fmt: skip
