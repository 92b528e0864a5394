"""Python values as a case file writes them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from ._checks import text
from ._parts import CasePart


DEEPEST = 32
"""How deep lists and dictionaries may hold each other: no case needs as much, and what holds itself has no end."""


def written(value: Any, depth: int = 0) -> str:
    """The value in TOML: numbers are SI, texts may carry a unit, lists, dictionaries and parts of a case hold these."""
    if depth > DEEPEST:
        raise ValueError(f"lists and dictionaries hold each other more than {DEEPEST} deep")
    if isinstance(value, CasePart):
        value = value.table()
    if hasattr(value, "tolist"):  # NumPy's scalars and arrays
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        if abs(value) > 10**300:
            raise ValueError("a whole number of more than 300 digits is none of a case")
        return str(value)
    if isinstance(value, float):
        # Shortest digits that read back to the same bits; TOML wants a digit on both sides of a point, and writes nan and inf alike.
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, str):
        # Strings of JSON are strings of TOML, but for DEL.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key_text(str(key))} = {written(item, depth + 1)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(written(item, depth + 1) for item in value) + "]"
    raise TypeError(f"a case holds numbers, texts, truths, lists and dictionaries, and no {type(value).__name__}")


def key_text(key: str) -> str:
    """A key, in quotes where it needs them."""
    plain = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if plain else json.dumps(key, ensure_ascii=False)


def change(key: str, value: Any) -> str:
    """``KEY=VALUE``, as ``--set`` takes it."""
    if key == "":
        raise ValueError('key: expected the key of a value, such as "cart.mass"')
    return f"{text('key', key)}={text(key, written(value))}"
