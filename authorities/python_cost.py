"""What a call costs in Python, over the time that the library itself takes for the run.

The run is the 5 V pulse of Table 4, one second with 1001 rows. `run.took` is measured in Rust around solver and key
figures; what is left of a call is the way there and back: arguments, arrays, the object. The package is the release
wheel, installed where this runs.
"""

from __future__ import annotations

import gc
import platform
import statistics
import sys
import time
from pathlib import Path

import numpy as np

import taut

STAGE = Path(__file__).resolve().parents[1] / "stages" / "sollmann-jouaneh" / "table4.toml"
CALLS = 5000


def main() -> None:
    case = taut.read(STAGE)
    for _ in range(200):
        case.simulate("5 V pulse")
    gc.disable()
    whole, own = [], []
    for _ in range(CALLS):
        begin = time.perf_counter()
        run = case.simulate("5 V pulse")
        whole.append(time.perf_counter() - begin)
        own.append(run.took)
        del run
    over = [call - solver for call, solver in zip(whole, own)]
    print(f"{platform.python_implementation()} {sys.version.split()[0]}, NumPy {np.__version__}, taut {taut.__version__}")
    print(f"{CALLS} calls of case.simulate(\"5 V pulse\"), 1001 rows of {len(case.simulate('5 V pulse'))} columns; microseconds")
    print("                         median     95 %    least")
    for name, times in ("whole call", whole), ("in the library", own), ("over the library's time", over):
        shares = statistics.quantiles(times, n=20)
        figures = (statistics.median(times), shares[-1], min(times))
        print(f"{name:<24}" + " ".join(f"{1e6 * figure:8.1f}" for figure in figures))


if __name__ == "__main__":
    main()
