#!/usr/bin/python3
"""Checks the SPDX lists of the packages: well formed, and complete for all parts that compiler and linker used.

usage: sbom_test.py BUILD_DIRECTORY       (a build by Ninja, on a distribution with dpkg)
"""

import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import unittest
import urllib.parse

from license_expression import get_spdx_licensing

BUILD = os.path.abspath(sys.argv.pop(1))
LIBRARIES = [f"emulator/liblk_{name}.a" for name in ("core", "config")]
# Headers of these packages only declare code of the kernel, of shared libraries or of the compiler.
DECLARATIONS = re.compile(r"linux-libc-dev|libc6-dev|libgcc-[0-9]+-dev|libclang-common-[0-9]+-dev|libmujoco-dev")
# lk-emu-body exists only with MuJoCo.
PACKAGES = [name for name in ("lk-emu", "lk-emu-dev", "lk-emu-body") if os.path.exists(f"{BUILD}/sbom/{name}.spdx.json")]


def run(*command):
    return subprocess.run(command, cwd=BUILD, check=True, stdout=subprocess.PIPE, text=True).stdout


def inputs(target):
    return run("ninja", "-t", "inputs", target).split()


def headers(target):
    """Returns the system headers of a target, as recorded by the compiler."""
    objects = [name for name in inputs(target) if name.endswith(".o")]
    noted = run("ninja", "-t", "deps", *objects)
    return {line.strip() for line in noted.splitlines() if line.startswith("    /usr/")}


def linked(target):
    """Returns the system files of which the linker takes parts, without shared libraries."""
    command = run("ninja", "-t", "commands", target).splitlines()[-1]
    with tempfile.TemporaryDirectory() as scratch:
        words = shlex.split(command.split("&&")[1])
        words[words.index("-o") + 1] = os.path.join(scratch, "program")
        said = run(*words, "-Wl,--trace")
    names = {os.path.realpath(os.path.join(BUILD, line)) for line in said.splitlines()}
    return {name for name in names if name.startswith("/usr/") and name.endswith((".a", ".o"))}


def debian_packages(files):
    """Returns the Debian packages of these files."""
    said = run("dpkg-query", "-S", *sorted({os.path.realpath(name) for name in files}))
    return {line.split(":")[0] for line in said.splitlines()}


def document(package):
    with open(os.path.join(BUILD, "sbom", f"{package}.spdx.json"), encoding="utf-8") as file:
        return json.load(file)


def purl_of(entry):
    """Returns package and version of an entry for Debian or its derivatives; None for others."""
    for reference in entry.get("externalRefs", ()):
        found = re.fullmatch(r"pkg:deb/[a-z]+/([^@]+)@([^?]+)\?arch=[a-z0-9]+", reference["referenceLocator"])
        if found:
            return tuple(urllib.parse.unquote(part) for part in found.groups())
    return None


def listed(package):
    """Returns the distribution's packages in the list."""
    return {purl[0] for purl in map(purl_of, document(package)["packages"]) if purl}


class Form(unittest.TestCase):
    """Requirements of SPDX 2.3 (its clauses 6, 7 and 11, and the JSON schema)."""

    def each(self):
        for package in PACKAGES:
            with self.subTest(package):
                yield package, document(package)

    def test_document_has_the_required_fields(self):
        for package, found in self.each():
            self.assertEqual(found["spdxVersion"], "SPDX-2.3")
            self.assertEqual(found["dataLicense"], "CC0-1.0")
            self.assertEqual(found["SPDXID"], "SPDXRef-DOCUMENT")
            self.assertTrue(found["name"].startswith(package))
            self.assertRegex(found["documentNamespace"], r"^https://[^#\s]+$")
            self.assertRegex(found["creationInfo"]["created"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
            for creator in found["creationInfo"]["creators"]:
                self.assertRegex(creator, r"^(Tool|Person|Organization): \S")

    def test_packages_have_the_required_fields(self):
        licensing = get_spdx_licensing()
        for _, found in self.each():
            for entry in found["packages"]:
                self.assertRegex(entry["SPDXID"], r"^SPDXRef-[A-Za-z0-9.-]+$")
                self.assertTrue(entry["name"])
                self.assertRegex(entry["downloadLocation"], r"^(NOASSERTION|https://\S+)$")
                self.assertIs(entry["filesAnalyzed"], False)
                self.assertTrue(entry["versionInfo"])
                for key in ("licenseConcluded", "licenseDeclared"):
                    self.assertEqual(licensing.validate(entry[key]).errors, [], entry[key])
                for reference in entry.get("externalRefs", ()):
                    self.assertEqual(reference["referenceCategory"], "PACKAGE-MANAGER")
                    self.assertEqual(reference["referenceType"], "purl")

    def test_relations_are_complete(self):
        for package, found in self.each():
            ids = [entry["SPDXID"] for entry in found["packages"]]
            self.assertEqual(len(set(ids)), len(ids))
            contained = set()
            for relation in found["relationships"]:
                if relation["relationshipType"] == "DESCRIBES":
                    self.assertEqual(relation["spdxElementId"], "SPDXRef-DOCUMENT")
                    self.assertEqual(relation["relatedSpdxElement"], "SPDXRef-" + package)
                else:
                    self.assertEqual(relation["relationshipType"], "CONTAINS")
                    self.assertEqual(relation["spdxElementId"], "SPDXRef-" + package)
                    contained.add(relation["relatedSpdxElement"])
            self.assertEqual(contained | {"SPDXRef-" + package}, set(ids))

    def test_versions_equal_the_installed_ones(self):
        for _, found in self.each():
            for entry in filter(purl_of, found["packages"]):
                name, version = purl_of(entry)
                self.assertEqual(run("dpkg-query", "-W", "-f", "${Version}", name), version)
                self.assertEqual(entry["versionInfo"], version)

    def test_list_names_all_files_of_web_vendor(self):
        web = os.path.join(os.path.dirname(__file__), "..", "..", "web", "vendor")
        found = {entry["packageFileName"]: entry for entry in document("lk-emu")["packages"] if "checksums" in entry}
        scripts = [name for name in os.listdir(web) if name.endswith(".js")]
        # One file represents each library: tests/vendor_test.py.
        self.assertEqual(sorted(name.split(".")[0] for name in found), sorted({name.split(".")[0] for name in scripts}))
        for name, entry in found.items():
            self.assertEqual(run("sha256sum", os.path.join(os.path.abspath(web), name)).split()[0],
                             entry["checksums"][0]["checksumValue"])


class Complete(unittest.TestCase):
    def test_lists_of_programs_cover_their_headers(self):
        for program in set(PACKAGES) - {"lk-emu-dev"}:
            used = {name for name in debian_packages(headers(program)) if not DECLARATIONS.fullmatch(name)}
            if "static" in document_kind():
                used |= debian_packages(linked(program))
            self.assertEqual(listed(program), used)

    def test_lists_of_libraries_cover_their_headers(self):
        used = set().union(*(debian_packages(headers(name)) for name in LIBRARIES))
        self.assertEqual(listed("lk-emu-dev"), {name for name in used if not DECLARATIONS.fullmatch(name)})


def document_kind():
    with open(os.path.join(BUILD, "CMakeCache.txt"), encoding="utf-8") as cache:
        return "static" if "LKEMU_STATIC:BOOL=ON" in cache.read() else "shared"


if __name__ == "__main__":
    unittest.main()
