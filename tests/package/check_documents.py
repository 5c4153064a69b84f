#!/usr/bin/python3
"""Whether the documents say what is there: keys exist, links lead somewhere, the manual has all options.
    check_documents.py SOURCE crepesd"""
import pathlib
import re
import subprocess
import sys

source, crepesd = pathlib.Path(sys.argv[1]), sys.argv[2]
sys.path.insert(0, str(source / "config/packaging"))
from manual import keys_of

pages = [source / "README.md", *sorted(source.glob("config/docs/**/*.md")), *sorted(source.glob("systemd/*.md"))]
keys = {key.path for key in keys_of((source / "config/crepesd.yaml").read_text())}
sections = {key.split(".")[0] for key in keys}
keys_named = 0
faults = []
for page in pages:
    for number, line in enumerate(page.read_text().splitlines(), 1):
        where = f"{page.relative_to(source)}:{number}"
        for named in re.findall(r"`([a-z]\w*(?:\.[A-Za-z_]\w*)+)`", line):
            if named.split(".")[0] in sections and not named.endswith((".yaml", ".md", ".py")):
                keys_named += 1
                if named not in keys:
                    faults.append(f"{where}: {named}: no such key")
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", line):
            if not (page.parent / link).exists():
                faults.append(f"{where}: {link}: no such file")
manual = (source / "config/packaging/crepesd.8").read_text().replace("\\-", "-")
options = set(re.findall(r"--[a-z-]+", subprocess.run([crepesd, "--help"], capture_output=True, text=True, check=True).stdout))
faults += [f"crepesd.8: nothing of {option}" for option in sorted(options) if option not in manual]
assert len(pages) > 10 and keys_named > 50 and len(options) > 4, "looked at too little to mean anything"
print("\n".join(faults) or f"{len(pages)} pages, {keys_named} keys, {len(options)} options: all as they are")
sys.exit(bool(faults))
