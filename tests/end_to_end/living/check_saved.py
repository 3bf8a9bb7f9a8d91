#!/usr/bin/env python3
"""A scene that was edited, saved from the node that runs, and served by a second node from the folder: a scripted probe
feels the same at both, to a thousandth. The probe is the hand of a master made from the wire's page alone."""

import os
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "protocol"))

from feeling import Feeling  # noqa: E402
from support import expect, main  # noqa: E402

from second import numbers as n  # noqa: E402

_SCENE = """
editable = true
stamp_room_m = 0.002
[tool]
model = "probe"
[tool.material]
stiffness_N_per_m = 3000
[[object]]
name = "block"
model = "block"
rotation_vector_deg = [0.0, 0.0, 20.0]
[object.material]
static_friction = 0.3
[[object]]
name = "visitor"
model = "block"
present = false
[[timeline]]
at_s = 0
edit = "stamp"
object = "block"
place_m = [-0.02, 0.0, 0.02]
radius_m = 0.01
depth_m = 0.0006
[[timeline]]
at_s = 3600
edit = "remove"
object = "block"
[exploration]
tool_point_m = [0.0, 0.0, -0.003]
tool_normal = [0.0, 0.0, -1.0]
region_low_m = [0.0, 0.0, 0.020]
region_high_m = [0.0, 0.0, 0.020]
approach = [0.0, 0.0, -1.0]
"""
_EDITS = [
    ["stamp", "block", "--at", "0", "0", "0.02", "--radius", "0.012", "--depth", "0.0008"],
    ["stamp", "block", "--at", "0.003", "0", "0.02", "--radius", "0.006", "--depth", "0.0005"],
    ["spawn", "visitor", "--at", "0.12", "0", "0.001"],
    ["move", "visitor", "--at", "0.1", "0.01", "0.0015", "--turned", "0", "3", "40", "--takes", "0.2"],
]
# Where the probe comes down, and how far above the block's middle its lowest point then is [mm]: amid the dent, on its rim,
# in the second, in the timeline's, beside all of them, on the visitor.
_PLACES = [(0.0, 0.0, -1.4), (-3.9, 0.5, -1.0), (3.5, 1.0, -2.0), (-18.8, -6.8, -1.3), (14.0, 12.0, -0.5), (100.0, 10.0, 1.0)]
_MOST_OFF, _LEAST_N = 1e-3, 0.2


def _forces(feeling):
    forces = []
    for x_mm, y_mm, height_mm in _PLACES:
        at = n.add(feeling.at_height(1e-3 * height_mm), (1e-3 * x_mm, 1e-3 * y_mm, 0.0))
        forces.append(feeling.force_at(at))
    return forces


def _told(forces):
    return ", ".join(f"({x:.3f}, {y:.3f}, {z:.3f}) N" for x, y, z in forces)


def saved(run):
    scene, folder = run.programs.path("edited.toml"), run.programs.path("saved")
    with open(scene, "w", encoding="utf-8") as file:
        file.write(_SCENE)
    keys = run.two_keys(role="operate,edit")
    first = Feeling(run, scene, keys)
    to = ["--connect", f"127.0.0.1:{first.port}", "--keys", run.programs.path("master")]

    def scene_command(*words):
        return subprocess.run([os.path.join(run.programs.binaries, "farfeel"), "scene", *words], capture_output=True, text=True,
                              timeout=120, check=False)

    first.still(first.at_height(0.01))  # scene time begins, and with it the timeline
    first.master.run(1)
    untouched = first.force_at(n.add(first.at_height(-0.0014), (0.0, 0.0, 0.0)))
    for words in _EDITS:
        done = scene_command("edit", *words, *to)
        expect(done.returncode == 0, words, done.stdout, done.stderr)
    first.master.run(1)  # the visitor is there
    felt = _forces(first)
    expect(all(n.norm(force) > _LEAST_N for force in felt), "the probe hardly touches:", _told(felt))
    expect(n.norm(untouched) > 1.5 * n.norm(felt[0]), "the stamp is not felt:", untouched, felt[0])

    done = scene_command("save", "-o", folder, *to)
    expect(done.returncode == 0 and "2 objects and the tool" in done.stdout, done.stdout, done.stderr)
    expect(sorted(os.listdir(folder)) == ["block.glb", "scene.toml", "tool.glb", "visitor.glb"], os.listdir(folder))
    again = scene_command("save", "-o", folder, *to)
    expect(again.returncode == 1 and "there is something in" in again.stderr, again.stdout, again.stderr)
    expect(not [name for name in os.listdir(run.programs.folder) if name.endswith(".part")], os.listdir(run.programs.folder))
    checked = scene_command("check", os.path.join(folder, "scene.toml"))
    expect(checked.returncode == 0, checked.stdout, checked.stderr)
    first.end()

    second = Feeling(run, os.path.join(folder, "scene.toml"), keys)
    there = _forces(second)
    second.end()
    off = [n.norm(n.sub(a, b)) / n.norm(a) for a, b in zip(felt, there)]
    print("felt", _told(felt), "and off by", ", ".join(f"{share:.1e}" for share in off))
    expect(max(off) <= _MOST_OFF, "the saved scene feels otherwise:", _told(there))


if __name__ == "__main__":
    sys.exit(main([saved]))
