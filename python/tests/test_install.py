"""Tests the wheel for pip, without network, setuptools and wheel."""

import os
import pathlib
import shutil
import struct
import subprocess
import sys
import zipfile

import lkemu
from lkemu.command import LIBRARIES

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PT_LOAD, PT_INTERP = 1, 3


def build(source, directory):
    """Builds the wheel; returns its path."""
    directory.mkdir()
    program = f"import lkemu_wheel; print(lkemu_wheel.build_wheel({str(directory)!r}))"
    done = subprocess.run([sys.executable, "-B", "-c", program], cwd=source, check=True, capture_output=True, text=True)
    return directory / done.stdout.strip()


def copy_source(place):
    return shutil.copytree(ROOT, place, ignore=shutil.ignore_patterns("__pycache__"))


def elf(*kinds, machine=62):
    """Makes the start of an ELF program: header, and program headers of these kinds (static or not)."""
    head = b"\x7fELF\x02\x01\x01" + bytes(9) + struct.pack("<HHIQQQIHHHHHH", 3, machine, 1, 0, 64, 0, 0, 64, 56, len(kinds), 0, 0, 0)
    return head + b"".join(struct.pack("<I52x", kind) for kind in kinds)


def install(prefix, program):
    """Creates the files of cmake --install that the wheel uses."""
    for path, data in {
        "bin/lk-emu": program,
        "share/lk-emu/motors/mf7015.toml": b"motor",
        "share/lk-emu/buses/quadruped.toml": b"bus",
        "share/lk-emu/scenarios/stall.toml": b"scenario",
        "share/lk-emu/campaigns/every_fault.toml": b"plan",
        "share/man/man1/lk-emu.1": b"manual",
        "share/doc/lk-emu/licenses/glibc": b"LGPL",
        "share/doc/lk-emu/LICENSE": b"MIT",
        "share/doc/lk-emu/lk-emu.spdx.json": b"{}",
    }.items():
        (prefix / path).parent.mkdir(parents=True, exist_ok=True)
        (prefix / path).write_bytes(data)
    return copy_source(prefix / "share" / "lk-emu" / "python")


def test_wheel_has_package_and_plugin(tmp_path):
    wheel = build(copy_source(tmp_path / "source"), tmp_path / "wheels")
    assert wheel.name == f"lk_emu-{lkemu.__version__}-py3-none-any.whl"
    site = tmp_path / "site"
    shutil.unpack_archive(wheel, site, "zip")
    environment = {**os.environ, "PYTHONPATH": str(site)}
    look = "import importlib.metadata as m, lkemu; print(lkemu.__file__, [e.value for e in m.distribution('lk-emu').entry_points])"
    said = subprocess.run([sys.executable, "-c", look], cwd=tmp_path, env=environment, check=True, capture_output=True, text=True)
    assert said.stdout == f"{site}/lkemu/__init__.py ['lkemu.pytest_plugin']\n"
    assert (site / "lkemu" / "py.typed").exists()
    look = "import importlib.metadata as m; print(m.metadata('lk-emu').get_all('Provides-Extra'), m.requires('lk-emu'))"
    said = subprocess.run([sys.executable, "-c", look], cwd=tmp_path, env=environment, check=True, capture_output=True, text=True)
    extras, libraries = said.stdout.split("] [")
    assert "'campaign'" in extras and "'identify'" in extras and "'plot'" in extras
    assert "\"distributed >=2022.12; extra == 'campaign-dask'\"" in libraries
    assert all(f"\"{name}" in libraries for name in LIBRARIES["campaign"]), libraries
    assert """"scipy >=1.10; extra == 'identify'\"""" in libraries and """"matplotlib >=3.6; extra == 'plot'\"""" in libraries


