"""The console blocks of a document: what is typed, and what comes of it.

In a block marked ```console, a line `$ …` is typed, and the lines below it are what is printed then. `…` stands for
anything within a line, and for any lines where it stands alone.
"""

import re


def commands(text):
    """[(command, [lines])], in the order of the document."""
    found = []
    for block in re.findall(r"^```console\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        for line in block.splitlines():
            if line.startswith("$ "):
                found.append((line[2:], []))
            else:
                found[-1][1].append(line)
    return found


def pattern(lines):
    """Matches what is printed, every line of it."""
    return re.compile("".join("(?:.*\n)*?" if line == "…" else
                              ".*".join(re.escape(part) for part in line.split("…")) + "\n" for line in lines))
