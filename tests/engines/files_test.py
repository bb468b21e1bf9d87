#!/usr/bin/python3
"""Checks the files of packaging/engines and the recipes of the page by the rules of engines that are not installed.

usage: files_test.py DIRECTORY PAGE
"""
import pathlib
import re
import sys
import unittest

import yaml

from recipes import blocks

FILES, PAGE = map(pathlib.Path, sys.argv[1:3])
del sys.argv[1:3]


class Kubernetes(unittest.TestCase):
    def setUp(self):
        volume, shards = blocks(PAGE, "Kubernetes", "yaml")
        self.claim, self.files = yaml.safe_load_all(volume)
        self.shards = yaml.safe_load(shards)

    def test_documents_are_a_claim_a_pod_and_a_job(self):
        self.assertEqual([(one["apiVersion"], one["kind"]) for one in (self.claim, self.files, self.shards)],
                         [("v1", "PersistentVolumeClaim"), ("v1", "Pod"), ("batch/v1", "Job")])

    def test_shards_are_an_indexed_job(self):
        # Source: reference of batch/v1. Indexed needs completions, and parallelism of at most 100,000. The name of a
        # shard's pod, including its index, has at most 63 characters.
        spec = self.shards["spec"]
        self.assertEqual(spec["completionMode"], "Indexed")
        self.assertTrue(1 <= spec["parallelism"] <= spec["completions"])
        self.assertLessEqual(len(f"{self.shards['metadata']['name']}-{spec['completions'] - 1}-12345"), 63)

    def test_unusable_input_is_not_retried(self):
        # Source: reference of batch/v1. A podFailurePolicy needs restartPolicy Never; its rules name a container of
        # the pod.
        spec = self.shards["spec"]
        pod = spec["template"]["spec"]
        self.assertEqual(pod["restartPolicy"], "Never")
        fail, ignore = spec["podFailurePolicy"]["rules"]
        self.assertEqual(fail, {"action": "FailJob", "onExitCodes": {"containerName": pod["containers"][0]["name"], "operator": "In", "values": [2]}})
        self.assertEqual(ignore, {"action": "Ignore", "onPodConditions": [{"type": "DisruptionTarget"}]})

    def test_number_of_shards_is_consistent(self):
        completions = self.shards["spec"]["completions"]
        [container] = self.shards["spec"]["template"]["spec"]["containers"]
        self.assertIn(f"$(JOB_COMPLETION_INDEX)/{completions}", container["args"])
        self.assertIn(f"$(seq -f 'shard-%.0f.db' 0 {completions - 1})", PAGE.read_text("utf-8"))

    def test_volume_mounts_have_volumes(self):
        for pod in self.files["spec"], self.shards["spec"]["template"]["spec"]:
            [container] = pod["containers"]
            self.assertEqual({mount["name"] for mount in container["volumeMounts"]}, {volume["name"] for volume in pod["volumes"]})
            claims = [volume["persistentVolumeClaim"]["claimName"] for volume in pod["volumes"] if "persistentVolumeClaim" in volume]
            self.assertEqual(claims, [self.claim["metadata"]["name"]])


class GitHub(unittest.TestCase):
    def setUp(self):
        workflow = yaml.load((FILES / "github.yml").read_text("utf-8"), yaml.BaseLoader)  # keeps the key `on` a string
        self.jobs, self.on = workflow["jobs"], workflow["on"]

    def test_each_job_has_a_runner_and_steps(self):
        self.assertLessEqual({"schedule", "workflow_dispatch"}, self.on.keys())
        for job in self.jobs.values():
            self.assertTrue(job["runs-on"])
            for step in job["steps"]:
                self.assertEqual(len({"uses", "run"} & step.keys()), 1, step)
                self.assertLessEqual(step.keys(), {"uses", "run", "with", "if"})

    def test_jobs_need_the_jobs_whose_files_they_use(self):
        self.assertEqual({name: job.get("needs", []) for name, job in self.jobs.items()},
                         {"build": [], "shard": "build", "merge": ["build", "shard"]})

    def test_matrix_has_each_shard_once(self):
        strategy = self.jobs["shard"]["strategy"]
        self.assertEqual(strategy["fail-fast"], "false")  # keep the other shards; a job can be repeated
        self.assertEqual(strategy["matrix"], {"shard": [str(number) for number in range(len(strategy["matrix"]["shard"]))]})

    def test_uploads_match_downloads(self):
        def artifacts(job, action):
            return [step["with"] for step in self.jobs[job]["steps"] if step.get("uses", "").startswith(f"actions/{action}")]

        [program], [shard] = artifacts("build", "upload-artifact"), artifacts("shard", "upload-artifact")
        self.assertIn({"name": program["name"]}, artifacts("shard", "download-artifact"))
        self.assertIn({"name": program["name"]}, artifacts("merge", "download-artifact"))
        patterns = [taken["pattern"] for taken in artifacts("merge", "download-artifact") if "pattern" in taken]
        self.assertEqual([re.fullmatch(pattern.replace("*", ".*"), shard["name"]) is not None for pattern in patterns], [True])


class Snakemake(unittest.TestCase):
    """Checks the rules; tests/bare/run snakemake runs them."""

    def test_store_is_not_an_output(self):
        text = (FILES / "Snakefile").read_text("utf-8")
        rules = dict(re.findall(r"^rule (\w+):\n((?:    .*\n)+)", text, re.M))
        self.assertEqual(rules.keys(), {"campaign", "shard"})
        self.assertIn('output: touch("shard-{n}.done")', rules["shard"])
        self.assertIn("--resume", rules["shard"])


if __name__ == "__main__":
    unittest.main()
