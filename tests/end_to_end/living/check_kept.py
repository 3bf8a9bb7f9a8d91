#!/usr/bin/env python3
"""What a slave said was durable is there after kill -9; what a full disk did not take is told, and the scene goes on."""

import argparse
import json
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile


def _expect(true, *what):
    if not true:
        raise AssertionError(" ".join(str(w) for w in what))


class _Slave:
    def __init__(self, programs, state, most_bytes=None):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # then a write fails, as on a full disk
            resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))

        self.programs, self.lines = programs, []
        self.process = subprocess.Popen([f"{programs}/farfeel-slave", "--scene", "living", "--editable", "--state", state,
                                         "--listen", "127.0.0.1:0"], text=True, stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, preexec_fn=limit if most_bytes else None)
        found = None
        while not found:
            line = self.process.stdout.readline()
            _expect(line, "the slave ended:", *self.lines)
            self.lines.append(line)
            found = re.search(r"serving .* on (127\.0\.0\.1:\d+)", line)
        self.at = ["--connect", found.group(1)]

    def edit(self, *words):
        return subprocess.run([f"{self.programs}/farfeel", "scene", "edit", *words, *self.at, "--timeout", "4"],
                              capture_output=True, text=True, timeout=60, check=False)

    def seen(self):
        """The newest of each object, and the scene's version, as who comes late is told."""
        told = subprocess.run([f"{self.programs}/farfeel", "scene", "watch", "--json", "--seconds", "1.5", *self.at],
                              capture_output=True, text=True, timeout=60, check=True).stdout
        rows = [json.loads(line) for line in told.splitlines()]
        return ({row["object"]: (row["present"], row["p_WO_m"]) for row in rows if "object" in row},
                max([row["version"] for row in rows if "version" in row], default=0))

    def end(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.lines += self.process.communicate(timeout=20)[0].splitlines(True)
        return "".join(self.lines)


_STAMP = ["stamp", "block", "--at", "0", "0", "0.02", "--radius", "0.012", "--depth", "0.0003"]


def check(programs):
    with tempfile.TemporaryDirectory() as folder:
        state = f"{folder}/state"
        slave = _Slave(programs, state)
        for words in (_STAMP, ["spawn", "visitor", "--at", "0.1", "0", "0.002"],
                      ["move", "visitor", "--at", "0.2", "0", "0.002", "--takes", "0.1"]):
            done = slave.edit(*words, "--durable")
            _expect(done.returncode == 0 and "durable" in done.stdout, done.stdout, done.stderr)
        before = slave.seen()
        second = subprocess.run([f"{programs}/farfeel-slave", "--scene", "living", "--state", state, "--listen", "127.0.0.1:0"],
                                capture_output=True, text=True, timeout=60, check=False)
        _expect(second.returncode == 1 and "another slave has it" in second.stderr + second.stdout, second.stderr)
        slave.end(signal.SIGKILL)

        slave = _Slave(programs, state)
        _expect(slave.seen() == before, "not as it was left:", slave.seen(), before)
        _expect(before[1] == 3 and before[0]["visitor"][0], before)
        refused = slave.edit("spawn", "visitor")
        _expect(refused.returncode == 1 and "is there already" in refused.stderr, refused.stderr)
        _expect("in version 3" in slave.end(), slave.lines)

        size = os.path.getsize(f"{state}/edits")
        slave = _Slave(programs, state, most_bytes=size + 100)
        full = slave.edit("revert", "visitor", "--durable")
        _expect(full.returncode == 1 and "not on the slave's disk" in full.stderr, full.stdout, full.stderr)
        _expect(slave.edit("spawn", "visitor").returncode == 0, "the scene does not go on")
        _expect("are not kept any more" in slave.end(), slave.lines)

        slave = _Slave(programs, state)
        _expect(slave.seen() == before, "what was not durable is there, or what was is not:", slave.seen(), before)
        slave.end()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", required=True)
    sys.exit(check(parser.parse_args().programs))
