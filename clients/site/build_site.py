#!/usr/bin/env python3
"""The project's documents as a web site: build_site.py SOURCES OUT.

Every Markdown file of the tree becomes a page at the same place, with the pictures that it shows and a list of all pages beside
it; a link to a Markdown file becomes one to its page, a link to a source file shows the file. Nothing is fetched from elsewhere: the site is
read from a disk or from any web server. `build_site.py --check SOURCES` builds nothing and prints every link that leads nowhere, to a
file or to a heading; it exits with 1 when there is one. Needs Debian's python3-markdown.
"""
import html
import pathlib
import re
import shutil
import subprocess
import sys
import urllib.parse

import markdown

START = "clients/site/start.md"
PICTURES = {".svg", ".png", ".jpg"}
EXTENSIONS = ["tables", "fenced_code", "toc", "sane_lists", "md_in_html"]

# Which heading of the list of pages a folder belongs under, the longest that fits.
SECTIONS = (("", "The project"), ("clients", "Programs and libraries"), ("clients/calibration", "Calibration"), ("daemon", "The daemon"),
            ("drivers", "Devices"), ("idl", "The contract"), ("systemd", "As a service"), ("bench", "Figures"), ("tests", "How it is proven"))

PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><link rel="stylesheet" href="{root}site.css"></head>
<body><nav>{navigation}</nav><main>{body}</main></body></html>
"""

STYLE = """:root { color-scheme: light dark; --ink: #1d232b; --paper: #fff; --faint: #5b6673; --line: #d8dee6; --link: #0b63b5; --code: #f3f5f8; }
@media (prefers-color-scheme: dark) { :root { --ink: #e3e8ee; --paper: #14181d; --faint: #97a3b0; --line: #313943; --link: #6cb2ff; --code: #1d232b; } }
body { margin: 0; display: flex; font: 16px/1.55 system-ui, sans-serif; color: var(--ink); background: var(--paper); }
nav { overflow-wrap: anywhere; flex: 0 0 16rem; padding: 1.5rem 1rem; border-right: 1px solid var(--line); font-size: 14px; box-sizing: border-box; height: 100vh; overflow: auto; position: sticky; top: 0; }
nav h2 { font-size: 12px; text-transform: uppercase; letter-spacing: .05em; color: var(--faint); margin: 1.2rem 0 .3rem; border: 0; }
nav a { display: block; padding: .1rem 0; } nav a.here { font-weight: 600; color: var(--ink); }
main { flex: 1 1 auto; max-width: 62rem; padding: 1.5rem 2.5rem 4rem; min-width: 0; }
a { color: var(--link); text-decoration: none; } a:hover { text-decoration: underline; }
h1, h2, h3 { line-height: 1.25; } h2 { margin-top: 2.2rem; padding-bottom: .2rem; border-bottom: 1px solid var(--line); }
pre, code { font: 13.5px/1.45 ui-monospace, monospace; background: var(--code); } code { padding: .1em .3em; border-radius: 3px; }
pre { padding: .8rem 1rem; overflow: auto; border-radius: 5px; } pre code { padding: 0; }
table { border-collapse: collapse; display: block; overflow: auto; font-size: 14px; } th, td { border: 1px solid var(--line); padding: .35rem .6rem; vertical-align: top; text-align: left; }
img { max-width: 100%; height: auto; background: #fff; }
@media (max-width: 50rem) { body { display: block; } nav { position: static; height: auto; border: 0; } main { padding: 1rem; } }
"""

OUTSIDE = re.compile(r"^(?:[a-z][a-z0-9+.-]*:|//)", re.IGNORECASE)
LINK = re.compile(r'(<(?:a|img)\b[^>]*?\b(?:href|src)=")([^"]*)(")')


def documents_of(sources):
    """The Markdown files that belong to the tree, as paths relative to it."""
    listed = subprocess.run(["git", "-C", str(sources), "ls-files", "-co", "--exclude-standard", "*.md"], capture_output=True, text=True, check=True)
    return sorted(pathlib.PurePosixPath(line) for line in listed.stdout.splitlines())


def slug_of(heading, separator):
    """Anchors as code hosts make them, so that links work there and here."""
    words = re.sub(r"[^\w\s-]", "", heading.strip().lower())
    return re.sub(r"\s", separator, words)


def rendered(text):
    return markdown.markdown(text, extensions=EXTENSIONS, extension_configs={"toc": {"slugify": slug_of}}, output_format="html")


def title_of(text, path):
    found = re.search(r"^#\s+(.+)$", text, re.MULTILINE)
    return re.sub(r"[`*]", "", found[1]) if found else str(path)


def anchors_of(page):
    return set(re.findall(r'\bid="([^"]+)"', page))


def resolved(path, link):
    """(file relative to the tree, or None when outside of it; anchor) of a link in the document at `path`."""
    target, _, anchor = urllib.parse.unquote(html.unescape(link)).partition("#")
    if not target:
        return path, anchor
    parts = []
    for part in (path.parent / target).parts:
        if part == "..":
            if not parts:
                return None, anchor
            parts.pop()
        elif part != ".":
            parts.append(part)
    return pathlib.PurePosixPath(*parts), anchor


def dead_links(sources, documents):
    pages = {path: rendered((sources / path).read_text()) for path in documents}
    for path, page in pages.items():
        for _, link, _ in LINK.findall(page):
            if OUTSIDE.match(link):
                continue
            target, anchor = resolved(path, link)
            if target is None or not (sources / target).exists():
                yield f"{path}: {link} leads to no file"
            elif anchor and target in pages and anchor not in anchors_of(pages[target]):
                yield f"{path}: {link} leads to no heading"


def relative(from_page, to):
    up = len(from_page.parts) - 1
    return "../" * up + str(to)


def page_of(path):
    """Where a document's page lies: a README is its folder's index."""
    return path.with_name("index.html") if path.name == "README.md" else path.with_suffix(".html")


def section_of(path):
    folder = str(path.parent) + "/"
    return max((prefix for prefix, _ in SECTIONS if not prefix or folder.startswith(prefix + "/")), key=len)


def navigation(here, titles):
    text = f'<a href="{relative(page_of(here), page_of(pathlib.PurePosixPath(START)))}"><strong>Start here</strong></a>'
    for prefix, heading in SECTIONS:
        inside = [path for path in titles if section_of(path) == prefix and str(path) != START]
        if inside:
            text += f"<h2>{heading}</h2>"
        for path in inside:
            mark = ' class="here"' if path == here else ""
            text += f'<a{mark} href="{relative(page_of(here), page_of(path))}">{html.escape(titles[path])}</a>'
    return text


def with_links_to_pages(page, here, documents, used):
    """Links of a page as they are in the site; notes files that it shows in `used`."""
    def changed(found):
        before, link, after = found.groups()
        if OUTSIDE.match(link) or link.startswith("#"):
            return found[0]
        target, anchor = resolved(here, link)
        if target is None:
            return found[0]
        if target / "README.md" in documents:
            target = target / "README.md"
        if target in documents:
            target = page_of(target)
        else:
            used.add(target)
        return before + relative(page_of(here), target) + ("#" + anchor if anchor else "") + after

    return LINK.sub(changed, page)


def copy_used(sources, out, used):
    for path in used:
        if (sources / path).is_file():
            (out / path).parent.mkdir(parents=True, exist_ok=True)
            # A browser shows text as such when it does not know the kind of file.
            shutil.copyfile(sources / path, out / path)


def build(sources, out):
    documents = documents_of(sources)
    texts = {path: (sources / path).read_text() for path in documents}
    titles = {path: title_of(text, path) for path, text in texts.items()}
    used = set()
    for path, text in texts.items():
        body = with_links_to_pages(rendered(text), path, set(documents), used)
        page = out / page_of(path)
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(PAGE.format(title=html.escape(titles[path]), root=relative(page_of(path), ""), navigation=navigation(path, titles), body=body))
    copy_used(sources, out, used)
    (out / "site.css").write_text(STYLE)
    return len(documents)


def self_test():
    """Dead links are found, living ones are not."""
    import tempfile
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "a").mkdir()
        (root / "README.md").write_text("# One `two`: three\n[x](a/b.md#a-heading) [y](a) [z](none.md) [w](a/b.md#none) [v](https://example.org/x)\n")
        (root / "a/b.md").write_text("# B\n## A heading\n[up](../README.md#one-two-three) [out](../../x) ![p](p.png)\n")
        subprocess.run(["git", "init", "-q", folder], check=True)
        found = sorted(dead_links(root, documents_of(root)))
    expected = ["README.md: a/b.md#none leads to no heading", "README.md: none.md leads to no file", "a/b.md: ../../x leads to no file",
                "a/b.md: p.png leads to no file"]
    if found != expected:
        sys.exit(f"found {found}, expected {expected}")


def main(arguments):
    if arguments == ["--self-test"]:
        self_test()
    elif len(arguments) == 2 and arguments[0] == "--check":
        sources = pathlib.Path(arguments[1])
        dead = list(dead_links(sources, documents_of(sources)))
        print("\n".join(dead) or f"{len(documents_of(sources))} documents, no dead link")
        sys.exit(1 if dead else 0)
    elif len(arguments) == 2 and not arguments[0].startswith("-"):
        count = build(pathlib.Path(arguments[0]), pathlib.Path(arguments[1]))
        print(f"{count} pages; begin at {pathlib.Path(arguments[1]) / page_of(pathlib.PurePosixPath(START))}")
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main(sys.argv[1:])
