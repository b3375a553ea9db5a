"""Hooks of MkDocs: pages from outside `docs`, links to files of the repository, notebooks.

A file outside `docs` has the same path in the site as in the repository; a file in `docs` has its
path without `docs/`. Links in Markdown are those of the repository and are rewritten here, so that
every page also works where the repository is browsed.
"""

import json
import os
import pathlib
import posixpath
import re
import subprocess

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Folder with `notebooks` (executed) and `commands.md`, filled by `.ci/site.sh`.
INPUT = pathlib.Path(os.environ.get("SITE_INPUT", ROOT / "target/site-input"))
PAGES = re.compile(r"^(validation|results|cases|studies)/.*\.md$")
TOP = ["ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md", "NOTATION.md"]
# Files that readers look at: shown as a page with highlighted text.
TEXT = {".toml": "toml", ".csv": "text", ".cff": "yaml", ".rs": "rust", ".py": "python",
        ".sh": "bash", ".jsonl": "json"}
LINES = 400
FENCE = re.compile(r"^( *)(```|~~~).*?^\1\2 *$", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"(`+)(?!`).+?(?<!`)\1(?!`)", re.DOTALL)
LINK = re.compile(r"(?P<open>\]\(|^\[[^\]\n]+\]: *)(?P<target>[^)\s]+)", re.MULTILINE)
SCHEME = re.compile(r"^([a-z]+:|#|//)")


def tracked():
    done = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True)
    return set(done.stdout.decode().split("\0")) - {""}


def site_path(path):
    """Path in the site of a file of the repository."""
    path = path.removeprefix("docs/")
    if path == "README.md":
        return "index.md"
    if path.endswith(".ipynb"):
        return path.removesuffix(".ipynb") + ".md"
    if posixpath.splitext(path)[1] in TEXT:
        return path + ".md"
    return path


def links(text):
    """Matches of links outside code."""
    blank = lambda match: re.sub(r"[^\n]", " ", match.group(0))
    bare = CODE.sub(blank, FENCE.sub(blank, text))
    return [m for m in LINK.finditer(bare) if not SCHEME.match(m.group("target"))]


def resolve(page, target, known):
    """Repository path of a link in the page, or an error."""
    name, _, anchor = target.partition("#")
    path = posixpath.normpath(posixpath.join(posixpath.dirname(page), name)) if name else page
    if path not in known:
        readme = posixpath.join(path, "README.md")
        if readme not in known:
            raise PluginError(f"{page}: there is no tracked file {target}")
        path = readme
    return path, anchor


def text_page(path):
    """Page that shows a text file."""
    lines = (ROOT / path).read_text(encoding="utf-8").splitlines()
    note = ""
    if len(lines) > LINES:
        note = f"The first {LINES} of {len(lines)} lines.\n\n"
    language = TEXT[posixpath.splitext(path)[1]]
    shown = "\n".join(lines[:LINES])
    raw = posixpath.basename(path)
    return (f"---\nsearch:\n  exclude: true\n---\n# {path}\n\n[Download]({raw})\n\n{note}"
            f"```` {language}\n{shown}\n````\n")


