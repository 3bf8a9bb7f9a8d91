#!/usr/bin/env python3
"""A master made from the page alone feels what the real farfeel-slave answers.

The outside measure is the geometry that the session object tells, and that contacts, their gradients and their wrench agree
with each other from one pose to the next.
"""

import struct
import sys

from feeling import Feeling
from support import expect, main

from second import datagrams as d
from second import haptic
from second import numbers as n

_SLACK_M = 0.003  # of what a texture and a tolerance may add to the coarse meshes
_STILL_N = 0.02


def _box(points):
    return [min(p[i] for p in points) for i in range(3)], [max(p[i] for p in points) for i in range(3)]


def _is_within(point, box, slack_m):
    return all(low - slack_m <= x <= high + slack_m for x, low, high in zip(point, *box))


def _check_contact(feeling, pose, contact, boxes):
    at = n.add(pose.p_WT, contact.r)
    slack_m = _SLACK_M + max(0.0, -contact.depth_m)  # the point lies between bodies that are apart
    expect(abs(n.norm(contact.n) - 1) < 1e-12)
    expect(_is_within(contact.r, boxes[0], slack_m), "a contact off the tool", contact.r)
    expect(any(_is_within(at, box, slack_m) for box in boxes[1:]), "a contact off the objects", at)
    expect(contact.identity.object < len(feeling.scene.objects), "a contact with no object")


def contacts_are_where_the_bodies_are(run):
    feeling = Feeling(run, "file-cad")
    boxes = [_box([v for v in b.vertices] if i == 0 else b.corners_W())
             for i, b in enumerate(feeling.object.outline.bodies)]
    feeling.lowered()
    answers = feeling.master.answers
    expect(len(answers) > 100, len(answers))
    touching = 0
    for answer in answers:
        pose = feeling.told[answer.pose_number]
        for contact in answer.contacts:
            _check_contact(feeling, pose, contact, boxes)
            touching += contact.depth_m > 0
    expect(touching > 20, "nothing was touched")
    expect(not answers[0].contacts, "touched from afar")
    feeling.end()


def depths_follow_their_gradients(run):
    """depth' - depth = g . dp + G . dtheta: what a contact says of small moves there and back, against the depths there."""
    feeling = Feeling(run, "block-block")
    feeling.lowered()
    # Half over the edge, so that a turn changes the depth at once.
    base = n.add(feeling.at_height(-0.001), (0.03, 0.02, 0.0))
    answer = feeling.still(base)
    moved_m, turned = 2e-5, 5e-4
    for k in range(3):
        ahead, back = (tuple(s * moved_m if i == k else 0.0 for i in range(3)) for s in (1, -1))
        _expect_linear(answer, feeling.still(n.add(base, ahead)), feeling.still(n.add(base, back)),
                       lambda c: n.dot(c.translation_gradient(), ahead), 0.1 * moved_m)
        ahead, back = (tuple(s * turned if i == k else 0.0 for i in range(3)) for s in (1, -1))
        turns = [n.unit((1.0, *n.scaled(turn, 0.5))) for turn in (ahead, back)]
        _expect_linear(answer, feeling.still(base, R_WT=turns[0]), feeling.still(base, R_WT=turns[1]),
                       lambda c: n.dot(c.rotation_gradient(), ahead), 0.1 * turned * n.norm(answer.contacts[0].r))
    feeling.end()


def _expect_linear(here, ahead, back, change, slack_m):
    def nearest(answer, contact):
        return min(answer.contacts, key=lambda c: n.norm(n.sub(c.r, contact.r)))

    expect(here.contacts and ahead.contacts and back.contacts, "no contact")
    deepest = max(here.contacts, key=lambda c: c.depth_m)
    was = 0.5 * (nearest(ahead, deepest).depth_m - nearest(back, deepest).depth_m)
    expect(abs(was - change(deepest)) < slack_m, "the depth changed by", was, "told was", change(deepest), slack_m)


def wrenches_are_of_the_contacts(run):
    """At a pose that stands still the wrench's part along the normal is stiffness times share times depth."""
    feeling = Feeling(run, "block-block")
    feeling.lowered()
    for depth_mm in (0.5, 1.0, 2.0):
        answer = feeling.still(feeling.at_height(-depth_mm * 1e-3))
        for _ in range(60):  # let contacts fade in
            answer = feeling.still(feeling.at_height(-depth_mm * 1e-3))
        pushes = [(c, c.identity.stiffness * c.share * max(0.0, c.depth_m)) for c in answer.contacts]
        force = answer.wrench[3:]
        expect(sum(k for _, k in pushes) > 0.5, "no force", depth_mm)
        mean = n.unit(tuple(sum(k * c.n[i] for c, k in pushes) for i in range(3)))
        total = sum(k * n.dot(c.n, mean) for c, k in pushes)
        expect(abs(n.dot(force, mean) - total) < _STILL_N + 0.01 * total, force, total)
        if len(pushes) == 1:
            torque = n.cross(pushes[0][0].r, force)
            expect(n.norm(n.sub(torque, answer.wrench[:3])) < 0.002 + 0.002 * n.norm(force), torque, answer.wrench)
    feeling.end()


