"""The README's picture, from a finished report.

Run it by python -m tests.readme_picture.

Arguments, both optional: the report's folder (reports/build) and the file (docs/convergence.png).
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from io import BytesIO
from pathlib import Path

from discmech.integrators import scenes
from discmech.studies.core.result import study_result_of
from discmech.studies.report.figures import plates

SCENES = ("harmonic", "pendulum", "kepler", "rigid-body", "heavy-top", "lagrange-top")
DIGITS = 16
COLOURS = 160


def picture(report: Path) -> bytes:
    """Return the convergence of all rules on six scenes as PNG, black on white in few colours."""
    from PIL import Image

    written = (report / "tables" / "order.json").read_text("utf-8")
    result = study_result_of(json.loads(written))
    cases = [c for c in result.cases if c.scene in SCENES and c.digits == DIGITS]
    if not cases:
        raise ValueError("it has no case of these scenes in double precision")
    titles = {name: scenes.get(name).title or name for name in {str(c.scene) for c in cases}}
    (plate,) = plates([replace(result, cases=cases)], titles, {})
    image = Image.open(BytesIO(plate.drawing.files["png"])).convert("RGB")
    few = image.quantize(COLOURS, dither=Image.Dither.NONE)
    stream = BytesIO()
    few.save(stream, "PNG", optimize=True)
    return stream.getvalue()


def main(arguments: list[str]) -> int:
    """Write the picture; return 2 if there is no report to draw it from."""
    usual = ("reports/build", "docs/convergence.png")
    report, file = map(Path, (*arguments[:2], *usual[len(arguments) :]))
    try:
        drawn = picture(report)
    except (OSError, ValueError, KeyError) as error:
        print(f"no picture from {report}: {error}; say make report first.", file=sys.stderr)
        return 2
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(drawn)
    print(f"{file}: {len(drawn) // 1000} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
