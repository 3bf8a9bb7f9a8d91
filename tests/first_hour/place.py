"""A case's own home, with the built programs as a person there starts them, and how cases are run one by one."""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import traceback

_SKIPPED = 77
PATIENCE_S = 200  # far more than anything here takes, on a busy machine, too


class Skip(Exception):
    """What this machine lacks."""


class Place:
    """A case's own home, and the programs as a person there starts them."""

    def __init__(self, programs, root):
        self.programs, self.root = pathlib.Path(programs).resolve(), pathlib.Path(root).resolve()
        self.home = pathlib.Path(tempfile.mkdtemp(prefix="farfeel-first-hour-"))
        self.home.chmod(0o755)

    def environment(self, **more):
        kept = {k: v for k, v in os.environ.items() if not k.startswith(("FARFEEL_", "XDG_", "SUDO_"))}
        return {**kept, "HOME": str(self.home), **more}

    def run(self, *command, **variables):
        """The program's end: its status, and what it said on either stream."""
        own = self.programs / command[0]
        return subprocess.run([str(own) if own.exists() else command[0], *command[1:]], cwd=self.home, text=True, errors="replace",
                              env=self.environment(**variables), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, timeout=PATIENCE_S)

    def setting(self, name, text):
        file = self.home / ".config" / "farfeel" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.parent.chmod(0o755)
        file.write_text(text)
        file.chmod(0o644)
        return file


def expect(true, *what):
    if not true:
        raise AssertionError(" ".join(str(w) for w in what))


def run_cases(cases):
    """The named cases, each a function that takes a Place; for sys.exit()."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", required=True, help="folder of the programs")
    parser.add_argument("--root", required=True, help="folder of the sources")
    parser.add_argument("cases", nargs="+")
    arguments = parser.parse_args()
    failed = 0
    for name in arguments.cases:
        place = Place(arguments.programs, arguments.root)
        try:
            cases[name](place)
            print(f"passed: {name}")
        except Skip as why:
            print(f"skipped: {why}")
            return _SKIPPED
        except Exception:  # each case's failure is told, and the others run
            failed += 1
            traceback.print_exc()
            print(f"FAILED: {name}")
        finally:
            shutil.rmtree(place.home, ignore_errors=True)
    return 1 if failed else 0
