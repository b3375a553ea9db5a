#!/usr/bin/env python3
"""Prints a page with the help of every command of the program. Usage: commands.py PROGRAM"""

import os
import re
import subprocess
import sys

PROGRAM = sys.argv[1]
ENTRY = re.compile(r"^  ([a-z][a-z-]*) ")


def help_of(words):
    environment = {**os.environ, "COLUMNS": "96", "NO_COLOR": "1"}
    done = subprocess.run([PROGRAM, *words, "--help"], check=True, capture_output=True,
                          text=True, env=environment)
    return done.stdout.rstrip()


def sections(words):
    text = help_of(words)
    title = " ".join(["grainwake", *words])
    yield f"## `{title}`\n\n```text\n{text}\n```\n"
    _, found, rest = text.partition("Commands:\n")
    if not found:
        return
    for line in rest.split("\n\n")[0].splitlines():
        entry = ENTRY.match(line + " ")
        if entry and entry.group(1) != "help":
            yield from sections([*words, entry.group(1)])


print("# All options\n")
print("The help of every command, as the program prints it. [Command line](command-line.md) explains")
print("the commands and their results.\n")
print("\n".join(sections([])))
