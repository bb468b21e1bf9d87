#!/usr/bin/python3
"""Compares --help, docs/reference/options.md and the completions with each other.

usage: help_test.py LK_EMU
"""

import os
import re
import subprocess
import sys
import unittest

PROGRAM = os.path.abspath(sys.argv[1])
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../..")
OPTIONS_PAGE = os.path.join(ROOT, "docs/reference/options.md")
BASH = os.path.join(ROOT, "packaging/completions/lk-emu.bash")
CONFIGS = os.path.join(ROOT, "configs")


def delivered(folder):
    """Returns the names of the TOML files in a folder of configs/."""
    return {name[:-5] for name in os.listdir(os.path.join(CONFIGS, folder)) if name.endswith(".toml")}


def output(*command, **kwargs):
    """Returns both output streams of a command, which must succeed."""
    ran = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120, **kwargs)
    assert ran.returncode == 0, (command, ran.returncode, ran.stdout)
    return ran.stdout


def read_help(path):
    """Reads the help of `lk-emu WORD…`: {option: description}, [words]."""
    # The text of an option continues below its first line.
    text = re.sub(r"\n {20,}(?=\S)", " ", output(PROGRAM, *path, "--help"))
    options = {}
    for names, about in re.findall(r"^  (-\S+)(?: \S+(?: \.\.\.)?(?: REQUIRED)?)?  +(\S.*)$", text, re.MULTILINE):
        for name in names.split(","):
            options[name] = about
    words = []
    for title in ("Subcommands:", "Other commands,"):
        block = re.search(rf"^{title}.*\n((?:  .*\n)+)", text, re.MULTILINE)
        # Subcommands inherit the end of the text.
        if block and not (path and title.startswith("Other")):
            words += re.findall(r"^  (\S+)", block[1], re.MULTILINE)
    return options, words


def walk(path=()):
    options, words = read_help(path)
    yield path, options, words
    for word in words:
        yield from walk((*path, word))


EVERYTHING = list(walk())


class Help(unittest.TestCase):
    def test_contains_known_options(self):
        options = {path: options for path, options, _ in EVERYTHING}
        for path, option in [((), "--bus"), (("run",), "--signals"), (("ctl", "fault"), "--for"), (("motors",), "-h")]:
            self.assertIn(option, options[path])
        self.assertGreater(len(options), 18)


    def test_fits_a_terminal(self):
        for path, _, _ in EVERYTHING:
            for line in output(PROGRAM, *path, "--help").splitlines():
                self.assertTrue(len(line) <= 80 or line.startswith("  lk-emu "), (path, line))

    def test_examples_of_the_program_have_ids(self):
        for path, _, _ in EVERYTHING:
            for example in re.findall(r"lk-emu --bus .*", output(PROGRAM, *path, "--help")):
                self.assertIn("--ids", example)

    def test_describes_each_word_of_ctl_itself(self):
        texts = {path[1]: output(PROGRAM, *path, "--help") for path, _, _ in EVERYTHING if path[:1] == ("ctl",) and path[1:]}
        for word, text in texts.items():
            self.assertIn("Takes --socket, --bus, --json and --lang of lk-emu ctl too.", text)
            for example in re.findall(r"^  lk-emu .*", text, re.MULTILINE):
                self.assertIn(f"lk-emu ctl {word} ", example)
            for about in re.findall(r"^  [A-Z][A-Z=]+(?: \S+)*?  +(\S.*)$", text, re.MULTILINE):
                self.assertRegex(about, "[a-z]", word)
        self.assertIn("--ids 1-2 --for 2s", texts["fault"])
        self.assertIn("docs/reference/events.md", texts["set"])
        self.assertNotIn("--bus vcan0", output(PROGRAM, "motors", "--help"))


class OptionsPage(unittest.TestCase):
    def test_has_the_options_and_commands_of_the_program(self):
        with open(OPTIONS_PAGE, encoding="utf-8") as file:
            keys = [re.split(r"[` ]", line)[2:4] for line in file if line.startswith("| `")]
        options, words = read_help(())
        self.assertEqual({first for first, _ in keys if first.startswith("-")}, {o for o in options if o.startswith("--")})
        self.assertEqual({second for first, second in keys if first == "lk-emu"}, set(words))


