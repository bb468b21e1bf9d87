#!/usr/bin/python3
"""The files of packaging/engines, as the engines that are not here would read them: `files_test.py DIRECTORY`."""
import pathlib
import re
import sys
import unittest

import yaml

FILES = pathlib.Path(sys.argv.pop(1))


class Kubernetes(unittest.TestCase):
    def setUp(self):
        documents = list(yaml.safe_load_all((FILES / "kubernetes.yaml").read_text("utf-8")))
        self.claim, self.shards, self.merge = documents

    def container(self, job):
        containers = job["spec"]["template"]["spec"]["containers"]
        self.assertEqual(len(containers), 1)
        return containers[0]

    def test_the_documents_are_a_claim_and_two_jobs(self):
        self.assertEqual((self.claim["apiVersion"], self.claim["kind"]), ("v1", "PersistentVolumeClaim"))
        for job in self.shards, self.merge:
            self.assertEqual((job["apiVersion"], job["kind"]), ("batch/v1", "Job"))

    def test_the_shards_are_an_indexed_job(self):
        # The reference of batch/v1: Indexed needs completions, and parallelism of at most 100,000; a Job's pods are
        # restarted OnFailure or Never; a name of a shard's pod, with its index, is at most 63 characters long.
        spec = self.shards["spec"]
        self.assertEqual(spec["completionMode"], "Indexed")
        self.assertTrue(1 <= spec["parallelism"] <= spec["completions"])
        self.assertEqual(spec["template"]["spec"]["restartPolicy"], "OnFailure")
        self.assertEqual(self.merge["spec"]["template"]["spec"]["restartPolicy"], "Never")
        self.assertLessEqual(len(f"{self.shards['metadata']['name']}-{spec['completions'] - 1}-12345"), 63)

    def test_the_number_of_shards_is_the_same_everywhere(self):
        completions = self.shards["spec"]["completions"]
        args = self.container(self.shards)["args"]
        self.assertIn(f"$(JOB_COMPLETION_INDEX)/{completions}", args)
        self.assertEqual(self.container(self.merge)["args"][4:],
                         [f"/results/shard-{shard}.db" for shard in range(completions)])

    def test_volumes_and_labels_fit(self):
        for job in self.shards, self.merge:
            pod = job["spec"]["template"]["spec"]
            volumes = {volume["name"] for volume in pod["volumes"]}
            self.assertEqual({mount["name"] for mount in self.container(job)["volumeMounts"]}, volumes)
            claims = [volume["persistentVolumeClaim"]["claimName"] for volume in pod["volumes"]
                      if "persistentVolumeClaim" in volume]
            self.assertEqual(claims, [self.claim["metadata"]["name"]])
        self.assertEqual([document["metadata"]["labels"]["step"] for document in (self.claim, self.shards, self.merge)],
                         ["storage", "shards", "merge"])
        self.assertEqual(self.container(self.shards)["image"], self.container(self.merge)["image"])


class GitHub(unittest.TestCase):
    def setUp(self):
        workflow = yaml.load((FILES / "github.yml").read_text("utf-8"), yaml.BaseLoader)  # `on` is a word there
        self.jobs, self.on = workflow["jobs"], workflow["on"]

    def test_each_job_says_where_it_runs_and_what_it_does(self):
        self.assertLessEqual({"schedule", "workflow_dispatch"}, self.on.keys())
        for job in self.jobs.values():
            self.assertTrue(job["runs-on"])
            for step in job["steps"]:
                self.assertEqual(len({"uses", "run"} & step.keys()), 1, step)
                self.assertLessEqual(step.keys(), {"uses", "run", "with", "if"})

    def test_jobs_wait_for_those_whose_files_they_take(self):
        self.assertEqual({name: job.get("needs", []) for name, job in self.jobs.items()},
                         {"build": [], "shard": "build", "merge": ["build", "shard"]})

    def test_the_matrix_has_each_shard_once(self):
        strategy = self.jobs["shard"]["strategy"]
        self.assertEqual(strategy["fail-fast"], "false")  # the others are worth having, and a job can be run again
        self.assertEqual(strategy["matrix"], {"shard": [str(number) for number in range(len(strategy["matrix"]["shard"]))]})

    def test_what_is_uploaded_is_what_is_downloaded(self):
        def artifacts(job, action):
            return [step["with"] for step in self.jobs[job]["steps"] if step.get("uses", "").startswith(f"actions/{action}")]

        [program], [shard] = artifacts("build", "upload-artifact"), artifacts("shard", "upload-artifact")
        self.assertIn({"name": program["name"]}, artifacts("shard", "download-artifact"))
        self.assertIn({"name": program["name"]}, artifacts("merge", "download-artifact"))
        patterns = [taken["pattern"] for taken in artifacts("merge", "download-artifact") if "pattern" in taken]
        self.assertEqual([re.fullmatch(pattern.replace("*", ".*"), shard["name"]) is not None for pattern in patterns], [True])


class Snakemake(unittest.TestCase):
    """Its rules; that it runs is of tests/bare/run snakemake."""

    def test_a_store_is_no_output(self):
        text = (FILES / "Snakefile").read_text("utf-8")
        rules = dict(re.findall(r"^rule (\w+):\n((?:    .*\n)+)", text, re.M))
        self.assertEqual(rules.keys(), {"campaign", "shard"})
        self.assertIn('output: touch("shard-{n}.done")', rules["shard"])
        self.assertIn("--resume", rules["shard"])


if __name__ == "__main__":
    unittest.main()
