#!/usr/bin/env python3
"""Edits that are asked for while a session runs: 'farfeel scene edit' against a slave whose block is felt, and 'farfeel
scene watch', which came late, on another link than the hand."""

import argparse
import csv
import json
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time

_SCENE = """
editable = true
stamp_room_m = 0.002
[tool]
model = "probe"
[[object]]
name = "block"
model = "block"
[[object]]
name = "visitor"
model = "block"
present = false
[exploration]
tool_point_m = [0.0, 0.0, -0.003]
tool_normal = [0.0, 0.0, -1.0]
region_low_m = [-0.0005, -0.0005, 0.020]
region_high_m = [0.0005, 0.0005, 0.020]
approach = [0.0, 0.0, -1.0]
press_force_N = 2.0
stroke_speed_m_per_s = 0.005
"""
# What is asked, and how far the tool then is above where it was before all [mm].
_EDITS = [
    (["stamp", "block", "--at", "0", "0", "0.02", "--radius", "0.02", "--depth", "0.001"], -1.0),
    (["spawn", "visitor", "--at", "0", "0", "0.0005"], 0.5),
    (["move", "visitor", "--at", "0", "0", "0.0015", "--takes", "0.3"], 1.5),
    (["remove", "visitor"], -1.0),
    (["revert", "block"], 0.0),
]
_FIRST_S, _EVERY_S = 3.0, 2.5  # after the loop began, and between two
_REST_S, _BEFORE_NEXT_S = 1.4, 0.1  # after an answer the tool is at rest; until the next is asked for
_MOST_OFF_MM = 0.3  # ridges of 1 mm wavelength under a probe that wanders by 0.5 mm


def _start(arguments):
    return subprocess.Popen(arguments, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def _expect(true, *what):
    if not true:
        raise AssertionError(" ".join(str(w) for w in what))


def check(programs):
    with tempfile.TemporaryDirectory() as folder:
        scene = f"{folder}/edited.toml"
        with open(scene, "w", encoding="utf-8") as file:
            file.write(_SCENE)
        slave = _start([f"{programs}/farfeel-slave", "--scene", scene, "--listen", "127.0.0.1:0"])
        lines, port = [], None
        while port is None:
            line = slave.stdout.readline()
            _expect(line, "the slave ended:", *lines)
            lines.append(line)
            found = re.search(r"serving .* on 127\.0\.0\.1:(\d+)", line)
            port = found and found.group(1)
        to = ["--connect", f"127.0.0.1:{port}"]
        said = open(f"{folder}/master.log", "w+", encoding="utf-8")
        master = subprocess.Popen([f"{programs}/farfeel-master", *to, "--device", "simulated", "--seconds", "17.5", "--out",
                                   f"{folder}/run", "--progress", "none"], stdout=said, stderr=said)
        while "received: " not in open(said.name, encoding="utf-8").read():
            _expect(master.poll() is None, "the master ended:", open(said.name, encoding="utf-8").read())
            time.sleep(0.05)
        began = time.monotonic()
        edit = [f"{programs}/farfeel", "scene", "edit"]
        refused = subprocess.run([*edit, "stamp", "blok", "--at", "0", "0", "0", *to], capture_output=True, text=True,
                                 timeout=30, check=False)
        _expect(refused.returncode == 1 and "did you mean block?" in refused.stderr, refused.stderr)
        late, asked_s, answered_s = None, [], []
        for i, (words, _) in enumerate(_EDITS):
            time.sleep(max(0.0, began + _FIRST_S + i * _EVERY_S - time.monotonic()))
            asked_s.append(time.monotonic())
            done = subprocess.run([*edit, words[0], *words[1:], *to], capture_output=True, text=True, timeout=30,
                                  check=False)
            answered_s.append(time.monotonic())
            _expect(done.returncode == 0, done.stdout, done.stderr)
            if i == 1:
                late = _start([f"{programs}/farfeel", "scene", "watch", "--json", *to])
        master.wait(timeout=60)
        _expect(master.returncode == 0, open(said.name, encoding="utf-8").read()[-2000:])
        asked_s.append(began + _FIRST_S + len(_EDITS) * _EVERY_S)
        late.send_signal(signal.SIGINT)
        watched = [json.loads(line) for line in late.communicate(timeout=20)[0].splitlines()]
        slave.terminate()
        slave.communicate(timeout=20)
        with open(f"{folder}/run/session.csv", encoding="utf-8") as file:
            rows = [(float(row["time_s"]), 1e3 * float(row["tool_z_m"]), row["state"]) for row in csv.DictReader(file)]
    # The loop's clock begins when it does: the stamp's fall tells when, since nothing else falls as far at once.
    touching = [(t, z) for t, z, state in rows if state == "touching"]
    _expect(len(touching) > 5000, "the probe hardly touches:", len(touching), "ticks")
    before = statistics.median(z for t, z in touching if t < 1.5)
    fell_s = next((t for t, z in touching if t > 1.0 and z < before - 0.6), None)
    _expect(fell_s, "the stamp is not felt")
    heights = []
    for i, (_, wanted) in enumerate(_EDITS):
        begin, end = (fell_s + t - answered_s[0] for t in (answered_s[i] + _REST_S, asked_s[i + 1] - _BEFORE_NEXT_S))
        heights.append((statistics.median(z for t, z in touching if begin < t < end) - before, wanted))
    told = ", ".join(f"{height:+.2f} mm (wanted {wanted:+.1f})" for height, wanted in heights)
    print(told)
    _expect(all(abs(height - wanted) < _MOST_OFF_MM for height, wanted in heights), "the tool is not there:", told)
    # Who came after the spawn knows of it, and of all that came later, to the last version.
    visitor = [row for row in watched if row.get("object") == "visitor"]
    _expect(any(row["present"] for row in visitor) and not visitor[-1]["present"], visitor)
    _expect(max(row.get("version", 0) for row in watched) == len(_EDITS), watched)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", required=True)
    sys.exit(check(parser.parse_args().programs))
