"""Arguments, before they go to Rust: wrong types are a ``TypeError``, wrong values a ``ValueError``, each with its
name."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterable
from typing import Any


def number(name: str, value: Any) -> float | None:
    """A number, or None where nothing is given."""
    if value is None:
        return None
    if isinstance(value, (str, bytes, bytearray)) or not (hasattr(value, "__float__") or hasattr(value, "__index__")):
        raise TypeError(f"{name}: expected a number in SI units, found {type(value).__name__}")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{name}: this number is too large for a float") from None


def given(name: str, value: Any) -> float:
    """A number that cannot be left out."""
    found = number(name, value)
    if found is None:
        raise TypeError(f"{name}: expected a number in SI units, found NoneType")
    return found


def whole(name: str, value: Any, least: int, most: int = 2**63 - 1) -> int:
    """A whole number from ``least`` to ``most``."""
    try:
        found = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: expected a whole number, found {type(value).__name__}") from None
    if not least <= found <= most:
        shown = str(found) if abs(found) < 10**30 else "this number"
        raise ValueError(f"{name}: {shown} cannot be; allowed: {least} to {most}")
    return found


def text(name: str, value: Any) -> str:
    """A text that can be written as UTF-8."""
    if not isinstance(value, str):
        raise TypeError(f"{name}: expected a text, found {type(value).__name__}")
    try:
        value.encode()
    except UnicodeEncodeError as error:
        raise ValueError(f"{name}: the text is no Unicode: {error.reason} at {error.start}") from None
    return value


def word(name: str, value: Any) -> str | None:
    """A text, or None where nothing is given."""
    return None if value is None else text(name, value)


def names(name: str, value: Iterable[str] | None) -> list[str]:
    """Texts in a list; none where nothing is given."""
    if value is None:
        return []
    if isinstance(value, (str, bytes, bytearray)):
        raise TypeError(f"{name}: expected a list of names, found {type(value).__name__}")
    try:
        each = iter(value)
    except TypeError:
        raise TypeError(f"{name}: expected a name or a list of names, found {type(value).__name__}") from None
    return [text(name, item) for item in each]


def column(name: str, value: Any) -> list[float]:
    """Numbers in a list; of an array, a column of a table or any other sequence."""
    if isinstance(value, (str, bytes, bytearray)):
        raise TypeError(f"{name}: expected numbers, found {type(value).__name__}")
    try:
        each = iter(value)
    except TypeError:
        raise TypeError(f"{name}: expected numbers, found {type(value).__name__}") from None
    return [given(name, item) for item in each]


def path(value: Any) -> str:
    """A path as a text: os.PathLike, or a text."""
    found = os.fspath(value)
    if not isinstance(found, str):
        raise TypeError(f"expected a path as text or os.PathLike, found {type(found).__name__}")
    return found
