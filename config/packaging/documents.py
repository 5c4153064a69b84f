#!/usr/bin/python3
"""Installs the documents: with the same relative paths as in the source, so that links work. A link to what is not installed
becomes text.
    documents.py SOURCE DIRECTORY"""
import os
import pathlib
import re
import shutil
import sys

DOCUMENTS = ["README.md", "ARCHITECTURE.md", "CITATION.cff", "SECURITY.md", "config/README.md", "config/crepesd.yaml", "config/docs",
             "config/examples", "config/libraries", "daemon/ctl/view/README.md", "estimator/vision/README.md",
             "firmware/led_board/README.md", "systemd/MESH.md", "systemd/README.md", "systemd/mesh", "tests/bench/README.md",
             "tests/study/README.md"]
ELSEWHERE = {"config/crepesd.yaml": "config/examples/crepesd.yaml", "systemd/mesh": "config/examples/mesh"}
MAKERS = shutil.ignore_patterns("draw.py", "make_pictures.sh", "make_recording.sh", "__pycache__", "*.egg-info", "build")


def copy(source, target):
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, target, ignore=MAKERS, dirs_exist_ok=True)
    else:
        shutil.copy(source, target)


def with_links_that_work(page, text):
    def link(found):
        target = found[2].replace("CHANGELOG.md", "changelog.gz")
        is_there = ":" in target or not target or (page.parent / target).exists()
        return f"[{found[1]}]({target}{found[3]})" if is_there else found[1]

    return re.sub(r"(?<!!)\[([^\]]*)\]\(([^)#]*)(#[^)]*)?\)", lambda found: link([*found.group(0, 1, 2), found[3] or ""]), text)


def main(source, place):
    for name in DOCUMENTS:
        copy(source / name, place / name)
    for name, other in ELSEWHERE.items():
        copy(source / name, place / other)
    if not (place / "examples").is_symlink():
        os.symlink("config/examples", place / "examples")
    for page in place.rglob("*.md"):
        page.write_text(with_links_that_work(page, page.read_text()))


if __name__ == "__main__":
    main(*map(pathlib.Path, sys.argv[1:]))
