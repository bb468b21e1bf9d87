import os
import stat
import sys

import pytest

HERE = os.path.dirname(os.path.abspath(__file__))


@pytest.fixture(autouse=True, scope="session")
def package_for_subprocesses():
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.path.dirname(HERE))
        yield


@pytest.fixture(scope="session")
def fake(tmp_path_factory):
    """Path of a program that behaves like lk-emu."""
    path = tmp_path_factory.mktemp("fake") / "lk-emu"
    path.write_text(f'#!/bin/sh\nexec {sys.executable} -S {HERE}/fake_lk_emu.py "$@"\n')
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)
