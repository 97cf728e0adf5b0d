"""Check of the processor: wheels need no more than x86-64-v2, a build of one's own may."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

CPUINFO = Path("/proc/cpuinfo")


def check(needed: Iterable[str], cpuinfo: Path = CPUINFO) -> None:
    """Raises ImportError if the processor lacks one of the extensions that the build uses."""
    wanted = {name: name.lower().replace("-", "") for name in needed}
    if not wanted or not cpuinfo.exists():
        return
    flags = re.search(r"^flags\s*:(.*)$", cpuinfo.read_text(), re.MULTILINE)
    present = {flag[:6] if flag.startswith("avx512") else flag for flag in flags[1].split()} if flags else set()
    missing = [name for name, flag in wanted.items() if flag not in present]
    if missing:
        raise ImportError(
            f"this processor lacks {', '.join(missing)}, which this build of gyrfalcon uses; "
            "`cargo xtask python` builds a wheel for any x86-64 processor"
        )
