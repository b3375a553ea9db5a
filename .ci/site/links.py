#!/usr/bin/env python3
"""Checks a built site: every link, picture, script and style sheet of its pages exists, every
anchor too, and nothing is loaded from another host.

Pages below `rust/`, which rustdoc makes, are targets only. Usage: links.py SITE
"""

import pathlib
import sys
from html.parser import HTMLParser
from urllib.parse import unquote, urlsplit

LOADED = {"img": "src", "script": "src", "source": "src", "iframe": "src"}


class Page(HTMLParser):
    def __init__(self):
        super().__init__()
        self.links, self.loaded, self.anchors = [], [], set()

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        for key in ("id", "name"):
            if values.get(key):
                self.anchors.add(values[key])
        if tag == "a" and values.get("href"):
            self.links.append(values["href"])
        if tag == "link" and values.get("href") and "canonical" not in (values.get("rel") or ""):
            self.loaded.append(values["href"])
        if tag in LOADED and values.get(LOADED[tag]):
            self.loaded.append(values[LOADED[tag]])


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    pages = {}
    for path in root.rglob("*.html"):
        if path.relative_to(root).parts[0] != "rust":
            page = Page()
            page.feed(path.read_text(encoding="utf-8"))
            pages[path] = page
    wrong, links = [], 0
    for path, page in sorted(pages.items()):
        name = path.relative_to(root)
        for target in page.loaded:
            if urlsplit(target).scheme in ("http", "https") or target.startswith("//"):
                wrong.append(f"{name}: loads {target} from another host")
        for target in page.links + page.loaded:
            parts = urlsplit(target)
            if parts.scheme or target.startswith("//"):
                continue
            links += 1
            place = path
            if parts.path:
                if parts.path.startswith("/"):
                    wrong.append(f"{name}: absolute link {target}")
                    continue
                place = (path.parent / unquote(parts.path)).resolve()
            if place.is_dir():
                place = place / "index.html"
            if not place.is_file():
                wrong.append(f"{name}: no file {target}")
            elif parts.fragment and place in pages:
                anchor = unquote(parts.fragment)
                if anchor not in pages[place].anchors and not anchor.startswith("__"):
                    wrong.append(f"{name}: no anchor {target}")
    if len(pages) < 50:
        wrong.append(f"only {len(pages)} pages")
    print(f"site: {len(pages)} pages, {links} links")
    if wrong:
        sys.exit("\n".join(sorted(set(wrong))))


if __name__ == "__main__":
    main()
