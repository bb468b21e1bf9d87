#!/usr/bin/python3
"""The manual page, docs/options.md and the completions against what the program itself says with --help.

usage: manual_test.py LK_EMU DIRECTORY   (where lk-emu.1, bash/, fish/ and zsh/ are)
"""

import os
import re
import subprocess
import sys
import tempfile
import unittest

PROGRAM, MANUAL = map(os.path.abspath, sys.argv[1:3])
PAGE = os.path.join(MANUAL, "lk-emu.1")
BASH = os.path.join(MANUAL, "bash/lk-emu")
FISH = os.path.join(MANUAL, "fish/lk-emu.fish")
FISH_OF_BODY = os.path.join(os.path.dirname(__file__), "../../packaging/body/lk-emu-body.fish")
OPTIONS_PAGE = os.path.join(os.path.dirname(__file__), "../../docs/options.md")
ZSH = os.path.join(MANUAL, "zsh/_lk-emu")
CONFIGS = os.path.join(os.path.dirname(__file__), "../../configs")


def delivered(folder):
    """The names of what is there."""
    return {name[:-5] for name in os.listdir(os.path.join(CONFIGS, folder)) if name.endswith(".toml")}


def output(*command, **kwargs):
    """What a command says on both streams; it has to succeed."""
    ran = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120, **kwargs)
    assert ran.returncode == 0, (command, ran.returncode, ran.stdout)
    return ran.stdout


def read_help(path):
    """Of `lk-emu WORD…`: {option: description}, [words]."""
    text = output(PROGRAM, *path, "--help")
    options = {}
    for names, about in re.findall(r"^  (-\S+)(?: \S+(?: \.\.\.)?(?: REQUIRED)?)?  +(\S.*)$", text, re.MULTILINE):
        for name in names.split(","):
            options[name] = about
    words = []
    for title in ("Subcommands:", "Other commands,"):
        block = re.search(rf"^{title}.*\n((?:  .*\n)+)", text, re.MULTILINE)
        # Those below inherit the end of the text.
        if block and not (path and title.startswith("Other")):
            words += re.findall(r"^  (\S+)", block[1], re.MULTILINE)
    return options, words


def walk(path=()):
    options, words = read_help(path)
    yield path, options, words
    for word in words:
        yield from walk((*path, word))


EVERYTHING = list(walk())


def plain(roff):
    text = re.sub(r"\\f[BIR]", "", roff)
    for escape, character in {r"\-": "-", r"\(aq": "'", r"\(ha": "^", r"\(ti": "~", r"\ ": " ", r"\e": "\\"}.items():
        text = text.replace(escape, character)
    return text


class Help(unittest.TestCase):
    def test_was_understood(self):
        options = {path: options for path, options, _ in EVERYTHING}
        for path, option in [((), "--bus"), (("run",), "--signals"), (("ctl", "fault"), "--for"), (("motors",), "-h")]:
            self.assertIn(option, options[path])
        self.assertGreater(len(options), 18)


    def test_of_a_word_of_ctl_is_its_own(self):
        texts = {path[1]: output(PROGRAM, *path, "--help") for path, _, _ in EVERYTHING if path[:1] == ("ctl",) and path[1:]}
        for word, text in texts.items():
            self.assertIn("Takes --socket, --bus, --json and --lang of lk-emu ctl too.", text)
            for example in re.findall(r"^  lk-emu .*", text, re.MULTILINE):
                self.assertIn(f"lk-emu ctl {word} ", example)
            for about in re.findall(r"^  [A-Z][A-Z=]+(?: \S+)*?  +(\S.*)$", text, re.MULTILINE):
                self.assertRegex(about, "[a-z]", word)
        self.assertIn("--ids 1-2 --for 2s", texts["fault"])
        self.assertIn("docs/directives.md", texts["set"])
        self.assertNotIn("--bus vcan0", output(PROGRAM, "motors", "--help"))


