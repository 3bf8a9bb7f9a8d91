#!/usr/bin/env python3
"""A slave made from the page alone against the real farfeel-master.

It gives the session object that a real slave gave before, answers with contacts of a plane, and holds what the master
sends to the page: sizes, rates, numbers, the grid.
"""

import csv
import json
import math
import os
import sys
from dataclasses import replace

from support import expect, main

from second import datagrams as d
from second import haptic, objects
from second import numbers as n
from second import session_object
from second.bulk import OFFER, WITHDRAWAL
from second.bulk_ends import BulkAtMaster, BulkAtSlave
from second.master import Master
from second.plane import STIFFNESS_N_PER_M, Plane
from second.programs import key_bytes
from second.slave import Slave
from second.sodium import SUITES, public_key

_SCENE = "block-block"
_POSE_BYTES = (52, 64)  # on the grid, without and with the felt wrench
_MOST_POSES_HZ = 2000
_STOOD_STILL_S, _CAUGHT_UP_S = 0.003, 0.2  # a tick that came so late, and how long it takes to feel what is there again
_RAISED_M = 0.006  # without an outline the plane lies so far above the object that the scene shows, and is felt there


class _Ends:
    """The real master at the slave in Python, with the object that a real slave gave."""

    def __init__(self, run, seconds=4, suites=SUITES, under_load=False, psk=None, is_known=True, has_outline=False,
                 wrong=(), more=()):
        self.run = run
        secret, master_secret = run.two_keys(psk)
        psk_bytes = key_bytes(psk) if psk else None
        self.data = _object_of_a_real_slave(run, secret, master_secret, psk_bytes)
        if not has_outline:
            self.data = session_object.without_outline(self.data)
        self.object = session_object.read(self.data)
        scene = self.object.scene
        up = n.scaled(scene.approach, -1.0)
        middle = n.add(n.scaled(n.add(*scene.region), 0.5), n.scaled(up, 0.0 if has_outline else _RAISED_M))
        self.plane = Plane(middle, up, scene.working_point)
        operators = {public_key(master_secret): psk_bytes} if is_known else {}
        self.slave = Slave(secret, operators, self.object.grid, self.plane.respond, suites)
        self.slave.under_load = under_load
        self.told_identities = {"with": 0, "alike": 0, "without": 0}
        self.slave.after_answer = self._count_identities
        self.bulk = BulkAtSlave(self.slave, self.data, wrong)
        self.process = run.master(self.slave.port, "--seconds", str(seconds), "--rung", "linear", *more)

    def _count_identities(self, _, answer):
        for contact in answer.contacts:
            identity = contact.identity
            self.told_identities["alike" if isinstance(identity, haptic.Alike) else "with" if identity else "without"] += 1

    def masters_log(self):
        return self.run.programs.log("farfeel-master-1.log")

    def run_to_the_end(self, seconds=60):
        expect(self.slave.run(seconds, lambda: self.process.poll() is not None), "the master does not end")
        self.slave.run(0.05)

    def summary(self):
        with open(os.path.join(self.run.programs.path("out"), "summary.json")) as file:
            return json.load(file)

    def ticks(self):
        with open(os.path.join(self.run.programs.path("out"), "session.csv"), newline="") as file:
            return list(csv.DictReader(file))

    def calm_ticks(self):
        """Those before which the machine did not stand still."""
        calm, before_s, shaken_s = [], 0.0, -1.0
        for row in self.ticks():
            began_s = float(row["time_s"]) + 1e-6 * float(row["wake_us"])
            if began_s - before_s > _STOOD_STILL_S:
                shaken_s = began_s
            before_s = began_s
            if began_s - shaken_s > _CAUGHT_UP_S:
                calm.append(row)
        return calm


def _object_of_a_real_slave(run, secret, master_secret, psk):
    process, port = run.slave(_SCENE)
    master = Master(port, master_secret, public_key(secret), psk=psk or bytes(32))
    bulk = BulkAtMaster(master)
    master.begin()
    expect(master.until(bulk.session_object), "the real slave gives no object")
    master.say_bye()
    master.close()
    run.programs.end(process)
    return bulk.session_object()


