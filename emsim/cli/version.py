"""usage: emsim version

Says what this emsim is: its version, how the engine computes on this processor, the Python that runs it. The first line
alone is the version."""

from __future__ import annotations

import os
import platform
import sys

from .. import __version__

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence


def main(args: Sequence[str]) -> int:
    print(f"emsim {__version__}")
    print(f"engine: {_code()}; {platform.system()} {platform.machine()}")
    print(f"Python {platform.python_version()} ({sys.executable})")
    return 0


def _code() -> str:
    """How expressions are computed; which of these the engine takes stands in tape/native.rs."""
    if asked := os.environ.get("EMSIM_CODE"):
        return f"{asked} code, as EMSIM_CODE asks"
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return "machine code by Cranelift"
    if os.name != "posix":
        return "machine code by Cranelift, x86-64"
    return f"machine code of its own, {_wide()}"


def _wide() -> str:
    """Whether four numbers at a time: asked of the system, which the engine asks the processor itself."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            flags = next((line.split() for line in file if line.startswith("flags")), [])
    except OSError:
        return "with AVX2 where the processor has it"
    return "with AVX2 and FMA" if {"avx2", "fma"} <= set(flags) else "portable (no AVX2)"
