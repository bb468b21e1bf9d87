#!/usr/bin/python3
"""How lk-emu starts its commands in Python, and what it says when something is missing.

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
        """The program without its files."""
        os.makedirs(os.path.join(self.directory, "bin"), exist_ok=True)
        return shutil.copy(PROGRAM, os.path.join(self.directory, "bin/lk-emu"))

    def plot(self, program, *arguments, **environment):
        return subprocess.run([program, "plot", *arguments], cwd=self.directory, capture_output=True, text=True, timeout=60,
                              env={"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8", **environment})

    def refused(self, *arguments, **environment):
        ran = self.plot(*arguments, **environment)
        self.assertEqual((ran.returncode, ran.stdout, ran.stderr.count("\n")), (2, "", 1), ran)
        return ran.stderr

    def test_takes_the_package_of_the_sources_and_the_first_python_of_the_path(self):
        stand_in = self.put("path/python3", STAND_IN)
        ran = self.plot(PROGRAM, "a b.csv", "--ids", "1", PATH=f"{self.directory}/path:/usr/bin")
        self.assertEqual(ran.stdout.splitlines(), [stand_in, PROGRAM, "plot", "lkemu.plot", f"{SOURCES}/python", "a b.csv", "--ids", "1"])

    def test_takes_the_python_beside_the_program_first(self):
        """As in the virtual environment that a wheel was installed into, which has the package, too."""
        program = self.alone()
        self.put("path/python3", STAND_IN)
        stand_in = self.put("bin/python3", STAND_IN)
        ran = self.plot(program, "run.csv", PATH=f"{self.directory}/path:/usr/bin")
        self.assertEqual(ran.stdout.splitlines(), [stand_in, program, "plot", "lkemu.plot", "", "run.csv"])

    def test_takes_the_package_of_the_installation(self):
        program = self.alone()
        self.put("share/lk-emu/python/lkemu/__init__.py", "")
        self.put("share/lk-emu/python/lkemu/plot.py", "import sys\nprint(__name__, sys.argv[1:])\n")
        self.assertEqual(self.plot(program, "run.csv").stdout, "__main__ ['run.csv']\n")

    def test_reads_no_module_of_the_working_directory(self):
        self.put("argparse.py", "print('shadowed')")
        self.put("lkemu/__init__.py", "print('shadowed')")
        self.assertNotIn("shadowed", self.plot(PROGRAM, "none.csv").stdout)

    def test_says_what_is_missing(self):
        self.assertIn("FILE is required", self.refused(PROGRAM))
        self.assertEqual(self.refused(PROGRAM, "run.csv", PATH=self.directory), "lk-emu: plot: python3: No such file or directory: apt install python3\n")
        self.assertEqual(self.refused(self.alone(), "run.csv"),
                         "lk-emu: plot: needs the Python package lkemu, which /usr/bin/python3 does not have: install the .deb or the "
                         "wheel of lk-emu, or keep share/lk-emu of the tarball beside bin\n")
        self.put("old/sitecustomize.py", "import sys\nsys.version_info = (3, 9, 2)\n")
        self.assertEqual(self.refused(PROGRAM, "run.csv", PYTHONPATH=f"{self.directory}/old"),
                         "lk-emu: plot: needs Python 3.11 or newer; /usr/bin/python3 is 3.9\n")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
