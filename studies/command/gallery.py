"""The subcommand `gallery`: integrators in public use, judged by their documented claims."""

from __future__ import annotations

import argparse
from typing import Any

from discmech.integrators import BadInput

from .output import console, progress_shown, write, write_json


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "gallery",
        help="other people's integrators, judged by what their documentation claims",
        epilog="pip install 'discmech[gallery]' installs the libraries; missing "
        "ones are skipped, with a sentence. Exit codes: 0 for any verdict, 2 if no method could be "
        "run.",
    )
    parser.add_argument(
        "names", metavar="NAME", nargs="*", help="methods or libraries (default: all)"
    )
    parser.add_argument(
        "--list", action="store_true", help="only list the methods and their sources"
    )
    parser.add_argument("--page", metavar="FILE", help="write a page in Markdown")
    parser.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    parser.set_defaults(action=_answer)


def _answer(options: argparse.Namespace) -> int:
    from ..gallery.entries import chosen
    from ..gallery.measuring import LONG, measured
    from ..gallery.page import figures, page

    entries = chosen(options.names)
    if options.list:
        for entry in entries:
            there = entry.version if entry.installed else "not installed"
            print(f"{entry.name} ({entry.package} {there}): {entry.claim} <{entry.place}>")
        return 0
    quiet = options.json == "-"
    rows, absent = [], dict[str, None]()
    with progress_shown("gallery") as show:
        for k, entry in enumerate(entries):
            show(entry.name, k / len(entries))
            if why := entry.absent:
                absent[why] = None
                continue
            rows.append(measured(entry))
            if not quiet:
                said = " ".join(rows[-1]["differs"] + rows[-1]["untold"]) or "agrees"
                words = ("order", "form", "energy", "momentum", "there and back", "a step")
                told = ", ".join(f"{word} {figure}" for word, figure in
                                 zip(words, figures(rows[-1]), strict=True))  # fmt: skip
                print(f"{entry.name} ({entry.package} {entry.version}): {told}: {said}", flush=True)
    if not rows:
        raise BadInput(" ".join(absent))
    if options.page:
        write(options.page, page(rows, [*absent], LONG).rstrip("\n"))
    if options.json:
        write_json(options.json, {"gallery": rows, "absent": [*absent]})
    if not quiet:
        for sentence in absent:
            console().print(sentence, highlight=False, markup=False, soft_wrap=True)
    return 0
