"""Points of the Sobol' sequence by SciPy, which has Joe and Kuo's direction numbers from their own table:
`tests/authorities/sobol.json`.

64 dimensions, unscrambled: points 0 to 31, and some far ones. A coordinate is a multiple of 2^-32, and written as that
whole number.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import scipy
from scipy.stats import qmc

HERE = Path(__file__).resolve().parent
FAR = [100, 1023, 1024, 65535, 65536, 1000000]


def main():
    sequence = qmc.Sobol(64, scramble=False, bits=32)
    # SciPy goes through the points in the order of Gray's code: it meets point k ^ (k >> 1) as its k-th.
    count = 1 << 20
    wanted = set(range(32)) | set(FAR)
    points = {}
    place = 0
    while place < count:
        block = sequence.random(1 << 14)
        for offset in range(len(block)):
            k = place + offset
            index = k ^ (k >> 1)
            if index in wanted:
                points[index] = [int(value) for value in np.round(block[offset] * 2.0**32)]
        place += len(block)
    rows = [f"  [{index}, {json.dumps(points[index])}]" for index in sorted(points)]
    text = '{\n"scipy": "%s",\n"points": [\n%s\n]}\n' % (scipy.__version__, ",\n".join(rows))
    (HERE.parent / "tests" / "authorities" / "sobol.json").write_text(text)
    (HERE / "output" / "sobol.txt").write_text(f"SciPy {scipy.__version__}: {len(rows)} points of 64 dimensions\n")
    print(f"SciPy {scipy.__version__}: {len(rows)} points of 64 dimensions")


if __name__ == "__main__":
    main()
