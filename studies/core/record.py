"""The place, time and versions with which a result was made."""

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

from .outcome import Made


def record(seconds: float, settings: dict[str, Any]) -> dict[str, Any]:
    """Return machine, versions, commit and settings of a run, JSON-able."""
    return {
        **_environment(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": round(seconds, 3),
        "settings": settings,
    }


def provenance() -> Made:
    """Return date and commit of a measurement now."""
    return Made(datetime.now(UTC).isoformat(timespec="seconds"), **_commit())


@cache
def versions() -> dict[str, Any]:
    """Return the versions of Python and of all packages that produce numbers."""
    from mpmath.libmp import BACKEND

    packages = ("numpy", "scipy", "mpmath", "sympy", "llvmlite", "gmpy2", "python-flint")
    return {
        "python": platform.python_version(),
        **{name: _version(name) for name in packages},
        "mpmath_backend": BACKEND,
        "blas": _blas(),
    }


@cache
def machine() -> dict[str, Any]:
    """Return the other facts on which times depend, with the versions of other integrators."""
    peers = {
        name: text for name in ("heyoka", "diffrax", "jax", "rebound") if (text := _version(name))
    }
    return {
        "machine": f"{platform.system()} {platform.machine()}",
        "cpu": _cpu(),
        "cores": os.cpu_count(),
        **peers,
    }


@cache
def processor() -> str:
    """Return the processor and its instructions: fused ones round once, wide ones add in turn."""
    flags = _cpuinfo("flags", "Features") or platform.machine()
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


def _blas() -> str | None:
    import numpy as np

    config: Any = np.show_config(mode="dicts")
    blas = (config or {}).get("Build Dependencies", {}).get("blas", {})
    return " ".join(filter(None, (blas.get("name"), blas.get("version")))) or None


def _cpu() -> str:
    return _cpuinfo("model name").partition(":")[2].strip() or platform.processor() or "unknown"


def _cpuinfo(*names: str) -> str:
    """Return the first line of the system's list of processors with one of these names, or ""."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return ""
    return next((line for line in lines if line.startswith(names)), "")


def _git(*arguments: str) -> str | None:
    """Return the output of git in the project's own checkout, None without one."""
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
