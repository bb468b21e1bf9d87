#!/usr/bin/python3
"""Tests how lk-emu starts its commands in Python, and its messages if a file, library or Python is missing.

usage: python_package_test.py LK_EMU
"""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM = os.path.abspath(sys.argv[1])
SOURCES = os.path.realpath(os.path.join(os.path.dirname(__file__), "../.."))
STAND_IN = '#!/bin/sh\nprintf "%s\\n" "$0" "$LKEMU"\nshift 3\nprintf "%s\\n" "$@"\n'  # -B -c SCRIPT go


class Start(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.directory = os.path.realpath(scratch.name)

    def put(self, name, text):
        path = os.path.join(self.directory, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(path, 0o755)
        return path

    def alone(self):
        """Returns a copy of the program without its files."""
        os.makedirs(os.path.join(self.directory, "bin"), exist_ok=True)
        return shutil.copy(PROGRAM, os.path.join(self.directory, "bin/lk-emu"))

    def package(self, **modules):
        """Creates the package of an installation, with these modules in addition or instead of its own."""
        place = os.path.join(self.directory, "share/lk-emu/python/lkemu")
        os.makedirs(place)
        for name in ("command.py", "errors.py"):
            shutil.copy(f"{SOURCES}/python/lkemu/{name}", place)
        for name, text in {"__init__": "", **modules}.items():
            self.put(f"share/lk-emu/python/lkemu/{name}.py", text)

    def start(self, program, command, *arguments, **environment):
        return subprocess.run([program, command, *arguments], cwd=self.directory, capture_output=True, text=True, timeout=60,
                              env={"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8", **environment})

    def plot(self, program, *arguments, **environment):
        return self.start(program, "plot", *arguments, **environment)

    def refused(self, *arguments, command="plot", **environment):
        ran = self.start(arguments[0], command, *arguments[1:], **environment)
        self.assertEqual((ran.returncode, ran.stdout, ran.stderr.count("\n")), (2, "", 1), ran)
        return ran.stderr

    def test_uses_the_package_of_the_sources_and_the_first_python_in_path(self):
        stand_in = self.put("path/python3", STAND_IN)
        ran = self.plot(PROGRAM, "a b.csv", "--ids", "1", PATH=f"{self.directory}/path:/usr/bin")
        self.assertEqual(ran.stdout.splitlines(), [stand_in, PROGRAM, "plot", "lkemu.plot", f"{SOURCES}/python", "a b.csv", "--ids", "1"])

    def test_prefers_the_python_next_to_the_program(self):
        """Like a virtual environment into which the wheel with the program and the package was installed."""
        program = self.alone()
        self.put("path/python3", STAND_IN)
        stand_in = self.put("bin/python3", STAND_IN)
        ran = self.plot(program, "run.csv", PATH=f"{self.directory}/path:/usr/bin")
        self.assertEqual(ran.stdout.splitlines(), [stand_in, program, "plot", "lkemu.plot", "", "run.csv"])

    def test_uses_the_package_of_the_installation(self):
        program = self.alone()
        self.package(plot="import sys\nprint(__name__, sys.argv[1:])\n")
        self.assertEqual(self.plot(program, "run.csv").stdout, "__main__ ['run.csv']\n")

    def test_child_processes_find_the_package(self):
        program = self.alone()
        self.package(plot="import subprocess, sys\nsubprocess.run([sys.executable, '-m', 'lkemu.worker'], cwd='/')\n",
                     worker="import os, sys\nprint(sys.path[1:3], os.environ['PYTHONPATH'])\n")
        places = [f"{self.directory}/share/lk-emu/python", "/nowhere"]
        self.assertEqual(self.plot(program, "run.csv", PYTHONPATH="/nowhere").stdout, f"{places} {':'.join(places)}\n")
        self.assertEqual(self.plot(program, "run.csv").stdout.split()[-1], places[0])

    def test_ignores_modules_in_the_working_directory(self):
        self.put("argparse.py", "print('shadowed')")
        self.put("lkemu/__init__.py", "print('shadowed')")
        self.assertNotIn("shadowed", self.plot(PROGRAM, "none.csv").stdout)

    def test_names_what_is_missing(self):
        self.assertIn("FILE is required", self.refused(PROGRAM))
        self.assertEqual(self.refused(PROGRAM, "run.csv", PATH=self.directory), "lk-emu: plot: python3: No such file or directory: apt install python3\n")
        self.assertEqual(self.refused(self.alone(), "run.csv"),
                         "lk-emu: plot: needs the Python package lkemu, which /usr/bin/python3 does not have: install the .deb or the "
                         "wheel of lk-emu, or keep share/lk-emu of the tarball beside bin\n")
        self.put("old/sitecustomize.py", "import sys\nsys.version_info = (3, 9, 2)\n")
        self.assertEqual(self.refused(PROGRAM, "run.csv", PYTHONPATH=f"{self.directory}/old"),
                         "lk-emu: plot: needs Python 3.11 or newer; /usr/bin/python3 is 3.9\n")

    def test_campaign_names_all_missing_libraries_before_it_starts(self):
        self.put("lib/sitecustomize.py", "import sys\nsys.path = [place for place in sys.path if not place.endswith('-packages')]\n")
        self.assertEqual(self.refused(PROGRAM, "every_fault", command="campaign", PYTHONPATH=f"{self.directory}/lib"),
                         "lk-emu: campaign: /usr/bin/python3: No module named 'jinja2', 'regex', 'scipy': apt install python3-jinja2 "
                         "python3-regex python3-scipy, or pip install 'lk-emu[campaign]'\n")
        self.assertEqual(os.listdir(self.directory), ["lib"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
