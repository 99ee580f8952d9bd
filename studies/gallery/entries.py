"""The gallery's entries: methods of libraries, their documented claims, and the claims' places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from typing import Any

from discmech.integrators.errors import unknown
from discmech.integrators.extensions.foreign import BlackBox, black_box

INSTALL = "pip install 'discmech[gallery]'"


@dataclass(frozen=True)
class Entry:
    """A method of a library.

    package: its name on the package index. module: the module to import. adapter: the file in
    `adapters/`; method: the library's name of it, if the file serves several. claim: the
    documentation's claim, in a few words, at `place`; claims: the same for `black_box`; exact: True
    if it claims that the energy is kept exactly. own_steps: h is only the time between rows.
    multistep: it has a memory, which is empty at the start of a single step. note: what a reader
    has to know of how it is run.
    """

    name: str
    package: str
    module: str
    adapter: str
    method: str
    scene: str
    claim: str
    place: str
    claims: dict[str, Any] = field(default_factory=dict)
    note: str = ""
    exact: bool = False
    own_steps: bool = False
    multistep: bool = False

    @property
    def installed(self) -> bool:
        """True if the library is installed."""
        return find_spec(self.module) is not None

    @property
    def absent(self) -> str:
        """Why the library cannot be used, a sentence; empty if it can. It is imported now."""
        if not self.installed:
            return f"{self.package} is not installed, so its methods are left out: {INSTALL}."
        try:
            import_module(f".adapters.{self.adapter}", __package__)
        except (ImportError, OSError) as error:  # OSError: of a shared library that is not there
            return f"{self.package} cannot be loaded ({error}), so its methods are left out."
        return ""

    @property
    def version(self) -> str:
        """The library's version."""
        return version(self.package)

    @property
    def box(self) -> BlackBox:
        """The method as a black box; its library is imported now."""
        adapter = import_module(f".adapters.{self.adapter}", __package__)
        runs = hasattr(adapter, "run")
        function = adapter.run if runs else adapter.step
        if self.method:
            function = partial(function, self.method)
        made: BlackBox = black_box(runs=runs, name=self.name, **self.claims)(function)
        return made


def chosen(names: Sequence[str]) -> list[Entry]:
    """Return the entries of these names, or of the libraries of these names; all for no names.

    Raises `BadInput` for another name.
    """
    entries: dict[str, Entry] = {}
    for name in names or ENTRIES:
        here = [e for e in ENTRIES.values() if name in (e.name, e.package, e.module)]
        if not here:
            packages = dict.fromkeys(e.package for e in ENTRIES.values())
            raise unknown("method of the gallery", name, (*packages, *ENTRIES))
        entries |= {entry.name: entry for entry in here}
    return list(entries.values())


