"""The public surface: what ``__all__`` names is there, documented, and nothing else."""

import inspect
from types import ModuleType

import pytest

import hydrodamp as hd


def test_all_is_what_is_importable():
    public = {name for name in dir(hd) if not name.startswith("_")}
    assert public == set(hd.__all__) - {"__version__"}
    for name in hd.__all__:
        assert getattr(hd, name) is not None


def test_no_module_leaks_into_the_surface():
    assert not [n for n in hd.__all__ if isinstance(getattr(hd, n), ModuleType)]


@pytest.mark.parametrize("name", sorted(hd.__all__))
def test_every_public_class_and_function_is_documented(name):
    value = getattr(hd, name)
    if inspect.isclass(value) or inspect.isfunction(value):
        assert (value.__doc__ or "").strip().endswith((".", "```")) or "\n" in value.__doc__
        assert not value.__doc__.startswith(f"{name}(")  # the text a dataclass writes itself


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = hd.no_such_name
