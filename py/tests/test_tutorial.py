"""The code of the documents runs, and gives what they show."""

import doctest
import re

import pytest

import taut

DOCUMENTS = ["docs/python.md"]


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_block_gives_what_it_shows(root, tmp_path, monkeypatch, document):
    for package in "polars", "pyarrow", "matplotlib", "control":
        pytest.importorskip(package)
    text = (root / document).read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```pycon\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    assert len(blocks) >= 8
    # One session from the first block to the last.
    source = "\n".join(blocks)
    test = doctest.DocTestParser().get_doctest(source, {"ROOT": root}, document, document, 0)
    assert len(test.examples) >= 20
    told = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    runner.run(test, out=told.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(told)


@pytest.mark.parametrize("document, output", [("python.md", "python_cost.txt"), ("scale.md", "scale.txt")])
def test_what_is_measured_is_the_output_of_its_script(root, document, output):
    measured = (root / "authorities" / "output" / output).read_text(encoding="utf-8")
    assert measured in (root / "docs" / document).read_text(encoding="utf-8")


@pytest.mark.parametrize("module", [taut, taut.controllers])
def test_docstrings_of_the_package(module):
    assert doctest.testmod(module, optionflags=doctest.ELLIPSIS).failed == 0


def test_everything_has_a_docstring():
    missing = [
        f"{name}.{member}"
        for name in taut.__all__
        if name != "__version__"
        for member in [None, *vars(getattr(taut, name))]
        if (member is None or not member.startswith("_"))
        and not (getattr(taut, name) if member is None else getattr(getattr(taut, name), member)).__doc__
    ]
    # Names of types in `types` have a string below them, which Python does not keep.
    fields = {"Estimate", "Fit", "Check", "LinearModel", "Modes", "controllers", "moves", "types"}
    assert [entry for entry in missing if entry.split(".")[0] not in fields] == []
