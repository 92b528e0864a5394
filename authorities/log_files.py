"""Small logs as SciPy, h5py and PyArrow write them, for tests/logs.rs to read.

Every file holds the same twenty samples, in numbers that any type of the file keeps exactly:
t = k / 1024 s, u = 5 V for k < 10 and then 0, x = k**2 / 2**20 m.

    .venv/bin/pip install scipy h5py pyarrow
    .venv/bin/python log_files.py
"""

import struct
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io
import scipy.sparse

OUT = Path(__file__).parent.parent / "tests" / "logs"
OUT.mkdir(exist_ok=True)
k = np.arange(20)
t, u, x = k / 1024, np.where(k < 10, 5.0, 0.0), k**2 / 2**20

# MATLAB
others = {
    "note": "made by a script",
    "settings": {"gain": 3.0},
    "pieces": np.array([1, "two"], dtype=object),
    "spectrum": t + 1j * x,
    "thin": scipy.sparse.eye(20),
    "kp": 160.18,
    "cube": np.zeros((2, 3, 4)),
    "short": x[:19],
    "data": np.column_stack([t, u, x]),
    "x_missing": np.where(k == 7, np.nan, x),
    "x_infinite": np.where(k == 7, np.inf, x),
    "run": (k >= 10).astype(np.uint8) + 1,
}
scipy.io.savemat(OUT / "columns.mat", {**others, "t": t, "u": u, "x": x}, oned_as="column")
scipy.io.savemat(OUT / "rows.mat", {**others, "t": t, "u": u, "x": x}, oned_as="row", do_compression=True)
typed = {"t": t.astype(np.float32), "u": u.astype(np.int16), "x": x, "k8": k.astype(np.int8), "k64": k.astype(np.int64),
         "k32": k.astype(np.uint32), "high": k >= 10}
scipy.io.savemat(OUT / "types.mat", typed, do_compression=True)
scipy.io.savemat(OUT / "version4.mat", {"t": t, "u": u, "x": x}, format="4")
with h5py.File(OUT / "version73.mat", "w", userblock_size=512) as file:
    for name, values in [("t", t), ("u", u), ("x", x)]:
        file[name] = values[:, None]
header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM"
with open(OUT / "version73.mat", "r+b") as file:
    file.write(header)


def big_endian(name, values):
    """An array as a big-endian machine writes it: flags, dimensions, name, numbers."""
    def element(kind, data):
        return struct.pack(">II", kind, len(data)) + data + bytes(-len(data) % 8)

    body = element(6, struct.pack(">II", 6, 0)) + element(5, struct.pack(">ii", len(values), 1))
    # A short name stands in its tag.
    body += struct.pack(">HH", len(name), 1) + name.encode().ljust(4, b"\0") + element(9, struct.pack(f">{len(values)}d", *values))
    return element(14, body)


header = b"MATLAB 5.0 MAT-file, Platform: SOL2".ljust(116) + bytes(8) + b"\x01\x00MI"
(OUT / "big-endian.mat").write_bytes(header + b"".join(big_endian(n, v) for n, v in [("t", t), ("u", u), ("x", x)]))

# Parquet
mask = k == 7
table = pa.table({
    "t": t,
    "u": pa.array(u.astype(np.int16)),
    "x": pa.array(x, mask=mask),
    "x32": pa.array(x.astype(np.float32)),
    "t_us": pa.array((t * 1e6 * 1024).astype(np.int64)),
    "stamp": pa.array(1_700_000_000_000_000_000 + k * 1_000_000, type=pa.timestamp("ns")),
    "high": k >= 10,
    "note": ["made by a script"] * 20,
    "lists": [[1.0, 2.0]] * 20,
    "run": pa.array((k >= 10).astype(np.int32) + 1),
})
for compression in ["snappy", "zstd", "gzip", "lz4", "none", "brotli"]:
    pq.write_table(table, OUT / f"{compression}.parquet", compression=compression, row_group_size=8)
