#!/usr/bin/python3
"""Whether the documents say what is there: keys exist, links lead somewhere, manuals have all options, and commands are as they are shown.
    check_documents.py SOURCE crepesd crepesctl"""
import pathlib
import re
import subprocess
import sys

source, crepesd, crepesctl = pathlib.Path(sys.argv[1]), *sys.argv[2:]
sys.path.insert(0, str(source / "config/packaging"))
from manual import commands_in, keys_of, tool



def output_of(*words):
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def options_in(text):
    return set(re.findall(r"--[a-z][a-z-]*", text))


tools = {command: output_of(crepesctl, command, "--help") for command in commands_in(output_of(crepesctl, "--help"))}
for command in list(tools):
    if "Subcommands:" in tools[command]:
        tools[command] += "".join(output_of(crepesctl, command, inner, "--help") for inner in commands_in(tools[command]))
pages = [source / "README.md", *sorted(source.glob("config/docs/**/*.md")), *sorted(source.glob("systemd/*.md")),
         source / "firmware/HARDWARE.md", *sorted(source.glob("config/examples/*/README.md"))]
keys = {key.path for key in keys_of((source / "config/crepesd.yaml").read_text())}
sections = {key.split(".")[0] for key in keys}
keys_named = calls = 0
faults = []
for page in pages:
    for number, line in enumerate(page.read_text().splitlines(), 1):
        where = f"{page.relative_to(source)}:{number}"
        for named in re.findall(r"`([a-z]\w*(?:\.[A-Za-z_]\w*)+)`", line):
            if named.split(".")[0] in sections and not named.endswith((".yaml", ".md", ".py")):
                keys_named += 1
                if named not in keys:
                    faults.append(f"{where}: {named}: no such key")
        for command, words in re.findall(r"\bcrepesctl ([a-z][a-z-]+)((?: (?!#|&&|[|;])[^ `]+)*)", line):
            if command in tools:
                calls += 1
                faults += [f"{where}: crepesctl {command} has no {option}" for option in sorted(options_in(words) - options_in(tools[command]))]
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", line):
            if not (page.parent / link).exists():
                faults.append(f"{where}: {link}: no such file")
manual = (source / "config/packaging/crepesd.8").read_text().replace("\\-", "-")
options = options_in(output_of(crepesd, "--help"))
faults += [f"crepesd.8: nothing of {option}" for option in sorted(options) if option not in manual]
readme = (source / "README.md").read_text()
faults += [f"README.md: nothing of crepesctl {command}" for command in tools if not re.search(rf"^(eval .*)?crepesctl {command}\b", readme, re.MULTILINE)]
rows = (source / "daemon/ctl/README.md").read_text()
faults += [f"daemon/ctl/README.md: nothing of {command}" for command in tools if f"`{command}`" not in rows]
pins = set(re.findall(r"\bPA\d+\b", (source / "firmware/led_board/README.md").read_text()))
for file in ("firmware/HARDWARE.md", "firmware/pictures/led_board.svg"):
    faults += [f"{file}: nothing of {pin}, which the firmware uses" for pin in sorted(pins) if not re.search(rf"\b{pin}\b", (source / file).read_text())]
completion, manual = output_of(crepesctl, "completion", "bash"), "\n".join(tool(crepesctl)).replace("\\-", "-")
for command, text in tools.items():
    faults += [f"completion: nothing of {option} of {command}" for option in sorted(options_in(text)) if option not in completion]
    faults += [f"crepesctl.1: nothing of {option} of {command}" for option in sorted(options_in(text)) if option not in manual]
assert len(pins) == 8 and len(pages) > 10 and keys_named > 50 and len(options) > 4 and len(tools) > 15 and calls > 30, "looked at too little to mean anything"
print("\n".join(faults) or f"{len(pages)} pages, {keys_named} keys, {len(options)} options, {len(tools)} commands, {calls} calls: all as they are")
sys.exit(bool(faults))
