#!/usr/bin/python3
"""Checks that sharded campaigns give the result of one process: `shards_test.py PROGRAM FILES PAGE PLAN`.

Runs GNU parallel and kills its processes. For Kubernetes and GitHub it runs only their commands. Steps of
tests/bare/run test Snakemake and Slurm.
"""
import contextlib
import os
import pathlib
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
import unittest

import yaml

from recipes import blocks

PROGRAM, FILES, PAGE, PLAN = (pathlib.Path(argument).resolve() for argument in sys.argv[1:5])
del sys.argv[1:5]
SHARDS = 4


class Shards(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        directory = tempfile.TemporaryDirectory()
        cls.addClassCleanup(directory.cleanup)
        cls.directory = pathlib.Path(directory.name)
        os.symlink(PROGRAM, cls.directory / "lk-emu")
        # Avoids parallel's citation notice, which it stores in the home directory.
        cls.environment = {**os.environ, "PATH": f"{cls.directory}:{os.environ['PATH']}", "HOME": directory.name}
        cls.lk_emu("campaign", str(PLAN), "--jobs", "1", "--quiet", "-o", "one.db", work=cls.directory)
        cls.whole = cls.exported(cls.directory / "one.db")

    def setUp(self):
        self.work = self.directory / self.id().rsplit(".", 1)[1]
        self.work.mkdir()

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
        """Returns the first true value of the condition; fails if the child ends before."""
        while not (result := condition()):
            self.assertIsNone(child.poll(), "ended before")
            time.sleep(0.01)
        return result

    def process_of(self, shard):
        """Returns the process on this machine that computes the shard."""
        for directory in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                words = (directory / "cmdline").read_bytes().split(b"\0")
                here = os.readlink(directory / "cwd") == str(self.work)
            except OSError:
                continue
            if here and any(word == b"lkemu.campaign" for word in words) and f"shard-{shard}.db".encode() in words:
                return int(directory.name)
        return None

    def cases(self, shard):
        """Returns the number of cases in the shard's file."""
        try:
            with contextlib.closing(sqlite3.connect(f"file:{self.work}/shard-{shard}.db?mode=ro", uri=True)) as results:
                return results.execute("SELECT count(*) FROM cases").fetchone()[0]
        except sqlite3.OperationalError:
            return 0

    def parallel(self, plan=PLAN):
        """Starts the recipe of the page, with fewer shards."""
        [recipe] = blocks(PAGE, "GNU parallel", "sh")
        for text, value in (("plan.toml", str(plan)), ("seq 0 15", f"seq 0 {SHARDS - 1}"), ("/16", f"/{SHARDS}"), ("--retries 3", "--retries 3 --jobs 2")):
            self.assertIn(text, recipe)
            recipe = recipe.replace(text, value)
        return subprocess.Popen(["bash", "-c", recipe], cwd=self.work, env=self.environment, stdin=subprocess.DEVNULL,
                                stdout=subprocess.DEVNULL, start_new_session=True)  # fmt: skip

    def test_parallel_restarts_a_killed_shard(self):
        child = self.parallel()
        self.until(lambda: self.cases(1), child)
        os.kill(self.until(lambda: self.process_of(1), child), signal.SIGKILL)
        self.assertEqual(child.wait(), 0)
        self.assert_is_the_whole(self.work / "campaign.db")

    def test_killed_parallel_can_be_resumed(self):
        child = self.parallel()
        self.until(lambda: self.cases(0), child)
        [perl] = [int(one) for one in subprocess.run(["pgrep", "-s", str(child.pid), "-x", "perl|parallel"], capture_output=True, text=True).stdout.split()]
        os.kill(perl, signal.SIGKILL)
        self.assertNotEqual(child.wait(), 0)
        self.assertFalse((self.work / "campaign.db").exists())
        # The shards of the killed process end by themselves; the command need not wait for them.
        self.assertEqual(self.parallel().wait(), 0)
        self.assert_is_the_whole(self.work / "campaign.db")

    def test_parallel_does_not_retry_a_wrong_plan(self):
        (self.work / "wrong.toml").write_text("sampling = 'full'\n")
        self.assertEqual(self.parallel(self.work / "wrong.toml").wait(), 2)
        self.assertEqual([file.name for file in self.work.iterdir()], ["wrong.toml"])

    def test_kubernetes_commands_give_the_whole_result(self):
        _, job = blocks(PAGE, "Kubernetes", "yaml")
        shards = yaml.safe_load(job)["spec"]
        [container] = shards["template"]["spec"]["containers"]
        shutil.copy(PLAN, self.work / "plan.toml")
        for index in range(shards["completions"]):
            words = [word.replace("$(JOB_COMPLETION_INDEX)", str(index)).replace("/campaign/", f"{self.work}/") for word in container["args"]]
            self.lk_emu(*words, work="/")
        self.lk_emu("campaign", "merge", "-o", "campaign.db", *(f"shard-{index}.db" for index in range(shards["completions"])), work=self.work)
        self.assert_is_the_whole(self.work / "campaign.db")

    def test_github_commands_give_the_whole_result(self):
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
