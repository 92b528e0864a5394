"""Prints the reference of the Python package as Markdown, from its signatures and docstrings.

``cargo xtask book`` runs it. It reads the sources and imports nothing of them, so that no wheel is needed.
"""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path

PACKAGE = Path(__file__).parent / "python" / "taut"


def definitions(path: Path) -> dict[str, ast.ClassDef | ast.FunctionDef]:
    """Classes and functions of a file, by name."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}


def exported() -> list[str]:
    """The names in ``__all__``."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == "__all__" for t in node.targets):
            return list(ast.literal_eval(node.value))
    raise SystemExit("taut/__init__.py has no __all__")


def is_property(node: ast.FunctionDef) -> bool:
    """True for a property."""
    return any(isinstance(d, ast.Name) and d.id in {"property", "cached_property"} for d in node.decorator_list)


def doc(node: ast.ClassDef | ast.FunctionDef | ast.Module, indent: str = "") -> str:
    """The docstring, with code between single backquotes."""
    return plain(ast.get_docstring(node) or "", indent)


def plain(text: str, indent: str) -> str:
    """Text of a docstring as Markdown."""
    text = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", inspect.cleandoc(text).replace("``", "`"))
    return "\n".join(indent + line if line else "" for line in text.splitlines())


def signature(node: ast.FunctionDef) -> str:
    """Name, parameters without self, and type of the result."""
    arguments = ast.unparse(node.args)
    for own in ("self, ", "self", "cls, ", "cls"):
        arguments = arguments.removeprefix(own)
    result = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    return f"{node.name}({arguments}){result}"


def fields(body: list[ast.stmt]) -> list[str]:
    """Annotated or assigned names with a string below them: fields of a class, names of types of a module."""
    shown = []
    for node, below in zip(body, body[1:]):
        if not (isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant) and isinstance(below.value.value, str)):
            continue
        if isinstance(node, ast.AnnAssign):
            given = f" = {ast.unparse(node.value)}" if node.value else ""
            name, shape = ast.unparse(node.target), f"{ast.unparse(node.target)}: {ast.unparse(node.annotation)}{given}"
        elif isinstance(node, ast.Assign):
            name, shape = ast.unparse(node.targets[0]), ast.unparse(node)
        else:
            continue
        if not name.startswith("_"):
            shown.append(f"- `{shape}`\n\n{plain(below.value.value, '  ')}\n")
    return shown


def described(name: str, node: ast.ClassDef | ast.FunctionDef, level: str = "##") -> str:
    """One section."""
    if isinstance(node, ast.FunctionDef):
        return f"{level} {name}\n\n```text\n{signature(node)}\n```\n\n{doc(node)}\n"
    text = f"{level} {name}\n\n{doc(node)}\n"
    text += "".join(f"\n{field}" for field in fields(node.body))
    for member in node.body:
        if not isinstance(member, ast.FunctionDef) or (member.name.startswith("_") and member.name != "__init__"):
            continue
        shown = member.name if is_property(member) else signature(member).replace("__init__", name, 1)
        if is_property(member) and member.returns:
            shown += f": {ast.unparse(member.returns)}"
        text += f"\n- `{shown}`\n\n{doc(member, '  ')}\n"
    return text


def module(name: str) -> str:
    """The section of a module: its docstring, names of types, and classes; typed dictionaries with their keys."""
    tree = ast.parse((PACKAGE / f"{name}.py").read_text(encoding="utf-8"))
    text = f"## taut.{name}\n\n{doc(tree)}\n"
    text += "".join(f"\n{field}" for field in fields(tree.body))
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            text += "\n" + described(f"taut.{name}.{node.name}", node, "###")
            keys = [ast.unparse(field) for field in node.body if isinstance(field, ast.AnnAssign)]
            if any(ast.unparse(base) == "TypedDict" for base in node.bases):
                text += "\n```text\n" + "\n".join(keys) + "\n```\n"
    return text


def main() -> None:
    """Prints all sections in the order of ``__all__``."""
    found: dict[str, ast.ClassDef | ast.FunctionDef] = {}
    for path in [*sorted(PACKAGE.glob("*.py")), *sorted(PACKAGE.glob("*.pyi"))]:
        for name, node in definitions(path).items():
            found.setdefault(name, node)
    for name in exported():
        if (PACKAGE / f"{name}.py").is_file():
            print(module(name))
        elif name in found:
            print(described(name, found[name]))


if __name__ == "__main__":
    main()