def notebook_page(path):
    """Page of an executed notebook, and its pictures as (name, bytes)."""
    import base64

    executed = INPUT / "notebooks" / posixpath.basename(path)
    if not executed.is_file():
        raise PluginError(f"{executed} is missing: run .ci/python.sh, which executes the notebooks")
    book = json.loads(executed.read_text(encoding="utf-8"))
    stem = posixpath.splitext(posixpath.basename(path))[0]
    parts, pictures = [], []
    for cell in book["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        if not source.strip():
            continue
        parts.append(f"```python\n{source}\n```")
        for output in cell.get("outputs", []):
            kind = output["output_type"]
            data = output.get("data", {})
            if kind == "error":
                raise PluginError(f"{path}: {output['ename']}: {output['evalue']}")
            if kind == "stream":
                shown = "".join(output["text"]).rstrip()
                # A progress bar ends its states with carriage returns; the last one counts.
                shown = "\n".join(line.split("\r")[-1] for line in shown.split("\n"))
                if shown.strip() and output["name"] == "stdout":
                    parts.append(f"```{{.text .output}}\n{shown}\n```")
            elif "image/png" in data:
                name = f"{stem}-{len(pictures) + 1}.png"
                pictures.append((name, base64.b64decode("".join(data["image/png"]))))
                parts.append(f"![Output of the cell above]({name})")
            elif "text/html" in data and "<table" in "".join(data["text/html"]):
                table = "".join(data["text/html"])
                table = re.sub(r"<style.*?</style>", "", table, flags=re.DOTALL)
                table = "\n".join(line for line in table.splitlines() if line.strip())
                parts.append(f'<div class="output">\n{table}\n</div>')
            elif "text/plain" in data:
                parts.append("```{.text .output}\n" + "".join(data["text/plain"]) + "\n```")
    note = f"*Notebook with the output of its last run; [download it]({posixpath.basename(path)}).*"
    first, _, rest = parts[0].partition("\n")
    parts[0] = f"{first}\n\n{note}\n{rest}"
    return "\n\n".join(parts) + "\n", pictures


def on_files(files, config):
    known = tracked()
    for path in sorted(known):
        if PAGES.match(path) or path in TOP:
            files.append(File.generated(config, site_path(path), abs_src_path=str(ROOT / path)))
    for path in sorted(known):
        if path.startswith("docs/") and path.endswith(".ipynb"):
            text, pictures = notebook_page(path)
            files.append(File.generated(config, site_path(path), content=text))
            folder = posixpath.dirname(site_path(path))
            for name, content in pictures:
                files.append(File.generated(config, posixpath.join(folder, name), content=content))
    commands = INPUT / "commands.md"
    if not commands.is_file():
        raise PluginError(f"{commands} is missing: build the site with .ci/site.sh")
    files.append(File.generated(config, "reference/commands.md", content=commands.read_text()))
    # Files outside `docs` that a page links to.
    for file in list(files.documentation_pages()):
        page = repository_path(file.src_uri, known)
        if page is None:
            continue
        for link in links((ROOT / page).read_text(encoding="utf-8")):
            if is_generated(page, link.group("target")):
                continue
            path, _ = resolve(page, link.group("target"), known)
            if path.startswith("docs/") or files.get_file_from_path(site_path(path)):
                continue
            if site_path(path) != path:
                content = text_page(path)
                files.append(File.generated(config, site_path(path), content=content))
            files.append(File.generated(config, path, abs_src_path=str(ROOT / path)))
    return files


def is_generated(page, target):
    """Whether a link points to a page that exists in the site only."""
    path = posixpath.normpath(posixpath.join(posixpath.dirname(page), target.split("#")[0]))
    return path in ("docs/reference/commands.md",) or path.startswith("docs/rust/")


def repository_path(src_uri, known):
    """Repository path of a page; none for a generated page."""
    for path in ("docs/" + src_uri, src_uri):
        if path in known and path.endswith(".md"):
            return path
    return None


def on_page_markdown(markdown, page, config, files):
    known = tracked()
    source = repository_path(page.file.src_uri, known)
    if source is None:
        return markdown
    folder = posixpath.dirname(page.file.src_uri)
    out, last = [], 0
    for link in links(markdown):
        target = link.group("target")
        if is_generated(source, target):
            continue
        path, anchor = resolve(source, target, known)
        new = posixpath.relpath(site_path(path), folder or ".")
        new += f"#{anchor}" if anchor else ""
        start, end = link.span("target")
        out += [markdown[last:start], new]
        last = end
    return "".join(out) + markdown[last:]


def on_post_page(output, page, config):
    """Replaces the worker shim of the offline plugin by a copy in the site."""
    base = "../" * page.url.count("/")
    return output.replace("https://unpkg.com/iframe-worker/shim", f"{base}assets/iframe-worker.js")
