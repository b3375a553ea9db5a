#!/usr/bin/env python3
"""Prints the first Python example of a Markdown page."""

import re
import sys

with open(sys.argv[1], encoding="utf-8") as file:
    print(re.search(r"```python\n(.*?)```", file.read(), re.DOTALL).group(1))
