"""Write PAPER.md: python -m tests.paper"""

import os
from pathlib import Path

from .page import page

TARGET = Path(__file__).resolve().parent.parent.parent / "PAPER.md"

if __name__ == "__main__":
    beside = TARGET.with_suffix(".md.new")
    beside.write_text(page(), encoding="utf-8")
    os.replace(beside, TARGET)
    print(f"wrote {TARGET.name}")
