"""What pip gets, without network, setuptools and wheel."""

import os
import shutil
import subprocess
import sys

import lkemu

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def test_the_wheel_has_package_and_plugin(tmp_path):
    wheels = tmp_path / "wheels"
    wheels.mkdir()
    source = shutil.copytree(ROOT, tmp_path / "source", ignore=shutil.ignore_patterns("__pycache__"))
    program = f"import lkemu_wheel; print(lkemu_wheel.build_wheel({str(wheels)!r}))"
    name = subprocess.run([sys.executable, "-c", program], cwd=source, check=True, capture_output=True, text=True).stdout
    site = tmp_path / "site"
    shutil.unpack_archive(wheels / name.strip(), site, "zip")
    environment = {**os.environ, "PYTHONPATH": str(site)}
    look = "import importlib.metadata as m, lkemu; print(lkemu.__file__, [e.value for e in m.distribution('lkemu').entry_points])"
    said = subprocess.run([sys.executable, "-c", look], cwd=tmp_path, env=environment, check=True, capture_output=True, text=True)
    assert said.stdout == f"{site}/lkemu/__init__.py ['lkemu.pytest_plugin']\n"
    assert (site / "lkemu" / "py.typed").exists()


def test_the_package_has_the_version_of_the_program():
    with open(os.path.join(ROOT, "..", "CMakeLists.txt"), encoding="utf-8") as file:
        assert f"project(lk-emu VERSION {lkemu.__version__} " in file.read()
