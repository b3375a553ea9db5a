#!/usr/bin/env python3
"""Checks the prose of all tracked files, as far as a script can.

1. No line of Markdown and no comment of Rust or TOML exceeds 100 columns. Table rows, links and
   fenced output are exempt: they cannot be broken.
2. Every decimal number has a digit before its point.
3. A doc comment is a sentence about its subject: it does not open with a phrase that lacks one.
4. Every source file that ARCHITECTURE.md names exists.
5. Results are "bitwise identical", and rates are "per" something: 5 ns per cell, not 5 ns a cell.
6. A page of docs/decisions has a status, context, decision and consequences, on one screen.
7. Values with their errors in docs/accuracy.md, "1.142 (+2.2 %)", are those of
   results/validation/full.json.

Prints each finding as `file:line: rule: text` and exits with 1 if there is any.
"""

import json
import re
import subprocess
import sys

WIDTH = 100
# Files whose content is generated or quoted.
EXEMPT = re.compile(r"^results/validation/(full|figures/README)\.md$")
BARE_DECIMAL = re.compile(r"(?<![\w.)\]}'\"/*])\.\d+(?![\w.]*[a-zA-Z_/])")
# Openings of doc comments without a subject of their own.
OPENINGS = re.compile(
    r"^(The same\b|Those\b|These\b|That\b|This is\b|What\b|Where\b|How\b|Why\b|When\b|Which\b|It\b|"
    r"Its\b|They\b|Their\b|Of\b|As\b|Some\b|One more\b|And\b|Also\b|Likewise\b|Ditto\b)"
)
# Private words for identical results.
BITS = re.compile(r"\b(same|identical) bits\b|\bbit[ -]for[ -]bit\b|\bto the (last )?bit\b")
RATE = re.compile(r"\d (ns|us|ms|s|min|[kMG]B|bytes?|frames|lines) an? [a-z]")
# Parts of a decision page, and its most lines.
DECISION_PARTS = ["Status:", "## Context", "## Decision", "## Consequences"]
SCREEN = 64
# Value with the sign and size of its error.
RESULT = re.compile(r"(\d+\.\d+) \(([+-][\d.]+) %\)")
INLINE_CODE = re.compile(r"`[^`]*`")
LINK = re.compile(r"\]\([^)]*\)|https?://\S+")


def tracked(*patterns):
    listing = subprocess.run(
        ["git", "ls-files", "-z", "--", *patterns], check=True, capture_output=True
    )
    names = listing.stdout.decode().split("\0")
    return [name for name in names if name and not EXEMPT.match(name)]


def words(prose):
    """Rules broken by the words of a line."""
    if BARE_DECIMAL.search(prose):
        yield "number without leading zero"
    if BITS.search(prose):
        yield 'write "bitwise identical"'
    if RATE.search(prose):
        yield 'write "per" for a rate'


def markdown(name, text):
    fenced = False
    for number, line in enumerate(text.split("\n"), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
            continue
        breakable = not (fenced or line.lstrip().startswith("|") or LINK.search(line))
        if len(line) > WIDTH and breakable:
            yield number, "longer than 100 columns", line
        if not fenced:
            for rule in words(INLINE_CODE.sub("", LINK.sub("", line))):
                yield number, rule, line
    if re.match(r"docs/decisions/\d", name):
        yield from decision(text)


def decision(text):
    lines = text.rstrip().split("\n")
    parts = [line for line in lines if line.startswith(("## ", "Status:"))]
    found = [part.split(" ")[0] if part.startswith("Status:") else part for part in parts]
    if found != DECISION_PARTS:
        yield 1, f"decision page without the parts {', '.join(DECISION_PARTS)}", lines[0]
    if len(lines) > SCREEN:
        yield len(lines), f"decision page longer than {SCREEN} lines", lines[0]


def rust(name, text):
    opening = True
    for number, line in enumerate(text.split("\n"), 1):
        code, mark, comment = line.partition("//")
        doc = re.match(r"^\s*//[/!]", line)
        if not mark or "://" in line and not code.strip() == "":
            opening = True
            continue
        if len(line) > WIDTH and "http" not in line:
            yield number, "longer than 100 columns", line
        for rule in words(INLINE_CODE.sub("", comment)):
            yield number, rule, line
        start = re.sub(r"^[/!]\s?", "", comment).strip()
        if doc and opening and OPENINGS.match(start):
            yield number, "doc comment without a subject", line
        opening = not doc


def toml(name, text):
    for number, line in enumerate(text.split("\n"), 1):
        if not line.lstrip().startswith("#"):
            continue
        if len(line) > WIDTH and "http" not in line:
            yield number, "longer than 100 columns", line
        for rule in words(INLINE_CODE.sub("", line)):
            yield number, rule, line


def architecture():
    with open("ARCHITECTURE.md", encoding="utf-8") as file:
        lines = file.read().split("\n")
    files = set(tracked("*.rs"))
    for number, line in enumerate(lines, 1):
        for name in re.findall(r"`([\w/]+\.rs)`", line):
            if not any(path == name or path.endswith("/" + name) for path in files):
                yield number, "no such file", name


def results():
    """Values and errors of docs/accuracy.md that no saved result has."""
    with open("results/validation/full.json", encoding="utf-8") as file:
        saved = json.load(file)["results"]
    known = [(r["value"], 100 * r["error"]) for r in saved if r["error"] is not None]

    def rounds_to(number, text):
        _, _, decimals = text.partition(".")
        return abs(number - float(text)) <= 0.501 * 10 ** -len(decimals)

    with open("docs/accuracy.md", encoding="utf-8") as file:
        lines = file.read().replace("*", "").split("\n")
    for number, line in enumerate(lines, 1):
        for value, error in RESULT.findall(line):
            if not any(rounds_to(v, value) and rounds_to(e, error) for v, e in known):
                yield number, "no such result in full.json", f"{value} ({error} %)"


def main():
    findings = 0
    for name, found in [("ARCHITECTURE.md", architecture()), ("docs/accuracy.md", results())]:
        for number, rule, line in found:
            findings += 1
            print(f"{name}:{number}: {rule}: {line}")
    for checker, patterns in [(markdown, ["*.md"]), (rust, ["*.rs"]), (toml, ["*.toml"])]:
        for name in tracked(*patterns):
            with open(name, encoding="utf-8") as file:
                text = file.read()
            for number, rule, line in checker(name, text):
                findings += 1
                print(f"{name}:{number}: {rule}: {line.strip()[:120]}")
    print(f"{findings} findings", file=sys.stderr)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
