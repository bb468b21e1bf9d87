"""Whoever computes a campaign, and however often it is killed: the same cases come out, byte for byte."""

import os
import re
import resource
import shlex
import signal
import subprocess
import unittest

from campaign_program import LK_EMU, InADirectory, plan

SAMPLINGS = {
    "random": plan(120),
    "latin": plan(60, sampling="latin"),
    "adaptive": plan(128, sampling="adaptive"),
    "full": plan(None, sampling="full", dimensions='fault.kind = ["silent", "jam"]\nfault.id = 1\n'
                 'fault.at_s = { from = 0.1, to = 0.9, step = 0.1 }\nsupply_V = [20, 24]\n'),
    "pairwise": plan(None, sampling="pairwise", dimensions='fault.kind = ["silent", "jam", "kick"]\nfault.id = 1\n'
                     'fault.at_s = [0.1, 0.3, 0.5]\nfault.kick.impulse_Nms = 0.2\nsupply_V = [20, 22, 24]\n'),
}


class Same(InADirectory):
    def test_for_any_number_of_workers(self):
        for name, text in SAMPLINGS.items():
            with self.subTest(name):
                self.write(f"{name}.toml", text)
                exports = set()
                for jobs in "1", "2", "5":
                    self.campaign(f"{name}.toml", "-o", f"{name}{jobs}.db", "--jobs", jobs, "--quiet")
                    exports.add(self.export(f"{name}{jobs}.db"))
                self.assertEqual(len(exports), 1)
                self.assertGreaterEqual(exports.pop().count("\n"), 10)

    def test_for_any_shards(self):
        for name, text in SAMPLINGS.items():
            if name == "adaptive":
                continue  # whose shards are its generations
            with self.subTest(name):
                self.write(f"{name}.toml", text)
                self.campaign(f"{name}.toml", "--quiet")
                parts = []
                for shard in "2/3", "0/3", "1/3":
                    parts.append(f"{name}-{shard[0]}.part")
                    self.campaign(f"{name}.toml", "-o", parts[-1], "--shard", shard, "--jobs", "2", "--quiet")
                some = self.campaign("merge", "-o", f"{name}-some.db", *parts[:2], status=1).stdout
                self.assertIn("missing: shard 1/3", some)
                self.campaign("merge", "-o", f"{name}-all.db", f"{name}-some.db", parts[2])
                self.assertEqual(self.export(f"{name}-all.db"), self.export(f"{name}.db"))

    def test_for_generations_as_shards(self):
        self.write("p.toml", SAMPLINGS["adaptive"])
        self.campaign("p.toml", "--quiet")
        refused = self.campaign("p.toml", "-o", "x.db", "--shard", "0/64", status=2).stderr
        count = int(re.search(r"this plan has (\d+)", refused)[1])
        self.assertGreater(count, 1)
        merged = None
        for n in range(count):
            after = ["--after", merged] if merged else []
            self.campaign("p.toml", "-o", f"{n}.part", "--shard", f"{n}/{count}", "--quiet", *after)
            so_far = [merged] if merged else []
            self.campaign("merge", "-o", f"{n}.db", *so_far, f"{n}.part")
            merged = f"{n}.db"
        self.assertEqual(self.export(merged), self.export("p.db"))


class Few(InADirectory):
    @unittest.skipIf(b"__asan_init" in LK_EMU.read_bytes(), "AddressSanitizer takes all addresses")
    def test_threads_for_want_of_memory(self):
        self.write("p.toml", plan(24))
        memory = 1_500_000_000  # of addresses; a stack takes 8 MB of them
        done = subprocess.run([LK_EMU, "campaign", "p.toml", "-j", "1024", "--quiet"], cwd=self.directory, timeout=300,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (memory, memory)),
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertRegex(done.stderr, r"\Alk-emu: --jobs: .*threads")


class Killed(InADirectory):
    def test_at_any_instant_goes_on(self):
        self.write("p.toml", plan(1500))
        self.campaign("p.toml", "-o", "undisturbed.db", "--quiet")
        kills = before = 0
        words = ["campaign", "p.toml", "-o", "p.db", "--jobs", "2", "--quiet"]
        for changes in 1, 0, 3, 2, 4, 0, 5:
            process = self.begin(*words)
            if not self.wait_for_changes(process, "p.db", changes):
                break  # on a machine that is busy otherwise
            process.kill()
            process.wait()
            kills += 1
            count = self.export("p.db").count("\n") - 1
            self.assertGreaterEqual(count, before)
            before = count
            words = [*words[:7], "--resume"]
        self.assertGreaterEqual(kills, 3)
        self.assertEqual(self.run_it(*words[:7], "--resume").returncode, 0)
        self.assertEqual(self.export("p.db"), self.export("undisturbed.db"))

    def test_generations_go_on(self):
        self.write("p.toml", plan(512, sampling="adaptive"))
        self.campaign("p.toml", "-o", "undisturbed.db", "--quiet")
        process = self.begin("campaign", "p.toml", "--quiet")
        self.assertTrue(self.wait_for_changes(process, "p.db", 4))
        process.kill()
        process.wait()
        self.campaign("p.toml", "--quiet", "--resume")
        self.assertEqual(self.export("p.db"), self.export("undisturbed.db"))


class Interrupted(InADirectory):
    def interrupt(self, number, *words, store="p.db"):
        process = self.begin("campaign", *words)
        self.assertTrue(self.wait_for_changes(process, store, 2))
        process.send_signal(number)
        out, problem = process.communicate()
        self.assertEqual(process.returncode, 130, problem)
        self.assertEqual(out, "")
        self.assertEqual(problem.count("\n"), 1, problem)
        said = re.fullmatch(r"lk-emu: stopped after (\d+) cases, all kept in .*; (lk-emu .*) goes on\n", problem)
        self.assertTrue(said, problem)
        self.assertEqual(self.export(store).count("\n") - 1, int(said[1]))
        return said[2]

    def go_on(self, command, status=0):
        path = f"{LK_EMU.parent}:{os.environ['PATH']}"
        done = subprocess.run(["sh", "-c", command], cwd=self.directory, env={**os.environ, "PATH": path},
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, status, done.stderr)
        return done

    def test_says_how_to_go_on(self):
        self.write("p.toml", plan(1500))
        self.campaign("p.toml", "-o", "undisturbed.db", "--quiet")
        for number in signal.SIGINT, signal.SIGTERM:
            store = f"{number}.db"
            command = self.interrupt(number, "p.toml", "-o", store, "--jobs", "2", store=store)
            self.go_on(command)
            self.assertEqual(self.export(store), self.export("undisturbed.db"))

    def test_says_all_that_it_was_told(self):
        self.write("it's a plan.toml", plan(6000))
        command = self.interrupt(signal.SIGINT, "it's a plan.toml", "-o", "$(results) 1.db", "--shard", "1/2", "--json",
                                 "a b.json", "--require", "late>=0", "--quiet", store="$(results) 1.db")
        self.assertEqual(shlex.split(command)[-1], "--resume")
        self.assertEqual(self.go_on(command, 1).stdout, "late>=0: measured 0, but 3000 cases are missing\n")
        self.assertTrue((self.directory / "a b.json").exists())
        self.assertEqual(self.export("$(results) 1.db").count("\n") - 1, 3000)

    def test_again_while_it_goes_on(self):
        self.write("p.toml", plan(6000))
        command = self.interrupt(signal.SIGINT, "p.toml")
        again = self.interrupt(signal.SIGINT, *shlex.split(command)[2:])
        self.assertEqual(command, again)


if __name__ == "__main__":
    unittest.main()
