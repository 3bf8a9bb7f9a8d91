#!/usr/bin/env python3
"""A session on a scene whose timeline stamps, spawns, moves and removes under a probe that is held on one place: the tool
goes down and up by as much as the scene says, at both ends of a good and of a bad link, felt from tiles and linearised."""

import argparse
import csv
import json
import statistics
import subprocess
import sys
import tempfile

_SCENE = """
[tool]
model = "probe"
[[object]]
name = "block"
model = "block"
[[object]]
name = "visitor"
model = "block"
present = false
[[timeline]]
at_s = 3
edit = "stamp"
object = "block"
place_m = [0.0, 0.0, 0.020]
radius_m = 0.02
depth_m = 0.001
[[timeline]]
at_s = 5
edit = "spawn"
object = "visitor"
position_m = [0.0, 0.0, 0.0005]
[[timeline]]
at_s = 7
edit = "move"
object = "visitor"
position_m = [0.0, 0.0, 0.0015]
takes_s = 0.5
[[timeline]]
at_s = 9
edit = "remove"
object = "visitor"
[exploration]
tool_point_m = [0.0, 0.0, -0.003]
tool_normal = [0.0, 0.0, -1.0]
region_low_m = [-0.0005, -0.0005, 0.020]
region_high_m = [0.0005, 0.0005, 0.020]
approach = [0.0, 0.0, -1.0]
press_force_N = 2.0
stroke_speed_m_per_s = 0.005
"""
# When the tool is at rest again after each edit [s], and how far it is then above where it was before all [mm].
_RESTS = [((2.0, 2.9), 0.0), ((4.0, 4.9), -1.0), ((6.0, 6.9), 0.5), ((8.2, 8.9), 1.5), ((10.2, 10.9), -1.0)]
_MOST_OFF_MM = 0.3  # ridges of 1 mm wavelength under a probe that wanders by 0.5 mm
_SESSIONS = {
    "clean": [],
    "bad_link": ["--link", "rtt=60ms jitter=5ms loss=3%"],
    "linear": ["--rung", "linear", "--link", "rtt=20ms"],
}


def _run(programs, folder, more):
    scene = f"{folder}/changes.toml"
    with open(scene, "w", encoding="utf-8") as file:
        file.write(_SCENE)
    ran = subprocess.run([f"{programs}/farfeel", "loopback", "--scene", scene, "--seconds", "11", "--no-view", "--out",
                          f"{folder}/run", *more], capture_output=True, text=True, timeout=100, check=False)
    if ran.returncode != 0:
        raise AssertionError(ran.stdout[-2000:] + ran.stderr[-2000:])
    with open(f"{folder}/run/session.csv", encoding="utf-8") as file:
        rows = [{key: row[key] for key in ("time_s", "tool_z_m", "state")} for row in csv.DictReader(file)]
    with open(f"{folder}/run/summary.json", encoding="utf-8") as file:
        return rows, json.load(file)


def check(programs, name):
    with tempfile.TemporaryDirectory() as folder:
        rows, summary = _run(programs, folder, _SESSIONS[name])
    heights = []
    for (begin, end), _ in _RESTS:
        touching = [1e3 * float(row["tool_z_m"]) for row in rows
                    if begin <= float(row["time_s"]) <= end and row["state"] == "touching"]
        if len(touching) < 100:
            raise AssertionError(f"the probe hardly touches from {begin} to {end} s: {len(touching)} ticks")
        heights.append(statistics.median(touching))
    told = ", ".join(f"{height - heights[0]:+.2f} mm (wanted {wanted:+.1f})" for height, (_, wanted) in zip(heights, _RESTS))
    print(told)
    for height, (_, wanted) in zip(heights, _RESTS):
        if abs(height - heights[0] - wanted) > _MOST_OFF_MM:
            raise AssertionError(f"the tool is not where the scene has it: {told}")
    if summary.get("faults", 0) != 0:
        raise AssertionError(f"{summary['faults']} faults")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", required=True)
    parser.add_argument("check", choices=sorted(_SESSIONS))
    arguments = parser.parse_args()
    sys.exit(check(arguments.programs, arguments.check))
