"""Checks that every local link and picture of the built book leads somewhere, that no page loads anything from a network, and that every listing
in Rust or TOML is a part of a file of the repository, which is compiled and run or read there.

    python3 book/check_links.py book/book
"""
import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlparse


class Page(HTMLParser):
    def __init__(self):
        super().__init__()
        self.ids, self.links, self.loads = set(), [], []

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        if "id" in attrs:
            self.ids.add(attrs["id"])
        if tag == "a" and attrs.get("href"):
            self.links.append(attrs["href"])
        if tag in ("img", "script", "iframe", "source") and attrs.get("src"):
            self.loads.append(attrs["src"])
        if tag == "link" and attrs.get("href") and attrs.get("rel") != "canonical":
            self.loads.append(attrs["href"])


def free_listings(source):
    """Listings in Rust or TOML that stand in a page by themselves or name a part that there is not."""
    faults = []
    for page in sorted(source.rglob("*.md")):
        for language, body in re.findall(r"^```(rust|toml)\b[^\n]*\n(.*?)^```", page.read_text(encoding="utf-8"), re.S | re.M):
            place = re.fullmatch(r"\{\{#include ([^}:]+)(?::([\w-]+))?\}\}\n", body)
            file = place and (page.parent / place[1]).resolve()
            where = f"{page.relative_to(source)}: a listing in {language}"
            if not place:
                faults.append(f"{where} is not an include of a file that is compiled or read: {body.splitlines()[0] if body else ''}")
            elif not file.is_file() or (place[2] and f"ANCHOR: {place[2]}\n" not in file.read_text(encoding="utf-8")):
                faults.append(f"{where} names {place[1]}{':' + place[2] if place[2] else ''}, which there is not")
    return faults


def main():
    root = Path(sys.argv[1]).resolve()
    pages = {}
    for path in root.rglob("*.html"):
        page = Page()
        page.feed(path.read_text(encoding="utf-8"))
        pages[path] = page
    faults = free_listings(root.parent / "src")
    for path, page in pages.items():
        if path.name in ("print.html", "toc.html", "404.html"):
            continue
        for target in page.links + page.loads:
            url = urlparse(target)
            if url.scheme or url.netloc:
                if target in page.loads and url.scheme != "data":
                    faults.append(f"{path.relative_to(root)} loads {target} from a network")
                continue
            file = path if not url.path else (path.parent / unquote(url.path)).resolve()
            if file.is_dir():
                file = file / "index.html"
            if not file.exists():
                faults.append(f"{path.relative_to(root)}: {target} leads nowhere")
            elif url.fragment and file in pages and unquote(url.fragment) not in pages[file].ids:
                faults.append(f"{path.relative_to(root)}: {target} names no place on that page")
    print("\n".join(faults) or f"{len(pages)} pages, every link leads somewhere, every listing is of a file")
    sys.exit(bool(faults) or not pages)


if __name__ == "__main__":
    main()
