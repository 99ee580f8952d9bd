"""Build the editable install: one module `discmech` that runs the checkout's own."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

MODULE = """__file__ = {!r}
with open(__file__, "rb") as _source:
    exec(compile(_source.read(), __file__, "exec"))
"""


class Editable(BuildHookInterface[Any]):
    """Hatch would put the checkout on sys.path, and `studies` and `tests` with it."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Include the module in place of the wheel's copies: they would not follow the checkout."""
        if version == "editable":
            self.folder = TemporaryDirectory()  # lives as long as the build
            module = Path(self.folder.name, "discmech.py")
            module.write_text(MODULE.format(str(Path(self.root, module.name))), encoding="utf-8")
            build_data["force_include_editable"][str(module)] = module.name

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the temporary file."""
        if version == "editable":
            self.folder.cleanup()
