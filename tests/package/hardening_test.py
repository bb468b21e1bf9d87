#!/usr/bin/env python3
"""Checks that the program has the features of cmake/Hardening.cmake. The program is shared or static, and has symbols.

usage: hardening_test.py LK_EMU
"""

import functools
import platform
import re
import subprocess
import sys
import unittest

PROGRAM = sys.argv.pop(1)


@functools.lru_cache
def read(*command):
    return subprocess.run([*command, PROGRAM], check=True, stdout=subprocess.PIPE, text=True).stdout


class Hardening(unittest.TestCase):
    def assert_calls(self, function):
        """Checks the imports of a shared program, or the calls in a static one."""
        if "INTERP" in read("readelf", "-lW"):
            self.assertRegex(read("readelf", "--dyn-syms", "-W"), rf" \w*{function}\w*@")
        else:
            self.assertRegex(read("objdump", "-d"), rf"(call|jmp|bl|b)\s.*<\w*{function}\w*>")

    def test_program_is_position_independent(self):
        self.assertIn("DYN", re.search(r"Type: .*", read("readelf", "-hW")).group())

    def test_relocations_are_read_only(self):
        self.assertIn("GNU_RELRO", read("readelf", "-lW"))
        self.assertRegex(read("readelf", "-dW"), r"BIND_NOW|FLAGS_1.*NOW")

    def test_stack_is_not_executable(self):
        self.assertRegex(read("readelf", "-lW"), r"GNU_STACK.* RW ")

    def test_stack_is_protected(self):
        self.assert_calls("__stack_chk_fail")

    def test_libc_calls_check_buffers(self):
        self.assert_calls(r"__[a-z]+_chk")

    def test_libstdcxx_checks_indices(self):
        self.assert_calls("__glibcxx_assert_fail")

    @unittest.skipUnless(platform.machine() == "x86_64", "of other processors")
    def test_indirect_branches_have_landing_pads(self):
        # If the C library's start files lack the note, the linker omits it, so count instructions.
        self.assertGreater(read("objdump", "-d").count("endbr64"), 1000)


if __name__ == "__main__":
    unittest.main()
