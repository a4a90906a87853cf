"""Guards the types: every name of the extension stands in the stubs, and none that is not there."""

import ast
import pathlib

import anhyst
from anhyst import _native


def stubs():
    tree = ast.parse(pathlib.Path(anhyst.__file__).with_name("_native.pyi").read_text())
    told = {}
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            told[node.name] = {own.name for own in node.body if isinstance(own, ast.FunctionDef)}
        elif isinstance(node, ast.FunctionDef):
            told[node.name] = None
    return told


def public(of):
    return {name for name in vars(of) if not name.startswith("_")}


def test_stubs_and_extension_have_the_same_names():
    told = stubs()
    assert public(_native) == set(told)
    for name, methods in told.items():
        if methods is not None and name not in ("BadInput", "ProcessFailed"):
            named = {method for method in methods if not method.startswith("_")}
            assert public(getattr(_native, name)) == named, name


def test_everything_public_says_what_it_is():
    for name in anhyst.__all__:
        own = getattr(anhyst, name)
        if name != "__version__":
            assert own.__doc__, name
        if isinstance(own, type) and own.__module__ == "anhyst":
            for method in public(own):
                assert getattr(own, method).__doc__, f"{name}.{method}"
