"""Builds the wheel for pip (PEP 517 and 660) with the standard library alone.

If the package is in an installation with a static lk-emu (docs/start/install.md, the tarball), the wheel contains that
program with its files and is platform-specific. Otherwise it contains only the package.
"""

import base64
import hashlib
import os
import re
import struct
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
PACKAGE, NAME = "lkemu", "lk_emu"
PLACE = os.path.join("share", "lk-emu", "python")  # below the prefix of an installation
# Below share/: files that the program uses, its manual, and its licences. Without share/lk-emu/python, the package.
DATA = ("lk-emu/motors", "lk-emu/buses", "lk-emu/scenarios", "lk-emu/campaigns", "doc/lk-emu/licenses",
        "doc/lk-emu/LICENSE", "doc/lk-emu/lk-emu.spdx.json")  # fmt: skip
MANUAL = "man/man1"  # installed only if help2man is available
# As in Debian 12; matplotlib brings numpy.
EXTRAS = {"campaign": ["jinja2 >=3.1", "regex", "scipy >=1.10"], "identify": ["matplotlib >=3.6", "numpy >=1.24", "scipy >=1.10"], "plot": ["matplotlib >=3.6"]}
EXTRAS["campaign-dask"] = [*EXTRAS["campaign"], "distributed >=2022.12"]
PT_INTERP = 3
MACHINES = {62: "x86_64", 183: "aarch64"}  # e_machine of ELF, and pip's name for it
EXECUTABLE, READABLE = 0o100755, 0o100644
# Style sheet of the reports: installed place, and place in the sources, which pip before 21.3 omits.
STYLE_SHEET, DASHBOARD_STYLE = f"{PACKAGE}/style.css", os.path.join(HERE, "..", "web", "style.css")


def version():
    with open(os.path.join(HERE, PACKAGE, "__init__.py"), encoding="utf-8") as file:
        return re.search(r'^__version__ = "(.+)"', file.read(), re.MULTILINE)[1]


def read(path):
    with open(path, "rb") as file:
        return file.read()


def machine_of(program):
    """Returns pip's name of the machine for a static 64-bit ELF program (no dynamic linker); None for other files."""
    try:
        if program[:6] != b"\x7fELF\x02\x01":
            return None
        (machine,) = struct.unpack_from("<H", program, 18)
        (table,) = struct.unpack_from("<Q", program, 32)
        size, count = struct.unpack_from("<HH", program, 54)
        kinds = [struct.unpack_from("<I", program, table + n * size)[0] for n in range(count)]
    except struct.error:
        return None
    return None if PT_INTERP in kinds else MACHINES.get(machine)


def tag(machine):
    """Returns the wheel's tag. A static program needs no glibc, so the tag names the oldest glibc in pip's policies."""
    return f"py3-none-manylinux_2_17_{machine}" if machine else "py3-none-any"


def about(machine):
    """Returns the files of the .dist-info directory; `machine` is that of the program, None without a program."""
    extras = "".join(
        f"Provides-Extra: {extra}\n" + "".join(f"Requires-Dist: {library}; extra == '{extra}'\n" for library in libraries)
        for extra, libraries in EXTRAS.items()
    )
    return {
        "METADATA": f"""Metadata-Version: 2.1
Name: {NAME.replace("_", "-")}
Version: {version()}
Summary: Virtual LK-TECH servo drives for tests in Python: starts lk-emu, injects faults, steps its clock
License: MIT
Requires-Python: >=3.9
Classifier: Framework :: Pytest
Classifier: Operating System :: POSIX :: Linux
Classifier: Typing :: Typed
{extras}""",
        "WHEEL": f"""Wheel-Version: 1.0
Generator: lkemu_wheel
Root-Is-Purelib: {str(not machine).lower()}
Tag: {tag(machine)}
""",
        # Named like the module, so that pytest_plugins = ["lkemu.pytest_plugin"] does not register it twice.
        "entry_points.txt": "[pytest11]\nlkemu.pytest_plugin = lkemu.pytest_plugin\n",
    }


def pack(directory, files, program=None, machine=None):
    """Writes a wheel of the files {name: bytes}, the metadata, and {name: bytes} of a program. Returns its name.

    Reproducible: equal input gives equal bytes."""
    label = f"{NAME}-{version()}"
    files = {**files, **{f"{label}.dist-info/{name}": text.encode() for name, text in about(machine).items()}}
    for path, data in (program or {}).items():
        files[f"{label}.data/{path}"] = data
    record = f"{label}.dist-info/RECORD"
    lines = ""
    for path, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        lines += f"{path},sha256={digest},{len(data)}\n"
    files[record] = f"{lines}{record},,\n".encode()
    name = f"{label}-{tag(machine)}.whl"
    with zipfile.ZipFile(os.path.join(directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, data in files.items():
            entry = zipfile.ZipInfo(path)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (EXECUTABLE if ".data/scripts/" in path else READABLE) << 16
            wheel.writestr(entry, data)
    return name


def files_below(top, place):
    """Returns {path relative to top: bytes} of a file, or of a directory and all below it."""
    path = os.path.join(top, place)
    if os.path.isfile(path):
        return {place: read(path)}
    found = {}
    for name in sorted(os.listdir(path)):
        found.update(files_below(top, f"{place}/{name}"))
    return found


def installed_program():
    """Returns the files for the wheel's .data directory and their machine; ({}, None) if there is no static program.

    An lk-emu found above a checkout may have another version and lack these files, so it does not count."""
    if not HERE.endswith(os.sep + PLACE):
        return {}, None
    prefix = HERE[: -len(PLACE)]
    program = os.path.join(prefix, "bin", "lk-emu")
    if not os.path.isfile(program) or (machine := machine_of(read(program))) is None:
        return {}, None
    files = {"scripts/lk-emu": read(program)}
    share = os.path.join(prefix, "share")
    for place in (*DATA, MANUAL) if os.path.isdir(os.path.join(share, MANUAL)) else DATA:
        files.update({f"data/share/{path}": data for path, data in files_below(share, place).items()})
    return files, machine


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    files = {name: data for name, data in files_below(HERE, PACKAGE).items() if not name.endswith(".pyc")}
    if STYLE_SHEET not in files and os.path.isfile(DASHBOARD_STYLE):
        files[STYLE_SHEET] = read(DASHBOARD_STYLE)
    return pack(wheel_directory, files, *installed_program())


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    return pack(wheel_directory, {f"{PACKAGE}.pth": (HERE + "\n").encode()})


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("the source is the repository")
