#!/usr/bin/python3
"""What job.schema.json was made by: `extract.py FILE`, FILE being the OpenAPI document of batch/v1, to stdout.

Of its schemas those that a Job is made of, as JSON Schema: without descriptions, without extensions of Kubernetes, and
`nullable` and `format`, which JSON Schema does not have, left away. Nothing is added.
"""
import hashlib
import json
import pathlib
import sys

JOB = "io.k8s.api.batch.v1.Job"
NOT_TAKEN = ("description", "format", "nullable", "default")


def plain(node):
    """A schema without what is not taken, and the names that it refers to."""
    if not isinstance(node, dict):
        return node, set()
    result, names = {}, set()
    for key, value in node.items():
        if key in NOT_TAKEN and not isinstance(value, dict) or key == "default" or key.startswith("x-kubernetes-"):
            continue
        if key == "$ref":
            names.add(value.rsplit("/", 1)[1])
            result[key] = value.replace("#/components/schemas/", "#/definitions/")
        elif key == "properties":
            result[key] = {}
            for name, schema in value.items():
                result[key][name], found = plain(schema)
                names |= found
        elif key in ("allOf", "anyOf", "oneOf"):
            parts = [plain(part) for part in value]
            result[key] = [part for part, _ in parts]
            names |= set().union(*[found for _, found in parts])
        else:
            result[key], found = plain(value)
            names |= found
    return result, names


def main():
    text = pathlib.Path(sys.argv[1]).read_bytes()
    schemas = json.loads(text)["components"]["schemas"]
    definitions, wanted = {}, {JOB}
    while wanted:
        name = wanted.pop()
        definitions[name], names = plain(schemas[name])
        wanted |= names - definitions.keys()
    head = {"$comment": f"of the OpenAPI document of batch/v1 with SHA-256 {hashlib.sha256(text).hexdigest()}; README.md",
            "$schema": "http://json-schema.org/draft-07/schema#", "$ref": f"#/definitions/{JOB}"}
    body = ",\n".join(f"{json.dumps(name)}: {json.dumps(definitions[name], sort_keys=True)}" for name in sorted(definitions))
    print(json.dumps(head)[:-1] + ', "definitions": {\n' + body + "\n}}")


if __name__ == "__main__":
    main()