_SCIPY = "https://docs.scipy.org/doc/scipy/reference/generated/scipy.integrate"
_REBOUND = "https://rebound.readthedocs.io/en/latest/integrators"
_GALA = "https://gala.adrian.pw/en/latest/api/gala.integrate"
_DIFFRAX = "https://docs.kidger.site/diffrax/api/solvers/ode_solvers/"
_MUJOCO = "https://mujoco.readthedocs.io/en/stable/computation/index.html#numerical-integration"
_OPENMM = "http://docs.openmm.org/latest/api-python/generated/openmm"
_DESOLVER = "https://github.com/Microno95/desolver/tree/master/desolver/integrators"
_GALPY = "https://docs.galpy.org/en/latest/reference/orbitint.html"
_OWN = "steps of its own: h is the time between rows, so no order in h is to be seen"
_LATE = "read as the state is given out: velocities are half a step behind the places"
_TABLE = (
    Entry(
        "scipy-RK45", "scipy", "scipy", "scipys", "RK45", "henon-heiles",
        "explicit Runge–Kutta method of order 5(4)", f"{_SCIPY}.RK45.html", {"order": 5},
        "constant steps: a tolerance that every step keeps",
    ),
    Entry(
        "scipy-DOP853", "scipy", "scipy", "scipys", "DOP853", "henon-heiles",
        "explicit Runge–Kutta method of order 8", f"{_SCIPY}.DOP853.html", {"order": 8},
        "constant steps: a tolerance that every step keeps",
    ),
    Entry(
        "rebound-leapfrog", "rebound", "rebound", "rebounds", "leapfrog", "outer-solar-system",
        "second order, symplectic", f"{_REBOUND}/#leapfrog",
        {"order": 2, "symplectic": True, "reversible": True},
    ),
    Entry(
        "rebound-WHFast", "rebound", "rebound", "rebounds", "whfast", "outer-solar-system",
        "symplectic Wisdom–Holman integrator, for small perturbations of Kepler orbits",
        f"{_REBOUND}/#whfast", {"order": 2, "symplectic": True},
    ),
    Entry(
        "rebound-SABA4", "rebound", "rebound", "rebounds", "saba4", "outer-solar-system",
        "symplectic; high order in the step where perturbations are small", f"{_REBOUND}/#saba",
        {"order": 2, "symplectic": True},
        "the order is that of the small terms, O(ε dt⁸ + ε² dt²)",
    ),
    Entry(
        "rebound-IAS15", "rebound", "rebound", "rebounds", "ias15", "outer-solar-system",
        "15th order, adaptive, not symplectic; accurate down to machine precision",
        f"{_REBOUND}/#ias15", {}, _OWN, own_steps=True,
    ),
    Entry(
        "gala-Leapfrog", "gala", "gala", "galas", "LeapfrogIntegrator", "henon-heiles",
        "second-order symplectic method; energy errors bounded",
        f"{_GALA}.LeapfrogIntegrator.html", {"order": 2, "symplectic": True},
    ),
    Entry(
        "gala-Leapfrog-linear", "gala", "gala", "galas", "LeapfrogIntegrator", "harmonic",
        "conserves energy exactly for linear systems", f"{_GALA}.LeapfrogIntegrator.html",
        {"order": 2}, "the same method on a linear system", exact=True,
    ),
    Entry(
        "gala-Ruth4", "gala", "gala", "galas", "Ruth4Integrator", "henon-heiles",
        "fourth-order symplectic method of Ruth", f"{_GALA}.Ruth4Integrator.html",
        {"order": 4, "symplectic": True},
    ),
    Entry(
        "gala-RK5", "gala", "gala", "galas", "RK5Integrator", "henon-heiles",
        "fifth-order Runge–Kutta method with fixed steps", f"{_GALA}.RK5Integrator.html",
        {"order": 5},
    ),
    Entry(
        "ase-VelocityVerlet", "ase", "ase", "ases", "", "henon-heiles",
        "velocity Verlet; preserves the energy (NVE)", "https://ase-lib.org/ase/md.html",
        {"order": 2, "symplectic": True, "reversible": True},
    ),
    Entry(
        "openmm-Verlet", "OpenMM", "openmm", "openmms", "Verlet", "henon-heiles",
        "leap-frog Verlet", f"{_OPENMM}.VerletIntegrator.html", {"order": 2}, _LATE,
    ),
    Entry(
        "openmm-MTS", "OpenMM", "openmm", "openmms", "MTS", "henon-heiles",
        "multiple time steps (rRESPA)", f"{_OPENMM}.mtsintegrator.MTSIntegrator.html",
        {"order": 2, "symplectic": True}, "the quadratic part of the potential twice a step",
    ),
    Entry(
        "mujoco-Euler", "mujoco", "mujoco", "mujocos", "Euler", "double-pendulum",
        "semi-implicit Euler: the place by the new velocity", _MUJOCO,
        {"order": 1, "state": "qv"},
    ),
    Entry(
        "mujoco-implicit", "mujoco", "mujoco", "mujocos", "implicit", "double-pendulum",
        "Euler, implicit in the velocity", _MUJOCO, {"order": 1, "state": "qv"},
    ),
    Entry(
        "mujoco-implicitfast", "mujoco", "mujoco", "mujocos", "implicitfast", "double-pendulum",
        "Euler, implicit in the velocity, without the derivatives of Coriolis forces", _MUJOCO,
        {"order": 1, "state": "qv"},
    ),
    Entry(
        "mujoco-RK4", "mujoco", "mujoco", "mujocos", "RK4", "double-pendulum",
        "4th-order Runge–Kutta", _MUJOCO, {"order": 4, "state": "qv"},
    ),
    Entry(
        "drake-discrete", "drake", "pydrake", "drakes", "", "pendulum",
        "MultibodyPlant as a discrete system with steps of constant length",
        "https://drake.mit.edu/doxygen_cxx/classdrake_1_1multibody_1_1_multibody_plant.html",
        {"order": 1, "state": "qv"},
    ),
    Entry(
        "pinocchio-semi-implicit-Euler", "pin", "pinocchio", "pinocchios", "", "double-pendulum",
        "dynamics (aba) and integrate(model, q, v), which examples step with",
        "https://github.com/stack-of-tasks/pinocchio", {"order": 1, "state": "qv"},
        "the library has dynamics and no integrator in time: v ← v + h a, then q ⊕ h v",
    ),
    Entry(
        "diffrax-SemiImplicitEuler", "diffrax", "diffrax", "diffraxes", "SemiImplicitEuler",
        "henon-heiles", "symplectic method", _DIFFRAX, {"order": 1, "symplectic": True},
    ),
    Entry(
        "diffrax-LeapfrogMidpoint", "diffrax", "diffrax", "diffraxes", "LeapfrogMidpoint",
        "henon-heiles", "2nd order linear multistep method", _DIFFRAX, {"order": 2},
        "its first step is Euler's, so the order is that of its runs, and one step alone is of "
        "order 1", multistep=True,
    ),
    Entry(
        "diffrax-ReversibleHeun", "diffrax", "diffrax", "diffraxes", "ReversibleHeun",
        "henon-heiles", "algebraically reversible 2nd order method", _DIFFRAX, {"order": 2},
        "reversible with its second state; read at (q, p) alone",
    ),
    Entry(
        "diffrax-Tsit5", "diffrax", "diffrax", "diffraxes", "Tsit5", "henon-heiles",
        "5th order explicit Runge–Kutta method", _DIFFRAX, {"order": 5}, "constant steps",
    ),
    Entry(
        "jax-md-nve", "jax-md", "jax_md", "jaxmds", "", "henon-heiles",
        "standard velocity Verlet; the energy is held constant",
        "https://jax-md.readthedocs.io/en/main/jax_md.simulate.html",
        {"order": 2, "symplectic": True, "reversible": True},
        "it rounds the step to single precision (dt = f32(dt)), so that errors end at some 1e-8",
    ),
    Entry(
        "heyoka-Taylor", "heyoka", "heyoka", "heyokas", "", "henon-heiles",
        "Taylor's method, accurate to machine precision, not symplectic",
        "https://bluescarni.github.io/heyoka.py/", {}, _OWN, own_steps=True,
    ),
    Entry(
        "desolver-RadauIIA3", "desolver", "desolver", "desolvers", "RadauIIA3", "henon-heiles",
        "Radau IIA method, __order__ = 3", f"{_DESOLVER}/implicit_integration_schemes.py",
        {"order": 3}, "constant steps; the tableau has a₂₂ = 1/3, where Radau IIA has 1/4",
    ),
    Entry(
        "pyAT-StrMPoleSymplectic4Pass", "accelerator-toolbox", "at", "pyats",
        "StrMPoleSymplectic4Pass", "harmonic", "4th-order symplectic pass through a magnet",
        "https://atcollab.github.io/at/p/index.html", {"order": 4, "symplectic": True},
        "a quadrupole, one slice for each step",
    ),
    Entry(
        "galpy-leapfrog", "galpy", "galpy", "galpys", "leapfrog_c", "henon-heiles",
        "simple leapfrog integrator in C", _GALPY, {"order": 2, "symplectic": True},
    ),
    Entry(
        "galpy-symplec4", "galpy", "galpy", "galpys", "symplec4_c", "henon-heiles",
        "4th order symplectic integrator in C", _GALPY, {"order": 4, "symplectic": True},
    ),
    Entry(
        "galpy-symplec6", "galpy", "galpy", "galpys", "symplec6_c", "henon-heiles",
        "6th order symplectic integrator in C", _GALPY, {"order": 6, "symplectic": True},
    ),
    Entry(
        "pyhamsys-BM4", "pyhamsys", "pyhamsys", "pyhamsyss", "BM4", "henon-heiles",
        "symplectic splitting of order 4", "https://github.com/cchandre/pyhamsys",
        {"order": 4, "symplectic": True},
        "solve_ivp_symp makes one step more between two rows than `step` says (adjust_step), so "
        "with a row a step twice as many: it is asked for fewer here",
    ),
    Entry(
        "lammps-nve", "lammps", "lammps", "lammpss", "", "henon-heiles",
        "constant NVE integration, velocity Verlet", "https://docs.lammps.org/fix_nve.html",
        {"order": 2, "symplectic": True, "reversible": True},
    ),
    Entry(
        "pybullet-stepSimulation", "pybullet", "pybullet", "bullets", "", "pendulum",
        "stepSimulation: forward dynamics and integration over a time step",
        "https://github.com/bulletphysics/bullet3", {"order": 1, "state": "qv"},
        "a joint without motor and damping",
    ),
    Entry(
        "sundials-CVODE-Adams", "scikit-sundae", "sksundae", "sundaes", "Adams", "henon-heiles",
        "Adams' methods of order 1 to 12 with variable steps",
        "https://sundials.readthedocs.io/en/latest/cvode/", {}, _OWN, own_steps=True,
    ),
)  # fmt: skip
ENTRIES = {entry.name: entry for entry in _TABLE}
