"""The words of lk-emu campaign: one case again, what it would cost, and everything that cannot be used."""

import re
import sqlite3
import unittest

from campaign_program import KINDS, InADirectory, plan


class Refused(InADirectory):
    def refuse_dimensions(self, dimensions, says, sampling="random", rest=""):
        self.write("bad.toml", plan(None if sampling in ("full", "pairwise") else 10, dimensions, sampling, rest))
        for words in ["bad.toml"], ["bad.toml", "--dry-run"], ["bad.toml", "--case", "0"]:
            with self.subTest(dimensions, words=words):
                self.refused(*words, says=says)

    def test_plans(self):
        self.refuse_dimensions(KINDS + "fault.colour = 1\n", "bad.toml:[0-9]+: .*colour")
        self.refuse_dimensions(KINDS + "wind = 1\n", "bad.toml:[0-9]+: .*wind")
        self.refuse_dimensions(KINDS + "supply_V = { from = 24, to = 20 }\n", "bad.toml:[0-9]+: .*supply_V")
        self.refuse_dimensions(KINDS + "supply_V = []\n", "bad.toml:[0-9]+: .*supply_V")
        self.refuse_dimensions('fault.kind = "silent"\nfault.id = 1\nfault.at_s = 1\n'
                               'supply_V = { from = 20, to = 24 }\n', "supply_V.*step", "full")
        self.refuse_dimensions(KINDS.replace("jam", "jamm"), "bad.toml:[0-9]+: .*fault.kind")
        self.refuse_dimensions(KINDS.replace("to = 100", "to = 101"), "bad.toml:[0-9]+: .*percent")
        self.refuse_dimensions(KINDS.replace("fault.id = 1", "fault.id = 7"), "bad.toml.*7")
        self.refuse_dimensions(KINDS, "bad.toml.*exclude", rest='[[exclude]]\nfault.id = 1\n')
        self.refuse_dimensions("fault.kind = \"silent\"\nfault.id = 1\nfault.at_s = [0.1, 0.2]\n", "bad.toml.*exclude",
                               rest='[[exclude]]\nfault.id = 1\n', sampling="pairwise")
        self.refuse_dimensions("fault.kind = \"silent\"\nfault.id = 1\nfault.at_s = [0.1, 0.2]\n", "bad.toml.*exclude",
                               rest='[[exclude]]\nfault.id = 1\n', sampling="full")

    def test_values_that_only_a_later_case_would_have(self):
        """Nothing is run, and no file is begun."""
        for dimensions, says in [
                (KINDS.replace("to = 0.9", "to = 90"), "bad.toml: .*fault.at_s"),
                (KINDS.replace("fault.id = 1", "fault.id = [1, 7]"), "bad.toml: .*fault.id.*7"),
                (KINDS.replace('"kick"', '"kick", "brake_late"'), "bad.toml: dimension: fault.kind = brake_late: .*brake")]:
            self.write("bad.toml", plan(10, dimensions))
            for words in ["bad.toml"], ["bad.toml", "--dry-run"]:
                with self.subTest(dimensions, words=words):
                    self.refused(*words, says=says)
        self.assertFalse((self.directory / "bad.db").exists())

    def test_reports_for_which_there_is_no_directory(self):
        self.write("p.toml", plan(10))
        for option in "--html", "--json", "--junit":
            self.refused("p.toml", option, "nowhere/report", says=f"{option}.*nowhere")
        self.assertFalse((self.directory / "p.db").exists())

    def test_reports_in_place_of_other_files(self):
        self.write("p.toml", plan(10))
        self.campaign("p.toml", "--quiet")
        self.write("q.toml", plan(10))
        (self.directory / "link.html").symlink_to("p.db")
        (self.directory / "folder").mkdir()
        for words, says in [(["report", "p.db", "--html", "p.db"], "--html: p.db is also the file of the results"),
                            (["report", "p.db", "--json", "link.html"], "--json: link.html is also"),
                            (["report", "p.db", "--html", "a", "--junit", "./a"], "--junit: ./a is also for --html"),
                            (["compare", "p.db", "p.db", "--json", "folder/../p.db"], "--json: .*results"),
                            (["report", "p.db", "--html", "folder"], "--html: folder is a directory"),
                            (["q.toml", "--html", "q.db"], "--html: q.db is also the file of the results"),
                            (["q.toml", "--json", "q.toml"], "--json: q.toml is also the plan")]:
            self.refused(*words, says=says)

    def test_a_load_of_a_bus_that_cannot_have_one(self):
        for bitrate in "0", "[0, 1000000]":
            self.write("bad.toml", plan(10, KINDS + f"bitrate = {bitrate}\nbus_load = [0, 0.5]\n"))
            self.refused("bad.toml", says="bad.toml: .*bus_load: needs a CAN bus with a bitrate")

    def test_a_host_that_dies_even_without_a_fault(self):
        self.write("p.toml", plan(10, rest='[host]\ncommand = ["sh", "-c", "echo no module named can; exit 3"]\n'))
        for words in ["p.toml"], ["p.toml", "--dry-run"]:
            self.refused(*words, says="p.toml: host: .*without a fault.*exit status 3; no module named can")

    def test_frames_of_a_case_with_a_host(self):
        self.write("p.toml", plan(10, rest='[host]\ncommand = "true"\nclock = "stepped"\n'))
        for option in "--csv", "--candump":
            self.refused("p.toml", "--case", "0", "--scenario", "s.toml", option, "x", says=f"{option}: .*host program")

    def test_plans_that_are_none(self):
        self.write("text.toml", "a night of faults\n")
        (self.directory / "binary.toml").write_bytes(bytes(range(256)))
        (self.directory / "folder").mkdir()
        self.write("lost.toml", 'scenario = "lost"\nsampling = "full"\n[dimension]\nseed = 1\n')
        self.write("empty.toml", "")
        for name, says in [("nowhere.toml", "nowhere"), ("text.toml", "text.toml:1"), ("binary.toml", "binary"),
                           ("folder", "folder"), ("lost.toml", "lost"), ("empty.toml", "empty")]:
            self.refused(name, says=says)
        self.refused(says="plan")

    def test_more_cases_than_can_be_meant(self):
        many = "fault.kind = \"silent\"\nfault.id = 1\nfault.at_s = { from = 0, to = 0.999, step = 0.001 }\n" \
               "supply_V = { from = 20, to = 24.999, step = 0.005 }\nseed = { from = 1, to = 2000, step = 1 }\n"
        self.write("many.toml", plan(None, many, "full"))
        self.refused("many.toml", says="many.toml: has 2000000000 cases.*--yes")
        self.refused("many.toml", "--resume", says="--yes")
        self.write("most.toml", plan(1_000_000_001))
        self.refused("most.toml", says="--yes")
        dry = self.campaign("many.toml", "--dry-run").stdout
        self.assertIn("2000000000 cases", dry)
        self.assertRegex(dry, r"fault.at_s +1000: 0, 0.001,")

    def test_shards_that_are_none(self):
        self.write("p.toml", plan(10))
        for shard in "8/8", "9/8", "0/0", "-1/3", "1", "/", "1/", "/2", "a/b", "1/2/3", "1 /2", \
                "0/99999999999999999999":
            self.refused("p.toml", f"--shard={shard}", says="--shard")
        self.refused("p.toml", "--after", "x.db", says="--after")

    def test_requirements_that_are_none(self):
        self.write("p.toml", plan(10))
        self.write("latin.toml", plan(10, sampling="latin"))
        for text in "nonsense", "coverage>0.9", "coverage>=", "coverage>=x", "nothing<=3", "coverage[wind]>=0.5", "":
            self.refused("p.toml", f"--require={text}", says="--require|kind")
        self.refused("latin.toml", "--require", "coverage.lower>=0.9", says="random")
        self.campaign("latin.toml", "--require", "silently_wrong<=10", "--quiet")
        self.refused("report", "latin.db", "--require", "coverage.lower>=0.9", says="random")

    def test_words_that_do_not_go_together(self):
        self.write("p.toml", plan(10))
        for words in (["--csv", "c.csv"], ["--set", "fault.id=1"], ["--case", "1", "--signals", "iq_A"],
                      ["--case", "1", "--resume"], ["--dry-run", "--shard", "0/2"], ["--case", "1", "--html", "x.html"],
                      ["--jobs", "0"], ["--jobs", "many"], ["--nonsense"]):
            self.refused("p.toml", *words)

    def test_cases_that_are_none(self):
        self.write("p.toml", plan(10, rest="[[exclude]]\nsupply_V = 20\n", dimensions=KINDS + "supply_V = [20, 24]\n",
                                  sampling="latin"))
        for number in "10", "99999999999999999999", "-1", "one", "1.0", "", "0x1":
            self.refused("p.toml", f"--case={number}", says="case")
        whole = self.campaign("p.toml", "--dry-run").stdout
        self.assertIn("more are excluded", whole)
        self.campaign("p.toml", "--quiet")
        there = {int(line.split(",")[0]) for line in self.export("p.db").splitlines()[1:]}
        self.assertEqual(len(there), 5)
        self.refused("p.toml", "--case", str(min(there)), "--set", "supply_V=20", says="--set: the plan excludes")
        for number in set(range(10)) - there:
            self.refused("p.toml", "--case", str(number), says=f"case {number} is excluded")

    def test_outputs_of_a_case(self):
        self.write("p.toml", plan(10))
        for words in (["--csv", "c.csv", "--signals", "colour"], ["--csv", "c.csv", "--rate", "0"],
                      ["--scenario", "nowhere/s.toml"],
                      ["--set", "wind=1"], ["--set", "supply_V=21x"], ["--set", "supply_V=99"],
                      ["--set", "fault.kind=hang"]):
            self.refused("p.toml", "--case", "0", *words)
        for words in ["--csv", "nowhere/c.csv"], ["--candump", "nowhere/c.log"]:
            self.refused("p.toml", "--case", "0", *words, says="nowhere/c", out="case 0: .*\n")
        self.refused("p.toml", "--case", "0", "--scenario", "s.toml", "--csv", "c.csv", "--signals", "colour",
                     says="colour")


