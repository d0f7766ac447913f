"""Without the compiled core NumPy takes over, with one warning at first use."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import warnings

import numpy as np
import pytest

import hydrodamp.kernels
from hydrodamp.errors import FallbackWarning
from hydrodamp.kernels import reference
from hydrodamp.kernels.notice import Notice

WITHOUT_CORE = """
import sys, warnings
sys.modules["hydrodamp.kernels._core"] = None
import numpy as np
from hydrodamp import kernels
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    kernels.coriolis(np.eye(6), np.ones((1, 6)))
    kernels.coriolis(np.eye(6), np.ones((1, 6)))
    kernels.regressor([[1, 0, 0, 0]], *[np.ones((1, k)) for k in (6, 3, 0)], np.ones(1))
print(kernels.COMPILED, [item.category.__name__ for item in caught], caught[0].filename)
"""


def test_the_package_picks_the_reference_and_warns_once():
    command = [sys.executable, "-W", "error", "-c", WITHOUT_CORE]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[0] == "False ['FallbackWarning'] <string>"
    assert done.stderr == ""


def test_the_choice_is_made_at_import(monkeypatch):
    monkeypatch.setitem(sys.modules, "hydrodamp.kernels._core", None)
    monkeypatch.delitem(sys.modules, "hydrodamp.kernels.compiled", raising=False)
    monkeypatch.delattr(hydrodamp.kernels, "_core", raising=False)
    spec = importlib.util.spec_from_file_location("kernels_again", hydrodamp.kernels.__file__)
    again = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(again)
    assert again.COMPILED is False
    assert again.replay.__wrapped__ is reference.replay


def test_the_fallback_offers_every_kernel():
    from hydrodamp.kernels import fallback

    for name in reference.__all__:
        assert getattr(fallback, name).__wrapped__ is getattr(reference, name)
        assert callable(getattr(hydrodamp.kernels, name))


def test_a_notice_is_given_once_and_says_what_to_do():
    notice = Notice()
    noticed = notice.before(reference.coriolis)
    with pytest.warns(FallbackWarning, match=r"Install a C and C\+\+ compiler, then reinstall"):
        noticed(np.eye(6), np.ones((1, 6)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        noticed(np.eye(6), np.ones((1, 6)))
