"""What the checks share: their begin and end, and how they say what went wrong.

A check is a function that takes a Run. A script of checks runs those that its command line names, or all, and skips, with
status 77, where this machine lacks libsodium.
"""

import argparse
import shutil
import sys
import tempfile
import traceback

_SKIPPED = 77

try:
    from second import sodium
    from second.programs import Programs
except Exception as error:  # libsodium is missing
    print(f"skipped: {error}")
    sys.exit(_SKIPPED)


class Run:
    """One check's folder, programs and keys."""

    def __init__(self, binaries, folder):
        self.programs = Programs(binaries, folder)

    def two_keys(self, psk=None, role=None):
        """Keys for both ends, which trust each other: the secrets of the slave and of the master, who may do what the role
        says."""
        p = self.programs
        slave, slave_word = p.new_key("slave")
        master, master_word = p.new_key("master")
        more = ["--psk", psk] if psk else []
        p.key("slave", "trust", "operator", "anna", master_word, *more, *(["--role", role] if role else []))
        p.key("master", "trust", "slave", "lab", slave_word, *more)
        return slave, master

    def slave(self, scene, *more):
        """The real slave with that scene, or asset: its process and its port."""
        touched = "--object" if scene.endswith(".glb") else "--scene"
        return self.programs.start("farfeel-slave", touched, scene, "--listen", "127.0.0.1:0", "--keys",
                                   self.programs.path("slave"), *more, ready=True)

    def master(self, port, *more):
        return self.programs.start("farfeel-master", "--connect", f"127.0.0.1:{port}", "--keys",
                                   self.programs.path("master"), "--device", "simulated", "--out", self.programs.path("out"), "--progress", "none",
                                   *more)[0]


def expect(true, *what):
    if not true:
        raise AssertionError(" ".join(str(w) for w in what))


def expect_raises(kind, action, *arguments):
    try:
        action(*arguments)
    except kind as error:
        return error
    raise AssertionError(f"no {kind.__name__} was raised")


def main(checks):
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", default="", help="folder of the real programs")
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    by_name = {check.__name__: check for check in checks}
    failed = 0
    for name in arguments.names or by_name:
        folder = tempfile.mkdtemp(prefix=f"farfeel-protocol-{name}-")
        run = Run(arguments.programs, folder)
        try:
            by_name[name](run)
            print(f"passed: {name}")
            run.programs.end_all()
            shutil.rmtree(folder)
        except Exception:  # each check's failure is told, and the others run
            failed += 1
            traceback.print_exc()
            print(f"FAILED: {name}; logs in {folder}")
        finally:
            run.programs.end_all()
    return 1 if failed else 0


__all__ = ["Run", "expect", "expect_raises", "main", "sodium"]
