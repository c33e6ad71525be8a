"""Kinds of processor for which the compiled loops are tested; `python -m tests.processors` prints those that run here.

Names as of `NUMBA_CPU_NAME`, with `NUMBA_CPU_FEATURES` empty: without it numba takes the features of the
processor that it runs on, whatever the name. Generic has neither wide vectors nor fused products and sums.
"""

from __future__ import annotations

NEEDS = {"generic": (), "haswell": ("avx2", "bmi2", "fma"),
         "skylake-avx512": ("avx512bw", "avx512cd", "avx512dq", "avx512f", "avx512vl")}


def usable() -> list[str]:
    """Kinds whose instructions this processor has."""
    from llvmlite import binding

    has = binding.get_host_cpu_features()
    return [kind for kind, needs in NEEDS.items() if all(has.get(one, False) for one in needs)]


if __name__ == "__main__":
    print(*usable())
