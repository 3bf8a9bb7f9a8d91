"""The commands that README and docs tell a reader to type, as they stand there."""

import pathlib
import re

# A fence without a language holds commands, a line each; other fences name what they hold (toml, text). In running text a
# command is a span of at least two words that begins with a program of ours, or with what builds and tests them.
_FENCE = re.compile(r"^ *```(\w*)\n(.*?)^ *```\s*$", re.MULTILINE | re.DOTALL)
_FIRST = re.compile(r"(sudo|cp|ctest|cmake|deploy/[\w-]+|(build/release/bin/)?farfeel(-[a-z]+)?)$")


def _said_of(text):
    for language, lines in _FENCE.findall(text):
        if not language:
            yield from (re.sub(r"\s+# .*", "", line).strip() for line in lines.splitlines())
    for span in re.findall(r"`([^`]+)`", _FENCE.sub("", text)):
        words = span.split()
        if len(words) > 1 and _FIRST.match(words[0]):
            yield " ".join(words)


def documented(root):
    """Each command with the page that names it first."""
    root, found = pathlib.Path(root), {}
    for page in [root / "README.md", *sorted((root / "docs").glob("*.md"))]:
        for command in _said_of(page.read_text()):
            if command:
                found.setdefault(command, str(page.relative_to(root)))
    return found
