#!/usr/bin/python3
"""Makes the manuals: crepesd.yaml(5) from the reference configuration, crepesctl(1) from the tool's own help.
    manual.py configuration crepesd.yaml >crepesd.yaml.5
    manual.py tool [EMULATOR...] path/to/crepesctl >crepesctl.1"""
import re
import subprocess
import sys


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return re.sub(r"^([.'])", r"\\&\1", text, flags=re.MULTILINE)


def heading(name, section, about):
    return [f'.TH {name.upper()} {section} "" "CREPES" "{about}"', ".SH NAME"]


class Key:
    def __init__(self, path, default, about):
        self.path, self.default, self.about = path, default, about


def keys_of(reference):
    """Every key of the reference once, with the comment above it. Of a list, the first item counts."""
    parents, about, seen = [], [], set()
    for line in reference.splitlines():
        # An optional list is a comment itself; the keys of its items are as deep as any others.
        line = re.sub(r"^( *)# {3,5}(\S)", r"\1    \2", line)
        depth, text = len(line) - len(line.lstrip()), line.strip()
        key = re.fullmatch(r"(?:# )?([A-Za-z_]\w*):(?: (.*))?", text) if not text.startswith("# ") or text.endswith(":") else None
        if text.startswith("# ") and not key:
            about.append(text[2:])
        elif text == "":
            about = []
        elif key:
            parents = [parent for parent in parents if parent[0] < depth] + [(depth, key[1])]
            path = ".".join(name for _, name in parents)
            if path not in seen:
                seen.add(path)
                yield Key(path, None if text.startswith("#") else key[2], " ".join(about))
            about = []


def configuration(file):
    out = heading("crepesd.yaml", 5, "File formats")
    out += ["crepesd.yaml \\- configuration of crepesd", ".SH DESCRIPTION",
            "YAML. Unknown keys are errors. A key may be omitted unless it is required; its default then applies.",
            "Numbers in brackets are bounds.", '"Live" sections change with', ".BR \"systemctl reload crepesd\" ;",
            '"restart" ones when the daemon starts again.', ".B crepesd \\-\\-check\\-config", "prints every fault of a file.", ".SH KEYS"]
    for key in keys_of(open(file).read()):
        if "." not in key.path:
            out += [f".SS {roff(key.path)}", roff(key.about)]
            continue
        out += [".TP", f".B {roff(key.path)}", roff(key.about) or "\\&"]
        # The members of the swarm are examples.
        if key.default is not None and "required" not in key.about and not key.path.startswith("swarm.members."):
            out += [".br", f"Default: {roff(key.default)}"]
    return out + [".SH SEE ALSO", ".BR crepesd (8),", ".BR crepesctl (1)"]


def commands_in(help):
    return re.findall(r"^  ([a-z][\w-]*)  ", help.split("Subcommands:")[1], re.MULTILINE)


def entries(help):
    """The help of a command as roff that lines break in: what it is for, its usage, and each option as a tagged paragraph."""
    about, *sections = re.split(r"\n\n+", re.sub(r"\nUsage:", r"\n\nUsage:", help, count=1))
    out = [roff(about) + "."]
    for section in sections:
        title, *lines = section.splitlines()
        if title.startswith("Usage: "):
            out += [".PP", f".B {roff(title.removeprefix('Usage: '))}"]
        for line in lines:
            # The name, and its meaning behind it or in the next line.
            entry = re.fullmatch(r"  (\S.{0,26}?)  +(\S.*)|  (\S.*)", line)
            if entry:
                out += [".TP", f".B {roff(entry[1] or entry[3])}"] + ([roff(entry[2])] if entry[2] else [])
            else:
                out += [roff(line.strip())]
    return out


def tool(*program):
    def help_of(*arguments):
        text = subprocess.run([*program, *arguments, "--help"], check=True, capture_output=True, text=True).stdout.strip()
        return text.replace(program[-1], "crepesctl").split("\n\nExit codes:")[0]

    out = heading("crepesctl", 1, "User commands")
    out += ["crepesctl \\- watch, set up and replay robots that localize each other", ".SH SYNOPSIS", ".B crepesctl", ".I COMMAND",
            "[options]", ".SH DESCRIPTION", "The tool around", ".BR crepesd (8).", ".SH COMMANDS"]
    commands = commands_in(help_of())
    assert commands
    for command in commands:
        help = help_of(command)
        out += [f".SS {roff(command)}", *entries(help)]
        if "Subcommands:" in help:
            for inner in commands_in(help):
                out += [f".SS {roff(command)} {roff(inner)}", *entries(help_of(command, inner))]
    return out + [".SH EXIT STATUS", "0 done; 1 wrong input, or no answer (the reason is on stderr); 2 wrong usage.",
                  ".SH JSON", "With \\-\\-json, standard output contains only JSON objects, one per line. Progress, refused input and",
                  "errors go to standard error.",
                  ".SH SEE ALSO", ".BR crepesd (8),", ".BR crepesd.yaml (5)"]


if __name__ == "__main__":
    kind, *source = sys.argv[1:]
    print("\n".join({"configuration": configuration, "tool": tool}[kind](*source)))
