"""lk-emu campaign with a host program: what its cases come to, and what is kept and said of them."""

import json
import sqlite3
import unittest

from campaign_program import DETECT, InADirectory, plan

FAULT = 'fault.kind = "stale"\nfault.id = 1\nfault.at_s = 0.3\nfault.for_s = 0.2\n'
RULES = '\n[detect]\n[[detect.host]]\nsays = "warning"\n[[detect.host]]\nexit_status = 1\n'


class WithAHost(InADirectory):
    def write_plan(self, script, dimensions):
        self.write("host.sh", script)
        words = "sh host.sh" + (" {host.status}" if "host.status" in dimensions else "")
        host = f'[host]\ncommand = "{words}"\nclock = "stepped"\n'
        self.write("p.toml", plan(None, dimensions, "full", host).removesuffix(DETECT) + RULES)

    def run_plan(self, store):
        self.campaign("p.toml", "-o", store, "--quiet", "--json", "p.json", "--jobs", "1")
        return sqlite3.connect(self.directory / store).execute(
            "SELECT outcome, note, said, detected_by_host_ns FROM cases ORDER BY number").fetchall()

    def test_a_false_alarm_detects_nothing_and_its_text_is_not_compared(self):
        """It comes before the fault, and without it too."""
        self.write_plan('echo "warning $(date +%N): as ever"\n', FAULT)
        self.assertEqual([case[3] for case in self.run_plan("a.db")], [None])
        self.run_plan("b.db")
        self.assertEqual(self.export("a.db"), self.export("b.db"))
        self.assertNotIn("as ever", self.export("a.db"))
        report = json.loads((self.directory / "p.json").read_text())
        self.assertIsNone(report["space"])
        self.assertNotIn("space:", self.campaign("report", "a.db").stdout)

    def test_a_host_that_dies_without_the_fault_too(self):
        """Of settings that the first case, which is tried before, does not have."""
        self.write_plan("exit $1\n", FAULT + "host.status = [0, 3]\n")
        well, dies = self.run_plan("a.db")
        self.assertNotEqual(well[0], "not fired")
        self.assertEqual(dies[:2], ("not fired", "without the fault too: exit status 3"))

    def test_settings_alone_are_judged_by_themselves(self):
        self.write_plan('[ $1 = 2 ] && echo "warning: lost" && exit 0\nexit $1\n', "host.status = [0, 1, 2, 3]\n")
        self.assertEqual(self.run_plan("a.db"), [
            ("tolerated", "exit status 0", "", None), ("detected by the host", "exit status 1", "", 0),
            ("detected by the host", "exit status 0; line 1 of [detect]", "warning: lost", 0),
            ("crash", "exit status 3", "", None)])

    def test_results_of_another_host_are_of_another_campaign(self):
        self.write_plan("exit 0\n", FAULT)
        self.run_plan("a.db")
        self.campaign("p.toml", "-o", "a.db", "--quiet", "--resume")
        self.write("host.sh", "exit 1\n")
        self.refused("p.toml", "-o", "a.db", "--quiet", "--resume", says="a.db")


if __name__ == "__main__":
    unittest.main()
