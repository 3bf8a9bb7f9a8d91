#!/usr/bin/env python3
"""The second implementation against itself, without the programs: numbers, messages, windows, the tables, hostile bytes."""

import random
import struct
import sys

from support import expect, expect_raises, main

from second import bulk, haptic, objects, tiles
from second import numbers as n
from second.keys import Keys, Window
from second.sodium import SUITES, Refused

_TIMES = (1, 2, 3)
_GRID = n.Grid((0.1, -0.2, 0.3), -24)


def _random_unit(source, dimensions):
    return n.unit(tuple(source.gauss(0, 1) for _ in range(dimensions)))


def directions(_):
    source = random.Random(1)
    axes = [(1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (-1, 0, 0), (0, 1, 0), (0.6, 0, -0.8), (-0.0, 0.6, -0.8)]
    for v in axes + [_random_unit(source, 3) for _ in range(2000)]:
        back = n.read_direction(n.Reader(n.write_direction(v)))
        expect(n.norm(n.sub(back, v)) < 1e-6, v, back)


def rotations(_):
    source = random.Random(2)
    fixed = [(1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, -1.0), (0.5, 0.5, 0.5, 0.5), (-0.5, 0.5, -0.5, 0.5)]
    for q in fixed + [_random_unit(source, 4) for _ in range(2000)]:
        back = n.read_rotation(n.Reader(n.write_rotation(q)))
        expect(abs(abs(n.dot(back, q)) - 1) < 1e-10, q, back)
        expect(n.norm(n.sub(back, q)) < 4e-6 or n.norm(n.add(back, q)) < 4e-6, q, back)
    expect_raises(Refused, n.read_rotation, n.Reader(struct.pack("<Q", 1 << 63 | 0x8000080000080000 >> 12)))


def windows(_):
    window = Window()
    for counter in (0, 5, 3, 2048 + 5):
        window.take(counter)
    for counter in (3, 5, 2048 + 5):
        expect_raises(Refused, window.take, counter)
    window.take(6)
    source, came, other, newest = random.Random(3), set(), Window(), 0
    for _ in range(20000):  # against a set that remembers everything
        counter = max(0, newest + source.randrange(-3000, 60))
        fresh = counter not in came and newest - counter < 2048
        try:
            other.take(counter)
            expect(fresh, counter)
        except Refused:
            expect(not fresh, counter)
        if fresh:
            came.add(counter)
            newest = max(newest, counter)


def sealed(_):
    for suite in SUITES:
        a = Keys(suite, bytes(32), bytes([1]) * 32, 5, 7)
        b = Keys(suite, bytes([1]) * 32, bytes(32), 7, 5)
        datagram = a.seal(16, b"pose")
        for i in range(len(datagram)):
            wrong = bytearray(datagram)
            wrong[i] ^= 1 << i % 8
            expect_raises(Refused, b.open, bytes(wrong))
        expect(b.open(datagram) == (16, b"pose"))
        expect_raises(Refused, b.open, datagram)


def poses(_):
    source = random.Random(4)
    for i in range(500):
        p = tuple(source.uniform(-0.4, 0.4) * (100 if i % 7 == 0 else 1) for _ in range(3))
        more = {"felt": (0.5,) * 6} if i % 2 else {}
        more.update({"ahead_us": 900} if i % 3 == 0 else {}, heard=77 if i % 5 else None)
        line = haptic.Line((1.0,) * 6, 2.0)
        more.update({"waves": line} if i % 11 == 0 else {"passivity": line} if i % 11 == 1 else {})
        pose = haptic.Pose(i + 1, 2**40, _TIMES, p, _random_unit(source, 4), (0.25,) * 6, **more)
        message = pose.write(_GRID)
        back = haptic.Pose.read(message, _GRID)
        expect(n.norm(n.sub(back.p_WT, p)) <= _GRID.step, back.p_WT, p)
        for name in ("number", "scene_time_us", "times", "twist", *more):
            expect(getattr(back, name) == getattr(pose, name), name)
        expect(message == haptic.Pose.read(message, _GRID).write(_GRID) or i % 7 == 0, "written anew it is another")
    expect(len(haptic.Pose(1, 0, _TIMES, (0, 0, 0), (1, 0, 0, 0), (0,) * 6, felt=(0,) * 6).write(_GRID)) + 61 == 125)


def _contact(source, place, curved):
    identity = haptic.Identity(place, 0, 1000.0, 0.5, 0.25, 0.125)
    told = source.choice((None, identity, haptic.Alike(9, 3)))
    return haptic.Contact(place, 2, tuple(source.uniform(-0.1, 0.1) for _ in range(3)), 0.001, _random_unit(source, 3),
                          (0.125,) * 3, (0.5,) * 3, 0.5, source.choice((1.0, 0.5)), told,
                          tuple(float(k) for k in range(21)) if curved else None)


def answers(_):
    source = random.Random(5)
    for i in range(300):
        contacts = [_contact(source, place, i % 3 == 0) for place in source.sample(range(64), source.randrange(33))]
        where = (None, ((0.1, 0.1, 0.1), (1.0, 0.0, 0.0, 0.0)))[i % 2]
        answer = haptic.Answer(i + 1, 9, _TIMES, (1.0,) * 6, contacts, 1, 2, where)
        message = answer.write(_GRID, told_in_full=i % 4 == 1)
        back = haptic.Answer.read(message, _GRID)
        expect(back.contacts == haptic.Answer.read(back.write(_GRID, i % 4 == 1), _GRID).contacts)
        for a, b in zip(contacts, back.contacts):
            expect(n.norm(n.sub(a.r, b.r)) <= _GRID.step and n.norm(n.sub(a.n, b.n)) < 1e-6)
            expect((a.place, a.share, a.identity, a.curvature) == (b.place, b.share, b.identity, b.curvature))
    plain = [haptic.Contact(k, 0, (0.0,) * 3, 0.0, (0.0, 0.0, 1.0), (0.0,) * 3, (0.0,) * 3, 0.0) for k in range(7)]
    expect(len(haptic.Answer(1, 1, _TIMES, (0.0,) * 6, plain).write(_GRID)) + 61 == 348)


def hostile(_):
    """Whatever the bytes, a reader returns a message or refuses."""
    source = random.Random(6)
    contacts = [_contact(source, place, True) for place in range(5)]
    tile = struct.pack("<IBBII", 1, tiles.RAW, 1, 2, 3) + bytes(tiles.HALF * tiles.SIDE * 2)
    receipt = bulk.Receipt(9, 1, 2, 3, [(0, 2), (1, 4)], [(1, 5)])
    seeds = {
        lambda m: haptic.Answer.read(m, _GRID): haptic.Answer(1, 9, _TIMES, (1.0,) * 6, contacts).write(_GRID),
        lambda m: haptic.Pose.read(m, _GRID): haptic.Pose(1, 1, _TIMES, (0, 0, 0), (1, 0, 0, 0), (0,) * 6).write(_GRID),
        bulk.Receipt.read: receipt.write(),
        objects.Offer.read: objects.Offer(1, 0, 1, 5, bytes(32)).write(),
        objects.ObjectAnswer.read: objects.ObjectAnswer(1, 1, 1, 0, 0, 0, [(0, 3), (5, 7)]).write(),
        tiles.read_part: tile,
    }
    for read, seed in seeds.items():
        read(seed)
        for cut in range(len(seed)):
            expect_raises(Refused, read, seed[:cut])
        expect_raises(Refused, read, seed + b"\0")
        for _ in range(3000):
            wrong = bytearray(seed)
            for _ in range(source.randrange(1, 4)):
                wrong[source.randrange(len(wrong))] = source.randrange(256)
            try:
                read(bytes(wrong))
            except Refused:
                pass


def identities(_):
    """The table through a link that loses and reorders both ways: what is read is what was meant, or is refused."""
    source = random.Random(7)
    read, told, up, down = haptic.AnswersRead(), haptic.IdentitiesTold(), [], []
    refused = left_out = alike = 0
    for number in range(1, 6000):
        read.sent_pose(number)
        up.append((number, read.heard(number)))
        if source.random() < 0.8:
            pose, heard = up.pop(source.randrange(max(0, len(up) - 3), len(up)))
            told.heard(heard)
            contacts = []
            for place in source.sample(range(6), 3):
                identity = haptic.Identity(number // 50 + place % 2, 0, float(number // 200), 0.0, 0.0, 0.0)
                contacts.append(haptic.Contact(place, 0, (0.0,) * 3, 0.0, (0.0, 0.0, 1.0), (0.0,) * 3, (0.0,) * 3, 0.0,
                                               identity=identity))
            meant = {c.place: c.identity for c in contacts}
            answer = haptic.Answer(number, pose, _TIMES, (0.0,) * 6, contacts)
            told.tell(answer, meant)
            left_out += sum(c.identity is None for c in contacts)
            alike += sum(isinstance(c.identity, haptic.Alike) for c in contacts)
            down.append((answer.write(_GRID), meant))
        if down and source.random() < 0.7:
            message, meant = down.pop(source.randrange(max(0, len(down) - 3), len(down)))
            try:
                for c in read.take(haptic.Answer.read(message, _GRID)).contacts:
                    expect(c.identity == meant[c.place], "an identity was read otherwise than it was meant")
            except Refused:
                refused += 1
    expect(left_out > 1000 and refused > 100 and alike > 100, left_out, refused, alike)


if __name__ == "__main__":
    sys.exit(main([directions, rotations, windows, sealed, poses, answers, hostile, identities]))
