#!/usr/bin/python3
"""Campaigns in shards, as engines run them, give what one process gives: `shards_test.py PROGRAM FILES PLAN`.

GNU parallel is real, and processes of its are killed; of Kubernetes and GitHub only the commands are run that they would.
Snakemake and Slurm have steps of tests/bare/run.
"""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import yaml

PROGRAM, FILES, PLAN = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
del sys.argv[1:4]
SHARDS = 4


class Shards(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        directory = tempfile.TemporaryDirectory()
        cls.addClassCleanup(directory.cleanup)
        cls.directory = pathlib.Path(directory.name)
        os.symlink(PROGRAM, cls.directory / "lk-emu")
        # Citations are for people at terminals, and parallel keeps in the home whether one has agreed.
        cls.environment = {**os.environ, "PATH": f"{cls.directory}:{os.environ['PATH']}", "HOME": directory.name}
        cls.lk_emu("campaign", str(PLAN), "--jobs", "1", "--quiet", "-o", "one.db", work=cls.directory)
        cls.whole = cls.exported(cls.directory / "one.db")

    def setUp(self):
        self.work = self.directory / self.id().rsplit(".", 1)[1]
        self.work.mkdir()
        self.first_lengths = {}

    @classmethod
    def lk_emu(cls, *args, work):
        subprocess.run(["lk-emu", *args], cwd=work, env=cls.environment, check=True, stdin=subprocess.DEVNULL)

    @classmethod
    def exported(cls, store):
        return subprocess.run([PROGRAM, "campaign", "export", store], check=True, stdout=subprocess.PIPE).stdout

    def assert_is_the_whole(self, store):
        self.assertGreater(self.whole.count(b"\n"), SHARDS)
        self.assertEqual(self.exported(store), self.whole)

    def until(self, condition, child):
        """What the condition gives, as soon as it gives something; the test fails if the child ends before."""
        while not (result := condition()):
            self.assertIsNone(child.poll(), "ended before")
            time.sleep(0.01)
        return result

    def process_of(self, shard):
        """The program that works at a shard here."""
        for directory in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                words = (directory / "cmdline").read_bytes().split(b"\0")
                here = os.readlink(directory / "cwd") == str(self.work)
                name = (directory / "comm").read_text().strip()
            except OSError:
                continue
            if here and name == "lk-emu" and f"shard-{shard}.db".encode() in words:
                return int(directory.name)
        return None

    def grows(self, shard):
        """Whether its store is longer than when it was first looked at: cases are in it. Only who writes it may read it."""
        store = self.work / f"shard-{shard}.db"
        if not store.exists():
            return False
        length = store.stat().st_size
        return length > self.first_lengths.setdefault(shard, length)

    def parallel(self):
        return subprocess.Popen([FILES / "parallel.sh", PLAN, str(SHARDS), "--jobs", "2"], cwd=self.work, env=self.environment,
                                stdin=subprocess.DEVNULL, start_new_session=True)

    def test_parallel_begins_a_killed_shard_again(self):
        child = self.parallel()
        self.until(lambda: self.grows(1), child)
        os.kill(self.until(lambda: self.process_of(1), child), signal.SIGKILL)
        self.assertEqual(child.wait(), 0)
        rows = [row.split("\t") for row in (self.work / "campaign.joblog").read_text().splitlines()[1:]]
        ends = {row[8].split("shard-")[1].split(".db")[0]: row[6:8] for row in rows}
        self.assertEqual(ends, {str(shard): ["0", "0"] for shard in range(SHARDS)})
        self.assert_is_the_whole(self.work / "campaign.db")

    def test_what_containers_of_kubernetes_run(self):
        _, shards, merge = yaml.safe_load_all((FILES / "kubernetes.yaml").read_text("utf-8"))
        plan = self.work / "plan"
        results = self.work / "results"
        shutil.copytree(PLAN.parent, plan)
        (plan / PLAN.name).rename(plan / "plan.toml")
        results.mkdir()

        def run(job, index=""):
            def filled(word):
                for what, value in (("$(JOB_COMPLETION_INDEX)", index), ("/plan/", f"{plan}/"), ("/results/", f"{results}/")):
                    word = word.replace(what, value)
                return word

            self.lk_emu(*map(filled, job["spec"]["template"]["spec"]["containers"][0]["args"]), work="/")

        for index in range(shards["spec"]["completions"]):
            run(shards, str(index))
        run(merge)
        self.assert_is_the_whole(results / "campaign.db")

    def test_what_runners_of_github_run(self):
        jobs = yaml.safe_load((FILES / "github.yml").read_text("utf-8"))["jobs"]
        shards = jobs["shard"]["strategy"]["matrix"]["shard"]

        def run(job, shard=""):
            contexts = {"matrix.shard": shard, "strategy.job-total": len(shards)}
            for step in jobs[job]["steps"]:
                if step.get("run", "").startswith("lk-emu campaign"):
                    command = re.sub(r"\$\{\{ (.*?) \}\}", lambda expression: str(contexts[expression[1]]), step["run"])
                    subprocess.run(["bash", "-e", "-c", command], cwd=self.work, env={**self.environment, "PLAN": str(PLAN)},
                                   check=True, stdin=subprocess.DEVNULL)

        for shard in shards:
            run("shard", shard)
        run("merge")
        self.assert_is_the_whole(self.work / "campaign.db")
        for page in "campaign.html", "campaign.xml":
            self.assertTrue((self.work / page).stat().st_size)


if __name__ == "__main__":
    unittest.main()
