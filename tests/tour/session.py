"""Parses console blocks of a document: commands and their output.

In a block marked ```console, a line `$ …` is a command, and the lines below are its output. `…` matches any text within
a line, and any lines if it is alone.
"""

import re


def commands(text):
    """Returns [(command, [lines])], in the order of the document."""
    found = []
    for block in re.findall(r"^```console\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        for line in block.splitlines():
            if line.startswith("$ "):
                found.append((line[2:], []))
            else:
                found[-1][1].append(line)
    return found


def pattern(lines):
    """Returns a pattern that matches the whole output."""
    return re.compile("".join("(?:.*\n)*?" if line == "…" else
                              ".*".join(re.escape(part) for part in line.split("…")) + "\n" for line in lines))
