"""Packs a folder as a tar archive without times, users and groups, and compresses it."""

import gzip
import sys
import tarfile
from pathlib import Path


def plain(entry: tarfile.TarInfo) -> tarfile.TarInfo:
    entry.mtime = entry.uid = entry.gid = 0
    entry.uname = entry.gname = ""
    entry.mode = 0o755 if entry.isdir() or entry.mode & 0o100 else 0o644
    return entry


folder, file = map(Path, sys.argv[1:])
with file.open("wb") as out, gzip.GzipFile("", "wb", 9, out, mtime=0) as packed:
    with tarfile.open(fileobj=packed, mode="w") as archive:
        archive.add(folder, folder.name, filter=plain)