class Files(InADirectory):
    def setUp(self):
        super().setUp()
        self.write("p.toml", plan(24))
        self.campaign("p.toml", "--quiet")

    def test_that_are_there_stay(self):
        self.refused("p.toml", says="p.db: .*--resume")
        self.write("other.txt", "a letter")
        self.refused("p.toml", "-o", "other.txt", says="other.txt")
        self.refused("p.toml", "-o", "other.txt", "--resume", says="other.txt")
        self.refused("p.toml", "-o", ".")
        self.refused("p.toml", "-o", "nowhere/p.db", says="nowhere")
        self.refused("merge", "-o", "other.txt", "p.db", says="other.txt")
        self.refused("merge", "-o", "p.db", "p.db", says="p.db")

    def test_of_another_plan_are_not_gone_on_with(self):
        self.write("p.toml", plan(24, rest="seed = 2\n"))
        self.refused("p.toml", "--resume", says="p.db")
        self.write("p.toml", plan(25))
        self.refused("p.toml", "--resume", says="p.db")

    def change(self, store, statement):
        with sqlite3.connect(self.directory / store) as database:
            database.execute(statement)
        database.close()

    def test_of_another_campaign_are_not_merged(self):
        self.write("q.toml", plan(24, rest="seed = 2\n"))
        self.campaign("p.toml", "-o", "p0.part", "--shard", "0/2", "--quiet")
        self.campaign("p.toml", "-o", "p1.part", "--shard", "1/2", "--quiet")
        self.campaign("q.toml", "-o", "q1.part", "--shard", "1/2", "--quiet")
        self.refused("merge", "-o", "all.db", "p0.part", "q1.part", says="q1.part")
        self.change("p1.part", "UPDATE campaign SET version = '0.0.1'")
        self.refused("merge", "-o", "all.db", "p0.part", "p1.part", says="p1.part.*version.*0.0.1")
        self.refused("merge", "-o", "all.db", "p0.part", "nowhere.part", says="nowhere.part")
        self.refused("merge", "-o", "all.db", "p0.part", "p.toml", says="p.toml")
        self.refused("p.toml", "-o", "p1.part", "--shard", "1/2", "--resume", says="p1.part.*version")

    def test_that_are_no_campaign(self):
        self.write("empty.db", "")
        for name in "empty.db", "p.toml", "nowhere.db", ".":
            for words in ["export", name], ["report", name], ["compare", name, "p.db"], ["compare", "p.db", name]:
                self.refused(*words, says=re.escape(name))

    def test_of_generations_before(self):
        self.write("a.toml", plan(200, sampling="adaptive"))
        self.campaign("a.toml", "-o", "0.part", "--quiet", "--shard", "0/25")
        for words in ([], ["--after", "nowhere.db"], ["--after", "p.db"]):
            self.refused("a.toml", "-o", "1.part", "--shard", "1/25", *words, says="--after|nowhere.db|p.db")