def complete(*words):
    return set(output(PROGRAM, "__complete", *words).splitlines())


class Complete(unittest.TestCase):
    def test_offers_every_option_and_word(self):
        def named(path):
            names = re.findall(r"^  (-\S+)", output(PROGRAM, *path, "--help"), re.MULTILINE)
            return {name for line in names for name in line.split(",")}

        for path, _, words in EVERYTHING:
            taken = named(path) | (named(("ctl",)) if path[:1] == ("ctl",) else set())
            self.assertEqual(complete(*path, "-"), taken, path)
            if words:
                self.assertLessEqual(set(words), complete(*path, ""), path)

    def test_offers_values(self):
        motors = set(re.findall(r"^((?:m[a-z]|rmd-)\S+)", output(PROGRAM, "motors"), re.MULTILINE))
        self.assertEqual(motors, delivered("motors"))
        faults = set(re.findall(r"^  (\w+)", output(PROGRAM, "faults"), re.MULTILINE))
        self.assertGreater(len(motors), 10)
        self.assertGreater(len(faults), 50)
        cases = [
            (["--motor", "m"], {m for m in motors if m.startswith("m")}),
            (["motors", "rmd"], {m for m in motors if m.startswith("rmd")}),
            (["--bus", "vcan0", "--ids", "1-4", "--motor", "mf9"], {m for m in motors if m.startswith("mf9")}),
            (["--motor", "MG4005"], {"MG4005-14P", "MG4005-i10", "MG4005E-i10", "MG4005E-i10v3"}),
            (["--config", "qu"], {"quadruped", "quadruped_on_the_ground"}),
            (["--scenario", "jam"], {"jammed_joint"}),
            (["run", ""], delivered("scenarios")),
            (["run", "x.toml", "jam"], {"jammed_joint"}),
            (["campaign", "every"], {"every_fault"}),
            (["faults", "jam"], {f for f in faults if f.startswith("jam")}),
            (["ctl", "fault", "encoder_"], {f for f in faults if f.startswith("encoder_")}),
            (["ctl", "--bus", "vcan1", "power", "o"], {"on", "off"}),
            (["ctl", "clear", ""], {"all"}),
            (["ctl", "record", ""], {"stop"}),
            (["ctl", "scenario", ""], delivered("scenarios") | {"stop", "verdict"}),
            (["--clock", "s"], {"stepped"}),
            (["--clock", "="], {"realtime", "stepped", "x0.1", "x10"}),
            (["--clock", "=", "real"], {"realtime"}),
            (["--clock=real"], {"--clock=realtime"}),
            (["--clock=real", "--generation", "v236"], {"v236", "v236b"}),
            (["decode", "--generation", "v235"], {"v235"}),
            (["ctl", "clock", "step"], {"stepped"}),
            (["run", "--signals", "speed_d"], {"speed_dps"}),
            (["run", "--signals", "angle_deg,speed_d"], {"angle_deg,speed_dps"}),
            (["--log-level", "w"], {"warn"}),
            (["--seed", ""], set()),
            (["--wipe-rom", "--mot"], {"--motor"}),
            (["--wipe-rom", "ru"], set()),
            (["ctl", "--socket", "x", "wat"], {"watch"}),
            (["ctl", "mark", ""], set()),
            (["demo", ""], {"arm", "quadruped"}),
        ]
        for words, expected in cases:
            self.assertEqual(complete(*words), expected, words)
        self.assertEqual(complete(), complete(""))

    def test_works_in_bash(self):
        ask = 'source "$1"; complete -p lk-emu lk-emu-body; COMP_WORDS=("$2" ctl power o); COMP_CWORD=3; _lk_emu "$2"; echo "${COMPREPLY[@]}"'
        rule = "complete -o bashdefault -o default -F _lk_emu "
        self.assertEqual(output("bash", "--norc", "-c", ask, "bash", BASH, PROGRAM),
                         f"{rule}lk-emu\n{rule}lk-emu-body\non off\n")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
