"""The stubs describe the compiled module."""

import ast
from pathlib import Path

import zsim
from zsim import _zsim


def public(names):
    return {name for name in names if not name.startswith("_")}


def stubs():
    """The names of the module, and of each class its members."""
    tree = ast.parse((Path(zsim.__file__).parent / "_zsim.pyi").read_text())
    functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    members = {
        name: {member.name for member in node.body if isinstance(member, ast.FunctionDef)}
        for name, node in classes.items()
    }
    return functions, members


def test_the_stubs_have_every_name_and_no_other():
    functions, classes = stubs()
    assert public(dir(_zsim)) == functions | classes.keys()
    for name, members in classes.items():
        if issubclass(getattr(_zsim, name), Exception):
            continue
        assert public(vars(getattr(_zsim, name))) == public(members), name


def test_every_public_name_has_a_docstring():
    for name in zsim.__all__:
        documented = getattr(zsim, name)
        assert documented.__doc__, name
        if isinstance(documented, type) and not issubclass(documented, Exception):
            for member in public(vars(documented)):
                assert getattr(documented, member).__doc__, f"{name}.{member}"


def test_the_package_is_typed():
    assert (Path(zsim.__file__).parent / "py.typed").exists()