class Page(unittest.TestCase):
    def test_is_clean(self):
        self.assertEqual(output("mandoc", "-Tlint", "-Wwarning", PAGE), "")
        self.assertEqual(output("groff", "-man", "-ww", "-z", PAGE), "")

    def test_has_every_option_in_its_place(self):
        with open(PAGE, encoding="utf-8") as file:
            page = plain(file.read())
        for path, options, _ in EVERYTHING:
            name = " ".join(("lk-emu", *path))
            if not path:
                place = page.split("\n.SH OPTIONS\n")[1].split("\n.SH ")[0]
            elif len(path) == 1:
                place = page.split(f"\n.SS {name}\n")[1].split("\n.SS ")[0].split("\n.SH ")[0]
            else:
                place = re.search(rf"\n\.TP\n{name} \[OPTIONS\].*\n.*\n\.RS\n((?:.*\n)*?)\.RE\n", page)[1]
            for option, about in options.items():
                entry = rf"\n\.TP\n(?:-., )?{re.escape(option)}\b.*\n{re.escape(about.replace('…', '...'))}\n"
                if not option.startswith("--"):
                    entry = rf"\n\.TP\n{option}, .*\n{re.escape(about)}\n"
                self.assertRegex(f"\n{place}\n", entry, name)

    def test_has_its_sections(self):
        text = re.sub(".\b", "", output("mandoc", "-Tascii", "-Owidth=100", PAGE))  # bold is struck twice
        sections = ["NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "COMMANDS", "EXIT STATUS", "FILES", "ENVIRONMENT",
                    "EXAMPLES", "SEE ALSO"]
        self.assertEqual(re.findall(r"^[A-Z][A-Z ]+$", text, re.MULTILINE), sections)
        status = text.split("EXIT STATUS")[1].split("FILES")[0]
        self.assertIn("2 unusable input", status)
        for path, _, _ in EVERYTHING:
            if len(path) == 1:
                self.assertIn(f"lk-emu {path[0]}", status)
        environment = " ".join(text.split("ENVIRONMENT")[1].split("EXAMPLES")[0].split())
        for variable in ("LC_ALL", "LC_MESSAGES", "LANG"):  # tools/commands/language_option.cpp
            self.assertIn(variable, environment)
        self.assertIn("lk-emu run and lk-emu decode print no colours", environment)
        self.assertIn("lk-emu ctl clock stepped && lk-emu ctl advance 10ms", text.split("EXAMPLES")[1])


class OptionsPage(unittest.TestCase):
    def test_has_the_options_and_commands_of_the_program(self):
        with open(OPTIONS_PAGE, encoding="utf-8") as file:
            keys = [re.split(r"[` ]", line)[2:4] for line in file if line.startswith("| `")]
        options, words = read_help(())
        self.assertEqual({first for first, _ in keys if first.startswith("-")}, {o for o in options if o.startswith("--")})
        self.assertEqual({second for first, second in keys if first == "lk-emu"}, set(words))


ASK_BASH = r"""
source "$1"
complete -p lk-emu lk-emu-body
while IFS= read -r line; do
  IFS=$'\t' read -r -a COMP_WORDS <<<"$line"
  [[ $line != *$'\t' ]] || COMP_WORDS+=('')
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
  _lk_emu
  (IFS=$'\t'; printf '%s\n' "${COMPREPLY[*]}")
done
"""


def ask_bash(*lines, cwd=None):
    """What bash offers at the end of each of the lines, which are lists of words as bash has them; in an empty directory."""
    if cwd is None:
        with tempfile.TemporaryDirectory() as empty:
            return ask_bash(*lines, cwd=empty)
    text = "".join("\t".join(line) + "\n" for line in lines)
    said = output("bash", "--norc", "-c", ASK_BASH, "bash", BASH, input=text, cwd=cwd).split("\n")
    assert said[:2] == ["complete -F _lk_emu lk-emu", "complete -F _lk_emu lk-emu-body"], said[:2]
    return [set(filter(None, line.split("\t"))) for line in said[2:-1]]