def identities_are_left_out_once_known(run):
    feeling = Feeling(run, "block-block")
    master, raw = feeling.master, []
    plain = haptic.Answer.read

    def read(message, grid):
        answer = plain(message, grid)
        raw.append((len(message), [c.identity is not None for c in answer.contacts]))
        return answer

    haptic.Answer.read = staticmethod(read)
    try:
        feeling.lowered()
        feeling.still(feeling.at_height(-0.001))
        touching = [r for r in raw if r[1]]
        expect(any(all(told) for _, told in touching), "no identity was told")
        last_size, last_told = touching[-1]
        expect(not any(last_told), "an identity that is known is told again")
        expect(last_size + 61 <= 96 + 38 * len(last_told), last_size)  # 36 a contact, 2 more for a share
        del raw[:]
        master.read.heard = lambda _: None  # now nothing is known to be known
        feeling.still(feeling.at_height(-0.001))
        expect(all(raw[-1][1]), "without flag 0 identities are not told again")
    finally:
        haptic.Answer.read = plain
    feeling.end()


def contacts_ahead_have_curvature(run):
    feeling = Feeling(run, "block-block")
    feeling.lowered()
    base, ahead_us, speed = feeling.at_height(-0.001), 5000, 0.01
    answer = feeling.still(base, twist=(0.0, 0.0, 0.0, speed, 0.0, 0.0), ahead_us=ahead_us)
    expect(answer.X_WT is not None, "contacts ahead without the pose that they are at")
    moved = n.sub(answer.X_WT[0], feeling.told[answer.pose_number].p_WT)
    expect(n.norm(n.sub(moved, (speed * ahead_us * 1e-6, 0.0, 0.0))) < 2 * feeling.object.grid.step, moved)
    expect(answer.contacts and all(len(c.curvature) == 21 for c in answer.contacts))
    expect(feeling.still(base).contacts[0].curvature is None, "curvature that nobody asked for")
    feeling.end()


def far_poses_are_told_in_full(run):
    feeling = Feeling(run, "block-block")
    reach_m = n.MOST_I24 * feeling.object.grid.step
    above = feeling.at_height(0.1)
    far = n.add(above, (2 * reach_m, 0.0, 0.0))
    expect(feeling.pose(far).in_full and not feeling.pose(above).in_full)
    answer = feeling.still(far)
    expect(not answer.contacts and answer.wrench == (0.0,) * 6, answer)
    feeling.end()


def wrong_poses_change_nothing(run):
    """What the page refuses is counted as malformed, is not answered, and the session goes on."""
    feeling = Feeling(run, "block-block")
    master = feeling.master
    feeling.still(feeling.low)
    master.told_anew()
    good = haptic.Pose(master.pose_number + 1, 1, (0, 0, 65535), feeling.low, (1.0, 0.0, 0.0, 0.0), (0.0,) * 6,
                       felt=(0.0,) * 6).write(master.grid)

    def changed(at, data):
        return good[:at] + data + good[at + len(data):]

    wrong = [good[:-1], good + b"\0", b"", changed(0, b"\x44"), changed(0, b"\x84"), changed(0, b"\x34"),
             changed(1, bytes(4)), changed(23, b"\0\0\x80"), changed(32, bytes(8)), changed(39, b"\xff"),
             changed(40, struct.pack("<e", float("nan"))), changed(52, struct.pack("<e", float("inf")))]
    had, malformed = len(master.answers), master.status.malformed
    master.read.sent_pose(master.pose_number + 1)
    for message in wrong:
        master.send(d.HAPTIC, haptic.POSE, message)
    master.told_anew()
    expect(len(master.answers) == had, "a wrong pose was answered")
    expect(master.status.malformed - malformed == len(wrong), master.status.malformed - malformed, len(wrong))
    feeling.still(feeling.low)
    master.told_anew()
    expect(master.status.received >= master.pose_number - 5 and not master.status.lost, master.status)
    feeling.end()


def datagrams_are_counted_as_the_page_says(run):
    """Received, late, duplicate and lost of the status, of datagrams sent in another order, twice, or not at all."""
    feeling = Feeling(run, "block-block")
    master = feeling.master
    feeling.still(feeling.low)
    master.told_anew()
    before, sealed = master.status, []
    send_raw = master.send_raw
    master.send_raw = lambda lane, datagram: sealed.append(datagram) if lane == d.HAPTIC else send_raw(lane, datagram)
    for _ in range(5):
        master.pose(feeling.low)
    master.send_raw = send_raw
    first, second, third, _, fifth = sealed  # the fourth is lost
    for datagram in (first, third, second, second, fifth):
        send_raw(d.HAPTIC, datagram)
    master.told_anew()
    after = master.status
    told = tuple(getattr(after, name) - getattr(before, name) for name in ("received", "late", "duplicate", "lost"))
    expect(told == (4, 1, 1, 1), "received, late, duplicate, lost:", told)
    feeling.end()


if __name__ == "__main__":
    sys.exit(main([contacts_are_where_the_bodies_are, depths_follow_their_gradients, wrenches_are_of_the_contacts,
                   identities_are_left_out_once_known, contacts_ahead_have_curvature, far_poses_are_told_in_full,
                   wrong_poses_change_nothing, datagrams_are_counted_as_the_page_says]))
