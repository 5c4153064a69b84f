#!/usr/bin/python3
"""Installs the documents. Links between them work where they are; a link to what is not installed becomes text.
    documents.py SOURCE DIRECTORY"""
import os
import pathlib
import re
import shutil
import sys

DOCUMENTS = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "CITATION.cff", "SECURITY.md", "config/README.md", "config/crepesd.yaml",
             "config/docs", "config/examples", "config/libraries", "daemon/ctl/view/README.md", "estimator/vision/README.md",
             "firmware/HARDWARE.md", "firmware/led_board/README.md", "firmware/pictures", "systemd/MESH.md", "systemd/README.md", "systemd/mesh", "tests/bench/README.md",
             "tests/faults/results.md", "tests/study/README.md"]
# Debian has its examples at one place; all else is as deep as in the source.
MOVED = {"config/examples": "examples", "config/crepesd.yaml": "examples/crepesd.yaml", "systemd/mesh": "examples/mesh"}
MAKERS = shutil.ignore_patterns("draw.py", "make_pictures.sh", "make_recording.sh", "__pycache__", "*.egg-info", "build")


def installed(name):
    """Where the package has a file or directory of the source, both relative."""
    for old, new in MOVED.items():
        if name == old or name.startswith(old + "/"):
            return new + name[len(old):]
    return name


def copy(source, target):
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, target, ignore=MAKERS, copy_function=shutil.copyfile, dirs_exist_ok=True)
    else:
        shutil.copyfile(source, target)


def with_links_that_work(place, name, text):
    def link(found):
        text, target, anchor = found[1], found[2], found[3] or ""
        if not target or ":" in target:
            return found[0]
        target = installed(os.path.normpath(os.path.join(os.path.dirname(name), target)))
        if not (place / target).exists():
            return text
        return f"[{text}]({os.path.relpath(target, os.path.dirname(installed(name)))}{anchor})"

    return re.sub(r"\[([^\]]*)\]\(([^)#\s]*)(#[^)]*)?\)", link, text)


def main(source, place):
    for name in DOCUMENTS:
        copy(source / name, place / installed(name))
    for name in DOCUMENTS:
        pages = [source / name] if name.endswith(".md") else (source / name).rglob("*.md")
        for page in (str(page.relative_to(source)) for page in pages):
            target = place / installed(page)
            target.write_text(with_links_that_work(place, page, target.read_text()))


if __name__ == "__main__":
    main(*map(pathlib.Path, sys.argv[1:]))
