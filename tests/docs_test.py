#!/usr/bin/python3
"""Checks the documents: `docs_test.py [DIR]`, where DIR is the source tree (default: its own). `docs_test.py --links
DIR` checks only the links of installed documents in DIR.

Fails if a link is dead, if README.md does not link to a page of docs/, if README.md exceeds MAX_README_LINES or the pages
exceed MAX_WORDS. Chinese pages that lag behind the English ones are listed, without failure. The other pages are in
English only. The comparison covers language-independent parts: headings by level, code without comments, code words and
options. In table rows that begin with a code word it also covers keys, numbers and names.
"""
import itertools
import pathlib
import re
import sys

MAX_README_LINES = 120
MAX_WORDS = 38_000
FOLDERS = ("start", "guides", "reference", "internals")
GENERATED = re.compile(r"<!-- begin .*?<!-- end [^>]*>", re.S)
CODE_WORD = re.compile(r"``(.+?)``|`([^`]+)`", re.S)
NUMBER = re.compile(r"0x[0-9A-Fa-f]+|(?<![\w.])\d+(?:[,_]\d{3})*(?:\.\d+)?")
NAME = re.compile(r"\b[A-Za-z]\w*(?:\\\|\w+)+|\b[A-Za-z]+(?:_[A-Za-z0-9]+)+\b")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def split(text):
    """Returns the code blocks of a page, each a list of its lines without comments, and the other lines."""
    blocks, prose, block, fence, language = [], [], None, False, ""
    for line in text.splitlines():
        opened = re.match(r"\s*```(\w*)", line)
        if opened:
            fence, language = not fence, opened[1]
            block = [] if fence else None
            if fence:
                blocks.append(block)
        elif fence or (line.startswith("    ") and (block is not None or not prose or not prose[-1].strip())):
            if block is None:
                blocks.append(block := [])
            comment = r"//.*" if language == "cpp" else r"(^|\s)#.*"
            line = " ".join(re.sub(comment, "", line).split())
            if line:
                block.append(line)
        elif line.strip() or block is None:
            block = None
            prose.append(line)
    return [block for block in blocks if block], prose


def code_words(text):
    return [" ".join((double or single).split()) for double, single in CODE_WORD.findall(text)]


def rows(prose):
    """Returns for each table row that begins with code its key, and the set of its language-independent parts."""
    found = []
    for line in prose:
        if not line.startswith("|"):
            continue
        first = re.split(r"(?<!\\)\|", line)[1]
        key = sorted(code_words(first) + re.findall(r"0x[0-9A-F]+", CODE_WORD.sub("", first)))
        if not key:
            continue
        text = CODE_WORD.sub(" ", re.sub(r"\]\([^)]*\)", "]", line))
        found.append((key, set(code_words(line)) | set(NUMBER.findall(text)) | set(NAME.findall(text))))
    return found


def difference(english, chinese):
    words = []
    if english - chinese:
        words.append("only in English: " + ", ".join(sorted(english - chinese)))
    if chinese - english:
        words.append("only in Chinese: " + ", ".join(sorted(chinese - english)))
    return "; ".join(words)


def compare_lists(what, english, chinese, say):
    """Reports the first difference of two lists, in an item or in length."""
    for number, (one, other) in enumerate(itertools.zip_longest(english, chinese, fillvalue="nothing"), 1):
        if one != other:
            say(f"{what} {number}: {one} in English, {other} in Chinese")
            return


def compare(english, chinese, say):
    (blocks_en, prose_en), (blocks_zh, prose_zh) = split(english), split(chinese)

    def levels(prose):
        return [re.match(r"#+", line)[0] for line in prose if re.match(r"#+ ", line)]

    compare_lists("heading", levels(prose_en), levels(prose_zh), say)
    compare_lists("line of code", *([line for block in blocks for line in block + ["end of the block"]]
                                    for blocks in (blocks_en, blocks_zh)), say)
    rows_en, rows_zh = rows(prose_en), rows(prose_zh)
    compare_lists("table row", *([" ".join(key) for key, _ in table] for table in (rows_en, rows_zh)), say)
    for (key, words_en), (key_zh, words_zh) in zip(rows_en, rows_zh):
        if key == key_zh and words_en != words_zh:
            say(f"table row {' '.join(key)}: {difference(words_en, words_zh)}")
    words_en, words_zh = ({*code_words("\n".join(prose))} for prose in (prose_en, prose_zh))
    if words_en != words_zh:
        say(f"code words: {difference(words_en, words_zh)}")
    options_en, options_zh = ({*OPTION.findall(text)} for text in (english, chinese))
    if options_en != options_zh:
        say(f"options: {difference(options_en, options_zh)}")


def links(text):
    """Returns the targets of a page's links into the source tree, without fragments."""
    prose = CODE_WORD.sub("", "\n".join(split(text)[1]))
    targets = [link.split("#")[0] for link in LINK.findall(prose) if not re.match(r"[a-z]+:", link)]
    return [target for target in targets if target]


def linked(page):
    return {(page.parent / link).resolve() for link in links(page.read_text("utf-8"))}


def dead_links(root):
    for page in sorted([*root.glob("*.md"), *(root / "docs").rglob("*.md")]):
        for link in links(page.read_text("utf-8")):
            if not (page.parent / link).exists():
                yield f"{page.relative_to(root)}: link {link} leads nowhere"


def pages(root):
    """Returns the English pages, without decision records."""
    return [page for folder in FOLDERS for page in sorted((root / "docs" / folder).glob("*.md"))]


def problems_of(root):
    """Yields the problems of the documents in any language."""
    readme = root / "README.md"
    yield from dead_links(root)
    for page in sorted({*pages(root)} - linked(readme)):
        yield f"README.md: has no link to {page.relative_to(root)}"
    words = sum(len(GENERATED.sub("", page.read_text("utf-8")).split()) for page in pages(root))
    if words > MAX_WORDS:
        yield f"docs: {words} words, max {MAX_WORDS}"
    length = len(readme.read_text("utf-8").splitlines())
    if length > MAX_README_LINES:
        yield f"README.md: has {length} lines, max {MAX_README_LINES}"


def lags(english, chinese):
    """Returns the differences in which a Chinese page lags behind."""
    if not english.exists():
        return ["has no English page"]
    found = []
    compare(english.read_text("utf-8"), chinese.read_text("utf-8"), found.append)
    if english.resolve() not in linked(chinese):
        found.append(f"has no link to {english.name} in English")
    return found


def main():
    if sys.argv[1:2] == ["--links"]:
        problems = [*dead_links(pathlib.Path(sys.argv[2]).resolve())]
        print("\n".join(problems))
        return 1 if problems else 0
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent.parent).resolve()
    problems = [*problems_of(root)]
    pairs = [(root / "README.md", root / "README.zh-CN.md")]
    zh = root / "docs/zh-CN"
    pairs += [(root / "docs" / page.relative_to(zh), page) for page in sorted(zh.rglob("*/*.md"))]  # terms.md is in Chinese only
    behind = {chinese.relative_to(root): found for english, chinese in pairs if (found := lags(english, chinese))}

    for page, found in behind.items():
        for what in found:
            print(f"behind: {page}: {what[:160]}")
    for problem in problems:
        print(problem)
    print(f"{len(pages(root))} pages, {len(pairs)} in Chinese, {len(behind)} of them behind, {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
