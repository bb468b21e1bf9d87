"""Packs the package for pip (PEP 517 and 660) with the standard library alone."""

import base64
import hashlib
import os
import re
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
PACKAGE = "lkemu"


def version():
    with open(os.path.join(HERE, PACKAGE, "__init__.py"), encoding="utf-8") as file:
        return re.search(r'^__version__ = "(.+)"', file.read(), re.MULTILINE)[1]


def about():
    """Files of the .dist-info directory."""
    return {
        "METADATA": f"""Metadata-Version: 2.1
Name: {PACKAGE}
Version: {version()}
Summary: Virtual LK-TECH servo drives for tests in Python: starts lk-emu, injects faults, steps its clock
License: MIT
Requires-Python: >=3.9
Classifier: Framework :: Pytest
Classifier: Operating System :: POSIX :: Linux
Classifier: Typing :: Typed
""",
        "WHEEL": "Wheel-Version: 1.0\nGenerator: lkemu_wheel\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        # Called like the module, so that pytest_plugins = ["lkemu.pytest_plugin"] beside it does no harm.
        "entry_points.txt": "[pytest11]\nlkemu.pytest_plugin = lkemu.pytest_plugin\n",
    }


def pack(directory, files):
    """A wheel of the files {name: bytes} and the metadata; its name."""
    info = f"{PACKAGE}-{version()}.dist-info"
    files = {**files, **{f"{info}/{name}": text.encode() for name, text in about().items()}}
    record = ""
    name = f"{PACKAGE}-{version()}-py3-none-any.whl"
    with zipfile.ZipFile(os.path.join(directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, data in files.items():
            wheel.writestr(path, data)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record += f"{path},sha256={digest},{len(data)}\n"
        wheel.writestr(f"{info}/RECORD", record + f"{info}/RECORD,,\n")
    return name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    files = {}
    for name in sorted(os.listdir(os.path.join(HERE, PACKAGE))):
        if name.endswith((".py", "py.typed")):
            with open(os.path.join(HERE, PACKAGE, name), "rb") as file:
                files[f"{PACKAGE}/{name}"] = file.read()
    return pack(wheel_directory, files)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    return pack(wheel_directory, {f"{PACKAGE}.pth": (HERE + "\n").encode()})


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("the source is the repository")