def test_wheel_has_every_file_of_the_package(tmp_path):
    """Includes templates of pages, the style sheet, and the script of identify --plan."""
    with zipfile.ZipFile(build(ROOT, tmp_path / "wheels")) as packed:
        names = {name for name in packed.namelist() if name.startswith("lkemu/")}
        style = packed.read("lkemu/style.css")
    package = pathlib.Path(ROOT, "lkemu")
    there = {f"lkemu/{file.relative_to(package)}" for file in package.rglob("*") if file.is_file() and "__pycache__" not in file.parts}
    assert names == there | {"lkemu/style.css"}
    assert "lkemu/campaign/templates/page.html.j2" in names
    assert style == pathlib.Path(ROOT, "../web/style.css").read_bytes()


def test_wheel_contains_a_static_program(tmp_path):
    source = install(tmp_path / "prefix", elf(PT_LOAD, PT_LOAD))
    wheel = build(source, tmp_path / "wheels")
    assert wheel.name == f"lk_emu-{lkemu.__version__}-py3-none-manylinux_2_17_x86_64.whl"
    with zipfile.ZipFile(wheel) as packed:
        program = packed.getinfo(f"lk_emu-{lkemu.__version__}.data/scripts/lk-emu")
        assert packed.read(program) == elf(PT_LOAD, PT_LOAD) and program.external_attr >> 16 == 0o100755
        shares = {name.partition(".data/data/share/")[2] for name in packed.namelist() if ".data/data/" in name}
        assert b"Root-Is-Purelib: false\n" in packed.read(f"lk_emu-{lkemu.__version__}.dist-info/WHEEL")
    assert shares == {
        "lk-emu/motors/mf7015.toml", "lk-emu/buses/quadruped.toml", "lk-emu/scenarios/stall.toml", "lk-emu/campaigns/every_fault.toml", "man/man1/lk-emu.1",
        "doc/lk-emu/licenses/glibc", "doc/lk-emu/LICENSE", "doc/lk-emu/lk-emu.spdx.json",
    }  # fmt: skip
    assert build(source, tmp_path / "again").read_bytes() == wheel.read_bytes()


def test_wheel_needs_no_manual_page(tmp_path):
    source = install(tmp_path / "prefix", elf(PT_LOAD))
    shutil.rmtree(tmp_path / "prefix" / "share" / "man")
    with zipfile.ZipFile(build(source, tmp_path / "wheels")) as packed:
        names = packed.namelist()
    assert any(name.endswith("/scripts/lk-emu") for name in names)
    assert not any("man1" in name for name in names)


def test_wheel_omits_a_program_with_shared_libraries(tmp_path):
    for number, program in enumerate((elf(PT_LOAD, PT_INTERP), b"#!/bin/sh\n", b"\x7fELF\x02\x01", b"")):
        source = install(tmp_path / f"prefix{number}", program)
        assert build(source, tmp_path / f"wheels{number}").name == f"lk_emu-{lkemu.__version__}-py3-none-any.whl"


def test_wheel_has_the_machine_of_the_program(tmp_path):
    for machine, tag in ((62, "manylinux_2_17_x86_64"), (183, "manylinux_2_17_aarch64"), (243, "any")):
        source = install(tmp_path / f"prefix{machine}", elf(PT_LOAD, machine=machine))
        assert build(source, tmp_path / f"wheels{machine}").name == f"lk_emu-{lkemu.__version__}-py3-none-{tag}.whl"


def test_wheel_omits_a_program_above_a_checkout(tmp_path):
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "lk-emu").write_bytes(elf(PT_LOAD))
    source = copy_source(tmp_path / "src" / "lk-emu" / "python")
    assert build(source, tmp_path / "wheels").name == f"lk_emu-{lkemu.__version__}-py3-none-any.whl"
    install(tmp_path, elf(PT_LOAD))  # an installation with all files, but of another version
    assert build(source, tmp_path / "again").name == f"lk_emu-{lkemu.__version__}-py3-none-any.whl"


def test_package_has_the_version_of_the_program():
    with open(os.path.join(ROOT, "..", "CMakeLists.txt"), encoding="utf-8") as file:
        assert f"project(lk-emu VERSION {lkemu.__version__} " in file.read()
