# SPDX-License-Identifier: Apache-2.0
"""The language of the pages, as far as a program can judge it: sentences of at most 25 words, each with a subject of its own; no data that speaks."""
import re

MOST_WORDS = 25
BEGINNING = re.compile(r"(?:Which|What|Who|Whose|Of|And|So|Since|It|They|He|She|(?:This|That|These|Those)(?= (?:is|are|was|were|has|have|had|can|may|must|does|do|holds|repeats|leaves)\b))\b")
SPEECH = re.compile(r"\b(says?|said|saying|tells?|told|telling|hears?|heard|believe[sd]?|believing|doubt(?:s|ed|ing)?)\b", re.I)


def plain(text):
    """Prose of a page: code becomes one word, links their text; tables end a sentence at each cell, lists at each item; headings are names."""
    text = re.sub(r"<!--.*?-->", "", re.sub(r"^( *)```.*?^\1```", "\n\n", text, flags=re.S | re.M), flags=re.S)
    text = re.sub(r"^    .*$", "", text, flags=re.M) if " -> " in text else text
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", re.sub(r"`[^`]*`", "`code`", text))
    blocks = []
    for line in text.splitlines():
        if line.startswith("|"):
            blocks += ["", *[cell.strip() for cell in line.strip("|").split("|") for cell in (cell, "")], ""]
        elif line.startswith("#"):
            blocks.append("")  # a heading is a name
        elif re.match(r"\s*([*-]|\d+\.) ", line):
            blocks += ["", re.sub(r"^\s*(?:[*-]|\d+\.) ", "", line)]
        else:
            blocks.append(line)
    return [re.sub(r"[*_]{1,2}([^*_]+)[*_]{1,2}", r"\1", " ".join(one.split())) for one in "\n".join(blocks).split("\n\n") if one.strip()]


def sentences(text):
    for block in plain(text):
        yield from (one.strip() for one in re.split(r"(?<=[.!?])\s+(?=[A-Z`\"*(])", block) if one.strip())


def findings(page, text):
    found = []
    for one in sentences(text):
        words = [word for word in one.split() if re.search(r"\w", word)]
        if len(words) > MOST_WORDS:
            found.append(f"{page}: {len(words)} words: {one}")
        if not one.endswith("?") and BEGINNING.match(one):
            found.append(f"{page}: begins without a subject: {one}")
        for word in SPEECH.findall(one):
            found.append(f"{page}: '{word}' of data: {one}")
    return found