class OneCase(InADirectory):
    def test_again_is_as_it_was(self):
        self.write("p.toml", plan(24))
        told = self.campaign("p.toml").stdout
        residual = re.findall(r"^ *(case (\d+): .*)$", told, re.M)
        self.assertTrue(residual)
        for line, number in residual:
            self.assertEqual(self.campaign("p.toml", "--case", number).stdout, line + "\n")
            self.assertIn(f"lk-emu campaign p.toml --case {number}\n", told)

    def evidence_of(self, text):
        return [line.strip() for line in text.splitlines() if re.match(" +(pass|FAIL|fault) ", line)]

    def test_is_a_scenario_too(self):
        self.write("p.toml", plan(24))
        (self.directory / "far").mkdir()
        for number in range(0, 24, 3):
            told = self.campaign("p.toml", "--case", str(number), "--csv", "a.csv", "--signals", "true_angle_deg,iq_A",
                                 "--rate", "50", "--candump", "a.log", "--scenario", "far/case.toml").stdout
            run = self.run_it("run", "far/case.toml", "--csv", "b.csv", "--signals", "true_angle_deg,iq_A", "--rate",
                              "50", "--candump", "b.log")
            self.assertIn(run.returncode, (0, 1, 3), run.stderr)
            self.assertTrue(any(line.startswith("fault ") for line in self.evidence_of(told)), told)
            self.assertEqual(self.evidence_of(run.stdout), self.evidence_of(told))
            files = self.files()
            self.assertEqual(files["a.csv"], files["b.csv"])
            self.assertEqual(files["a.log"], files["b.log"])
            self.assertEqual(files["a.csv"].count(b"\n"), 52)  # names, and 0 to 1 s
            fault = re.search(r"began at ([0-9.]+) s, (?:took effect at ([0-9.]+) s)?", told)
            sentence = told.splitlines()[0]
            self.assertEqual("not fired" in sentence, fault is None or fault[2] is None, told)

    def test_with_another_value(self):
        self.write("p.toml", plan(24))
        self.campaign("p.toml", "--case", "3", "--set", "supply_V=24", "--set", "fault.kind=silent", "--set",
                      "fault.at_s=0.5", "--scenario", "s.toml")
        text = (self.directory / "s.toml").read_text()
        self.assertIn("supply_V = 24", text)
        self.assertIn("silent", text)
        self.assertIn("at_s = 0.5", text)


    def test_is_found_by_the_command_of_a_report_from_elsewhere(self):
        (self.directory / "plans").mkdir()
        self.write("plans/p.toml", plan(24))
        self.write("a.toml", plan(24, sampling="adaptive"))
        self.campaign("plans/p.toml", "-o", "p.db", "--quiet")
        self.campaign("a.toml", "-o", "other.db", "--quiet")
        for store in "p.db", "other.db":
            told = self.campaign("report", store).stdout
            line, number, command = re.search(r"^ *(case (\d+): .*)\n +lk-emu (campaign .*)$", told, re.M).groups()
            self.assertIn(f"--case {number}", command)
            self.assertEqual(self.campaign(*command.split()[1:]).stdout, line + "\n")


