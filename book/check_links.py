"""Checks that every local link and picture of the built book leads somewhere, and that no page loads anything from a network.

    python3 book/check_links.py book/book
"""
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


def main():
    root = Path(sys.argv[1]).resolve()
    pages = {}
    for path in root.rglob("*.html"):
        page = Page()
        page.feed(path.read_text(encoding="utf-8"))
        pages[path] = page
    faults = []
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
    print("\n".join(faults) or f"{len(pages)} pages, every link leads somewhere")
    sys.exit(bool(faults) or not pages)


if __name__ == "__main__":
    main()
