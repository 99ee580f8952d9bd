"""The names of generated files."""

from pathlib import Path

import pytest

from discmech.integrators.compiler.cache import sources


@pytest.mark.parametrize(("file", "counts"), [
    ("numbers/exact.py", True), ("compiler/lanes.py", True),
    ("rules/quadrature.py", True),  # its nodes are tables in machine code
    ("rules/galerkin.py", False), ("scenes/pendulum.py", False),
])  # fmt: skip
def test_a_name_changes_with_what_no_equation_holds(monkeypatch, file, counts):
    before, read = sources.__wrapped__(), Path.read_bytes

    def changed(path, *words, **more):
        return read(path, *words, **more) + b"#" * path.as_posix().endswith(f"integrators/{file}")

    monkeypatch.setattr(Path, "read_bytes", changed)
    assert (sources.__wrapped__() != before) is counts
