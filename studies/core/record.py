"""Where and with what a result was made."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any


def record(seconds: float, settings: dict[str, Any]) -> dict[str, Any]:
    """Machine, versions, commit and settings of a run, JSON-able."""
    return {
        **_environment(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": round(seconds, 3),
        "settings": settings,
    }


def provenance() -> dict[str, Any]:
    """Date and commit of what is measured now; clean: whether the checkout is that commit's."""
    return {"date": datetime.now(UTC).isoformat(timespec="seconds"), **_commit()}


@cache
def versions() -> dict[str, Any]:
    """Of Python and of all that numbers come from."""
    packages = ("numpy", "scipy", "mpmath", "sympy", "llvmlite", "gmpy2", "python-flint")
    return {
        "python": platform.python_version(),
        **{name: _version(name) for name in packages},
        "mpmath_backend": _backend(),
        "blas": _blas(),
    }


@cache
def machine() -> dict[str, Any]:
    """What times depend on besides, with the versions of other people's integrators."""
    peers = {
        name: found for name in ("heyoka", "diffrax", "jax", "rebound") if (found := _version(name))
    }
    return {
        "machine": f"{platform.system()} {platform.machine()}",
        "cpu": _cpu(),
        "cores": os.cpu_count(),
        **peers,
    }


@cache
def processor() -> str:
    """What it is and which instructions it has: fused ones round once, wide ones add in turn."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        flags = next(line for line in lines if line.startswith(("flags", "Features")))
    except (OSError, StopIteration):
        flags = platform.machine()
    return f"{_cpu()} {hashlib.sha256(flags.encode()).hexdigest()[:16]}"


@cache
def _environment() -> dict[str, Any]:
    return {"discmech": _version("discmech"), **versions(), **machine(), **_commit()}


@cache
def _commit() -> dict[str, Any]:
    commit = _git("rev-parse", "HEAD")
    return {
        "commit": commit,
        "clean": None if commit is None else _git("status", "--porcelain") == "",
    }


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _backend() -> str:
    from mpmath.libmp import BACKEND

    return str(BACKEND)


def _blas() -> str | None:
    import numpy as np

    config: Any = np.show_config(mode="dicts")
    blas = (config or {}).get("Build Dependencies", {}).get("blas", {})
    return " ".join(filter(None, (blas.get("name"), blas.get("version")))) or None


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(
            line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")
        )
    except (OSError, StopIteration):
        return platform.processor() or "unknown"


def _git(*arguments: str) -> str | None:
    """Output of git in the project's own checkout, None where there is none."""
    here = Path(__file__).resolve().parents[2]
    if not (here / ".git").exists():
        return None
    try:
        done = subprocess.run(
            ["git", "-C", str(here), *arguments],
            capture_output=True, text=True, timeout=10, check=True,
        )  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