class Bash(unittest.TestCase):
    def test_offers_every_option_and_word(self):
        lines = [["lk-emu", *path, "-"] for path, _, _ in EVERYTHING]
        for (path, options, _), offered in zip(EVERYTHING, ask_bash(*lines), strict=True):
            self.assertLessEqual(set(options), offered, path)
        with_words = [(path, words) for path, _, words in EVERYTHING if words]
        for (path, words), offered in zip(with_words, ask_bash(*[["lk-emu", *p, ""] for p, _ in with_words]), strict=True):
            self.assertEqual(offered, set(words), path)

    def test_offers_values(self):
        motors = set(re.findall(r"^(m[a-z]\S+)", output(PROGRAM, "motors"), re.MULTILINE))
        self.assertEqual(motors, delivered("motors"))
        faults = set(re.findall(r"^  (\w+)", output(PROGRAM, "faults"), re.MULTILINE))
        self.assertGreater(len(motors), 10)
        self.assertGreater(len(faults), 50)
        cases = [
            (["--motor", "m"], motors),
            (["motors", "m"], motors),
            (["--bus", "vcan0", "--ids", "1-4", "--motor", "mf9"], {m for m in motors if m.startswith("mf9")}),
            (["--motor", "MG4005"], {"MG4005-14P", "MG4005-i10", "MG4005E-i10", "MG4005E-i10v3"}),
            (["--config", "qu"], {"quadruped", "quadruped_on_the_ground"}),
            (["--scenario", "jam"], {"jammed_joint"}),
            (["faults", "jam"], {f for f in faults if f.startswith("jam")}),
            (["ctl", "fault", "encoder_"], {f for f in faults if f.startswith("encoder_")}),
            (["ctl", "--bus", "vcan1", "power", "o"], {"on", "off"}),
            (["ctl", "clear", ""], {"all"}),
            (["--clock", "s"], {"stepped"}),
            (["--clock", "="], {"realtime", "stepped", "x0.1", "x10"}),
            (["--clock", "=", "real"], {"realtime"}),
            (["ctl", "clock", "step"], {"stepped"}),
            (["run", "--signals", "speed_d"], {"speed_dps"}),
            (["run", "--signals", "angle_deg,speed_d"], {"angle_deg,speed_dps"}),
            (["--log-level", "w"], {"warn"}),
            (["--seed", ""], set()),
            (["--wipe-rom", "--mot"], {"--motor"}),
            (["ctl", "--socket", "x", "wat"], {"watch"}),
            (["ctl", "mark", ""], set()),
            (["demo", ""], {"arm", "quadruped"}),
        ]
        for (line, expected), offered in zip(cases, ask_bash(*[["lk-emu", *line] for line, _ in cases]), strict=True):
            self.assertEqual(offered, expected, line)

    def test_offers_files_and_directories(self):
        with tempfile.TemporaryDirectory() as directory:
            open(os.path.join(directory, "arm.toml"), "w", encoding="utf-8").close()
            os.mkdir(os.path.join(directory, "arms"))
            everything, directories = {"arm.toml", "arms"}, {"arms"}
            cases = [
                (["--config", "ar"], everything),
                (["run", ""], everything | delivered("scenarios")),
                (["run", "arm.toml", "ar"], everything | {name for name in delivered("scenarios") if name.startswith("ar")}),
                (["run", "--quiet", "--csv", ""], everything),
                (["--rom", ""], directories),
                (["replay", ""], directories),
                (["ctl", "record", ""], directories | {"stop"}),
                (["ctl", "scenario", ""], everything | delivered("scenarios") | {"stop", "verdict"}),
            ]
            answers = ask_bash(*[["lk-emu", *line] for line, _ in cases], cwd=directory)
            for (line, expected), offered in zip(cases, answers, strict=True):
                self.assertEqual(offered, expected, line)


class OtherShells(unittest.TestCase):
    def ask_fish(self, *lines, cwd="/"):
        """What fish offers, without descriptions."""
        script = f"source {FISH}\nsource {FISH_OF_BODY}\n" + "".join(f"complete -C '{line}'\necho ==\n" for line in lines)
        with tempfile.TemporaryDirectory() as home:
            said = output("fish", "--no-config", "-c", script, cwd=cwd, env={**os.environ, "HOME": home})
        answers = said.split("==\n")[:-1]
        return [{line.split("\t")[0] for line in answer.splitlines()} for answer in answers]

    def test_fish_offers_every_option_and_word(self):
        lines = [" ".join(["lk-emu", *path, "--"]) for path, _, _ in EVERYTHING]
        for (path, options, _), offered in zip(EVERYTHING, self.ask_fish(*lines), strict=True):
            self.assertLessEqual({o for o in options if o.startswith("--")}, offered, path)
        with_words = [(path, words) for path, _, words in EVERYTHING if words]
        answers = self.ask_fish(*[" ".join(["lk-emu", *p, ""]) for p, _ in with_words])
        for (path, words), offered in zip(with_words, answers, strict=True):
            self.assertEqual(offered, set(words), path)

    def test_fish_offers_values(self):
        cases = {
            "lk-emu ctl --bus vcan1 power o": {"on", "off"},
            "lk-emu --clock st": {"stepped"},
            "lk-emu ctl fault jam": {"jam"},
            "lk-emu-body demo q": {"quadruped"},
            "lk-emu --motor mf9": {"mf9025", "MF9025-16T", "MF9025v2", "MF9025v2-16T"},
        }
        for (line, expected), offered in zip(cases.items(), self.ask_fish(*cases), strict=True):
            self.assertEqual(offered, expected, line)

    def test_zsh_takes_it(self):
        self.assertEqual(output("zsh", "-f", "-n", ZSH), "")
        directory = os.path.dirname(ZSH)
        script = "fpath=($1 $fpath); autoload -Uz compinit; compinit -u -D; print -- $_comps[lk-emu] $_comps[lk-emu-body]"
        self.assertEqual(output("zsh", "-f", "-c", script, "zsh", directory), "_lk-emu _lk-emu\n")
        with open(ZSH, encoding="utf-8") as file:
            functions = re.split(r"\n(_lk-emu\S*)\(\) \{\n", file.read())
        bodies = dict(zip(functions[1::2], functions[2::2], strict=True))
        for path, options, words in EVERYTHING:
            body = bodies["_".join(("_lk-emu", *path))]
            for option in options:
                self.assertRegex(body, rf"[)*]{option}[=+]?\[", path)
            for word in words:
                self.assertIn(f"{word}) {'_'.join(('_lk-emu', *path, word))} ;;", body)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
