"""ASE's VelocityVerlet: one atom in the plane, its forces from the scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from ase import Atoms
from ase.calculators.calculator import Calculator, all_changes
from ase.md.verlet import VelocityVerlet


class Potential(Calculator):
    """−∂H/∂q of the scene, in the units that ASE computes in."""

    implemented_properties = ["energy", "forces"]  # noqa: RUF012

    def __init__(self, system: Any) -> None:
        super().__init__()
        self.system = system

    def calculate(self, atoms: Any = None, of: Any = None, changes: Any = all_changes) -> None:
        """Fill in what ASE asks for."""
        super().calculate(atoms, of, changes)
        q, p = self.atoms.positions[0, :2].copy(), np.zeros(2)
        forces = np.append(-self.system.gradient(q, p), 0.0)
        self.results = {"energy": self.system.H(q, p), "forces": forces[None]}


def run(q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h."""
    atoms = Atoms("H", [[*q, 0.0]], masses=[1.0], momenta=[[*p, 0.0]], calculator=Potential(system))
    dynamics, rows = VelocityVerlet(atoms, timestep=h), [(q, p)]
    for k in range(1, steps + 1):
        dynamics.step()
        if k % every == 0:
            rows.append((atoms.positions[0, :2].copy(), atoms.get_momenta()[0, :2]))
    return tuple(np.array(part) for part in zip(*rows, strict=True))
