#!/usr/bin/python3
"""Whether the documents in Chinese still say what those in English say, as far as a program can tell.

Compared are the things that are the same in any language: headings by level, code without its comments, code
words, options, and in every row of a table that begins with one the keys, numbers and names. Links of all documents
have to lead somewhere. Without arguments it looks at the source tree it lies in; `docs_test.py DIR` at another.
"""
import itertools
import pathlib
import re
import sys

CODE_WORD = re.compile(r"``(.+?)``|`([^`]+)`", re.S)
NUMBER = re.compile(r"0x[0-9A-Fa-f]+|(?<![\w.])\d+(?:[,_]\d{3})*(?:\.\d+)?")
NAME = re.compile(r"\b[A-Za-z]\w*(?:\\\|\w+)+|\b[A-Za-z]+(?:_[A-Za-z0-9]+)+\b")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def split(text):
    """The code blocks of a page, each a list of its lines without comments, and the lines that are not code."""
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
    """Of each row of a table that begins with code: its key, and the set of what no translation changes."""
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
    """Says where two lists first differ, in an item or in length."""
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


def check_links(page, text, say):
    prose = CODE_WORD.sub("", "\n".join(split(text)[1]))
    for link in LINK.findall(prose):
        if re.match(r"[a-z]+:", link):
            continue
        path = link.split("#")[0]
        if path and not (page.parent / path).exists():
            say(f"link {link} leads nowhere")


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent.parent).resolve()
    problems = []
    pairs = [(root / "README.md", root / "README.zh-CN.md")]
    pairs += [(page, root / "docs/zh-CN" / page.name) for page in sorted((root / "docs").glob("*.md"))]
    missing = [english.name for english, chinese in pairs if not chinese.exists()]
    pairs = [(english, chinese) for english, chinese in pairs if chinese.exists()]
    pages = {root / "README.md", root / "README.zh-CN.md", *(root / "docs").rglob("*.md")}

    for page in sorted(pages):
        name = page.relative_to(root)
        check_links(page, page.read_text("utf-8"), lambda what, name=name: problems.append(f"{name}: {what}"))
    for english, chinese in pairs:
        name, text = chinese.relative_to(root), chinese.read_text("utf-8")
        compare(english.read_text("utf-8"), text, lambda what, name=name: problems.append(f"{name}: {what}"))
        if not any((chinese.parent / link).resolve() == english for link in LINK.findall(text)):
            problems.append(f"{name}: has no link to {english.relative_to(root)}")
    if len(pairs) < 2:
        problems.append(f"{root}: no documents in two languages here")

    for problem in problems:
        print(problem)
    print(f"{len(pairs)} pages in two languages, {len(problems)} problems" +
          (f"; not in Chinese: {', '.join(missing)}" if missing else ""))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
