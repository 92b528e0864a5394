"""``taut schema`` as an editor has it: taplo is what checks TOML in VS Code and others."""

import os
import subprocess
import sys
from pathlib import Path

import pytest


def checked(schema, *files):
    """The output of taplo on these files."""
    program = Path(sys.executable).parent / "taplo"
    if not program.exists():
        pytest.skip("taplo is not installed")
    done = subprocess.run([program, "lint", "--schema", f"file://{schema}", *files], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def test_an_editor_checks_case_files_with_the_schema(root, tmp_path):
    """It refused the schema itself, whose name was no whole URI, and so every file."""
    program = os.environ.get("TAUT_PROGRAM")
    if program is None:
        pytest.skip("TAUT_PROGRAM does not say where the program taut is")
    schema = tmp_path / "case.schema.json"
    schema.write_bytes(subprocess.run([program, "schema", "case"], capture_output=True, check=True).stdout)
    files = sorted((root / "stages").rglob("*.toml"))
    assert len(files) > 20
    status, told = checked(schema, *files)
    assert status == 0, told
    for text, wrong in [
        ("[motor]\ntorque_konstant = 1\n", "torque_konstant"),
        ("[cart.friction]\nviscouss = 3\n", "viscouss"),
        ("[cart]\nmass = [1]\n", "mass"),
        ("experiment = 3\n", "experiment"),
    ]:
        case = tmp_path / "wrong.toml"
        case.write_text(text)
        status, told = checked(schema, case)
        assert status != 0 and wrong in told, told
