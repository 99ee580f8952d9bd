"""Count the operations of the kernels of every scheme of the tests, and compare two counts.

python -m tests.benchmarks.operations FILE          writes them as JSON
python -m tests.benchmarks.operations OLD NEW       prints the table of both, the worst ratio first
"""

from __future__ import annotations

import json
import sys
from pathlib import Path


def counted() -> dict[str, int]:
    """Return {"scene rule": additions, multiplications and divisions of all its kernels}."""
    from discmech.integrators.compiler.module_text import KernelText, operations
    from tests.objects.schemes import SCHEMES, scheme

    return {
        f"{scene} {rule}": operations(
            KernelText(scheme(scene, rule).equations.step).text
        )
        for scene, rule in SCHEMES
    }  # fmt: skip


def table(old: dict[str, int], new: dict[str, int]) -> str:
    """Return lines "ratio old new scheme"."""
    both = [(new[name] / old[name], old[name], new[name], name) for name in old.keys() & new.keys()]
    return "\n".join(
        f"{r:6.3f} {a:6} {b:6}  {name}" for r, a, b, name in sorted(both, reverse=True)
    )


if __name__ == "__main__":
    files = [Path(name) for name in sys.argv[1:]]
    if len(files) == 1:
        files[0].write_text(json.dumps(counted(), indent=1), encoding="utf-8")
    else:
        print(table(*(json.loads(f.read_text(encoding="utf-8")) for f in files)))