def feels_the_plane(run):
    ends = _Ends(run, seconds=8)
    ends.run_to_the_end()
    slave, said = ends.slave, ends.summary()
    expect(not slave.refused, slave.refused[:3])
    expect(said["down"]["received"] > 0.9 * slave.answer_number, said["down"])
    expect(said["contact_share"] > 0.3 and said["contacts"]["max"] == 1, said["contact_share"], said["contacts"])
    expect(ends.plane.touches > 300, ends.plane.touches)
    # What the hand feels is the plane, at the tool's poses as the master logged them.
    off = sorted(_felt_off(row, ends.plane) for row in ends.calm_ticks() if row["state"] == "touching")
    expect(len(off) > 300, "ticks in contact", len(off))
    expect(off[len(off) // 2] < 1e-4 and off[len(off) * 9 // 10] < 0.1, "the plane is not felt", off[::len(off) // 10])
    expect(0.5 < said["force_N"]["max"] < 2 * ends.object.scene.press_N, said["force_N"])


def _felt_off(row, plane):
    """How far the contact force of a tick is from the plane's at the tool's pose there, of that or of 0.1 N."""
    p = tuple(float(row[f"tool_{axis}_m"]) for axis in "xyz")
    q = tuple(float(row[f"tool_q{axis}"]) for axis in "wxyz")
    pushes = n.scaled(plane.normal, STIFFNESS_N_PER_M * max(0.0, plane.depth_m(p, q)))
    felt = tuple(float(row[f"contact_force_{axis}_N"]) for axis in "xyz")
    return n.norm(n.sub(felt, pushes)) / max(0.1, n.norm(pushes))


def sends_what_the_page_says(run):
    ends = _Ends(run)
    slave, words = ends.slave, []
    ends.plane.renamed_every = 200  # whatever its name, it is the same surface

    def challenge(_):
        if not words and len(slave.poses) > 300:
            words.extend(slave.challenge(lane) for lane in range(2))

    slave.steps.append(challenge)
    ends.run_to_the_end()
    poses = slave.poses
    expect(len(poses) > 500, len(poses))
    expect(set(slave.pose_lengths) <= set(_POSE_BYTES), sorted(set(slave.pose_lengths)))
    ordered = sorted(poses, key=lambda pose: pose.number)  # none twice: that the slave refuses
    expect(ordered[0].number <= 3 and len(poses) > 0.5 * ordered[-1].number, "numbers do not go up by one")
    expect(all(b.scene_time_us > a.scene_time_us for a, b in zip(ordered, ordered[1:])), "scene time stands or goes back")
    span_s = (ordered[-1].scene_time_us - ordered[0].scene_time_us) * 1e-6
    expect(len(poses) / span_s <= 1.02 * _MOST_POSES_HZ, "poses a second", len(poses) / span_s)
    expect(not any(p.in_full for p in poses), "a position in full where it fits the grid")
    expect(len({p.p_WT for p in poses}) > 100, "the tool does not move")
    expect(all(a.heard is None for a in ordered[:1]) and ordered[-1].heard is not None)
    expect(all(p.heard is None or 0 < p.heard <= slave.answer_number for p in poses), "heard what was not sent")
    expect(slave.round_trips_us and max(slave.round_trips_us) < 10**7, "a round trip of", max(slave.round_trips_us))
    expect(slave.keep_alives > 20 * span_s, "keep-alives", slave.keep_alives)
    expect(slave.byes == [1, 1, 1], slave.byes)
    expect([a[-1:] for a in slave.challenge_answers] == [[w] for w in words], "challenges were not answered")
    expect(max(slave.lengths[d.BULK] + slave.lengths[d.HAPTIC]) <= d.MOST_BYTES)
    expect(not slave.refused, slave.refused[:3])
    told = ends.told_identities
    expect(told["with"] > 0 and told["alike"] > 3 and told["without"] > 0.7 * sum(told.values()), told)
    expect(ordered[-1].heard > slave.answer_number - 500, "the master reads no answers any more")


def takes_objects_as_the_page_says(run):
    """One whose hash is wrong, then the right one; an offer that is too large, an old one, padding, a withdrawal."""
    ends = _Ends(run, seconds=3, wrong=[(os.urandom(5000), bytes(32))])
    slave, bulk, at = ends.slave, ends.bulk, {}

    def ask(_):
        if bulk.is_given() and not at:
            at["answers"], at["receipts"] = len(bulk.object_answers), bulk.receipts
            bulk.say(OFFER, objects.Offer(1, 0, 77, 5000, bytes(32)).write())
            bulk.say(OFFER, objects.Offer(3, 5, 78, 1 << 40, bytes(32)).write())
            bulk.say(WITHDRAWAL, (9).to_bytes(4, "little"))
            bulk.pad(1000)

    slave.steps.append(ask)
    ends.run_to_the_end()
    expect(at, "the object was not taken")
    first = [(a.state, a.reason) for a in bulk.object_answers if a.id == 1 and a.ask != 77]
    expect([a.round for a in bulk.object_answers if a.id == 1 and a.state == objects.RECEIVING][-1] == 2, first)
    expect((objects.REFUSED, objects.CORRUPT) in first, first)
    later = {a.id: (a.state, a.reason) for a in bulk.object_answers[at["answers"]:]}
    expect(later.get(1) == (objects.GONE, 0), "an old offer is answered with", later)
    expect(later.get(3) in ((objects.REFUSED, objects.TOO_LARGE), (objects.REFUSED, objects.TOO_MANY)),
           "one of a tebibyte is answered with", later)
    expect(any(a.id == 9 and a.state == objects.GONE for a in bulk.object_answers), "a withdrawal is not answered")
    expect(bulk.receipts > at["receipts"] and bulk.numbered.believes, "padding has no receipt")
    expect(bulk.tile_requests == [] or min(bulk.tile_requests) >= 1)
    expect(len(slave.poses) > 200 and not slave.refused, len(slave.poses), slave.refused[:3])


def takes_the_other_suite(run):
    ends = _Ends(run, seconds=2, suites=SUITES[-1:], has_outline=True)
    ends.run_to_the_end()
    expect(len(ends.slave.poses) > 200 and not ends.slave.refused, len(ends.slave.poses), ends.slave.refused[:3])
    if len(SUITES) > 1:
        expect(d.OTHER_SUITE in ends.slave.denied, "the master did not begin with AES", ends.slave.denied)


def comes_back_with_a_cookie(run):
    psk = run.programs.key("", "psk").split()[-1]
    ends = _Ends(run, seconds=2, under_load=True, psk=psk)
    ends.run_to_the_end()
    slave = ends.slave
    expect(slave.cookies_sent >= 1 and slave.cookies_come_back >= 2, slave.cookies_sent, slave.cookies_come_back)
    expect(len(slave.poses) > 200 and not slave.refused, len(slave.poses), slave.refused[:3])


def is_told_that_it_is_not_known(run):
    ends = _Ends(run, seconds=2, is_known=False)
    ends.run_to_the_end()
    expect(ends.process.returncode != 0, "the master ends well without a session")
    expect("does not know this operator" in ends.masters_log(), ends.masters_log())


def wrong_answers_change_nothing(run):
    """Beside each answer comes one that the page refuses, with a contact that would throw the hand away."""
    ends = _Ends(run)
    slave, grid = ends.slave, ends.object.grid
    sent = [0] * len(_WRONGS)

    def wrong(pose, answer):
        kind = answer.number % len(_WRONGS)
        message = _WRONGS[kind](_violent(pose, answer), grid)
        sent[kind] += 1
        slave.send(d.HAPTIC, haptic.ANSWER, message)

    slave.after_answer = wrong
    ends.run_to_the_end()
    said = ends.summary()
    expect(min(sent) > 10, sent)
    expect(said["faults"] == 0 and said["contacts"]["max"] == 1, said["faults"], said["contacts"])
    expect(said["contact_share"] > 0.2, said["contact_share"])
    expect(said["force_N"]["max"] < 2 * ends.object.scene.press_N, said["force_N"])


_VIOLENT = haptic.Identity(99, 0, 1e6, 0.0, 0.0, 0.0)


def _violent(pose, answer):
    """An answer like that one, the next in number, with a contact half a metre deep at a place that is empty."""
    contacts = [haptic.Contact(k, 0, (0.0,) * 3, 0.5, (1.0, 0.0, 0.0), (0.0,) * 3, (0.0,) * 3, 0.01, identity=_VIOLENT)
                for k in (20, 21)]
    return haptic.Answer(answer.number + 1, pose.number, answer.times, (0.0, 0.0, 0.0, 1e3, 0.0, 0.0), contacts)


def _of_old_number(answer, grid):
    return replace(answer, number=answer.number - 1).write(grid)


def _about_no_pose(answer, grid):
    return replace(answer, pose_number=answer.pose_number + 100000).write(grid)


def _at_an_empty_place(answer, grid):
    for contact in answer.contacts:
        contact.identity = None
    return answer.write(grid)


def _like_an_empty_place(answer, grid):
    answer.contacts[1].identity = haptic.Alike(99, 40)
    return answer.write(grid)


def _at_one_place_twice(answer, grid):
    answer.contacts[1].place = answer.contacts[0].place
    return answer.write(grid)


def _with_an_unnamed_flag(answer, grid):
    message = answer.write(grid)
    return bytes([message[0] | 0x40]) + message[1:]


def _with_doubt_0(answer, grid):
    answer.contacts[0].doubts = 1
    return answer.write(grid)


def _too_long(answer, grid):
    return answer.write(grid) + b"\0"


def _too_short(answer, grid):
    return answer.write(grid)[:-1]


def _not_finite(answer, grid):
    answer.contacts[0].depth_m = math.nan
    return answer.write(grid)


def _too_stiff(answer, grid):
    answer.contacts[0].identity = replace(_VIOLENT, stiffness=1e9)
    return answer.write(grid)


_WRONGS = (_of_old_number, _about_no_pose, _at_an_empty_place, _like_an_empty_place, _at_one_place_twice,
           _with_an_unnamed_flag, _with_doubt_0, _too_long, _too_short, _not_finite, _too_stiff)


if __name__ == "__main__":
    sys.exit(main([feels_the_plane, sends_what_the_page_says, takes_objects_as_the_page_says,
                   takes_the_other_suite, comes_back_with_a_cookie, is_told_that_it_is_not_known,
                   wrong_answers_change_nothing]))
