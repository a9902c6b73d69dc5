"""Every public name says what it is, with an example that runs (the doctests)."""

import inspect

import pytest

import ndof


def documented():
    for name in ndof.__all__:
        thing = getattr(ndof, name)
        if name.startswith("__"):
            continue
        yield name, thing
        if inspect.isclass(thing):
            for member, value in vars(thing).items():
                if not member.startswith("_") and (isinstance(value, (property, classmethod)) or inspect.isfunction(value)):
                    yield f"{name}.{member}", value


@pytest.mark.parametrize("name, thing", list(documented()))
def test_every_public_name_has_a_docstring_with_an_example(name, thing):
    text = inspect.getdoc(thing)
    assert text and (text.split("\n\n")[0].rstrip(".:") != "")
    assert ">>> " in text, f"{name} has no example"


def test_all_is_all():
    public = {name for name in vars(ndof) if not name.startswith("_") and not inspect.ismodule(getattr(ndof, name))}
    assert public == {name for name in ndof.__all__ if not name.startswith("__")}
