"""The build: any x86-64 processor, typed."""

from __future__ import annotations

from pathlib import Path

import gyrfalcon
import pytest
from gyrfalcon import _core, processor


def test_the_wheel_is_for_any_processor() -> None:
    assert _core.processor_extensions() == []


def test_a_build_for_a_better_processor_is_checked_at_import(tmp_path: Path) -> None:
    cpuinfo = tmp_path / "cpuinfo"
    cpuinfo.write_text("model name\t: old\nflags\t\t: sse4_2 avx\n")
    processor.check(["AVX"], cpuinfo)
    with pytest.raises(ImportError, match="lacks AVX2, FMA"):
        processor.check(["AVX", "AVX2", "FMA"], cpuinfo)


def test_the_package_is_marked_as_typed() -> None:
    folder = Path(gyrfalcon.__file__).parent
    assert (folder / "py.typed").exists() and (folder / "_core.pyi").exists()


def test_every_public_name_says_what_it_is() -> None:
    for name in gyrfalcon.__all__:
        value = getattr(gyrfalcon, name)
        if callable(value):
            assert value.__doc__ and len(value.__doc__) > 20, name
    for kind in (gyrfalcon.Controller, gyrfalcon.Scenario, gyrfalcon.StepOutput):
        for name, value in vars(kind).items():
            if not name.startswith("_"):
                assert value.__doc__, f"{kind.__name__}.{name}"