class DryRun(InADirectory):
    def test_tells_cases_dimensions_and_cost(self):
        for cases in 3, 100:
            self.write("p.toml", plan(cases))
            told = self.campaign("p.toml", "--dry-run", "--jobs", "3").stdout
            self.assertIn(f"p: {cases} cases, sampling random, scenario short_move.toml\n", told)
            self.assertRegex(told, r"fault.kind +4: silent, jam, drop, kick\n")
            self.assertRegex(told, r"fault.at_s +0 to 0.9\n")
            self.assertRegex(told, rf"cases/s for each of 3 jobs \({min(cases, 64)} tried\)")
            self.assertEqual(list(self.files()), ["p.toml"])

    def test_of_a_plan_of_which_most_is_excluded(self):
        dimensions = 'fault.kind = "silent"\nfault.id = 1\nfault.at_s = { from = 0.1, to = 0.999, step = 0.001 }\n' \
                     'supply_V = [20, 24]\n'
        self.write("p.toml", plan(None, dimensions, "full",
                                  "[[exclude]]\nfault.at_s = { from = 0.1, to = 0.9989 }\n"))
        told = self.campaign("p.toml", "--dry-run").stdout
        self.assertIn("p: 2 cases", told)
        self.assertNotIn("inf", told)
        self.assertNotIn("nan", told)
        self.campaign("p.toml", "--quiet")
        self.assertEqual(self.export("p.db").count("\n") - 1, 2)


if __name__ == "__main__":
    unittest.main()
