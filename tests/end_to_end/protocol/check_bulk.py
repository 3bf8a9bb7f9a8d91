#!/usr/bin/env python3
"""The bulk lane of the real farfeel-slave, by a master made from the page alone: objects, receipts, tiles."""

import random
import sys
import time

from support import Run, expect, main

from second import bulk, control, objects, session_object, tiles
from second import datagrams as d
from second import numbers as n
from second.bulk_ends import SESSION_SLOT, BulkAtMaster
from second.master import Master
from second.sodium import public_key

_SCENE = "block-block"
_TILES_S = 6.0


class _Session:
    def __init__(self, run: Run, scene=_SCENE, loss=0.0):
        self.slave_secret, self.secret = run.two_keys()
        _, self.port = run.slave(scene)
        self.again(loss)

    def again(self, loss=0.0, delivered=None):
        self.master = Master(self.port, self.secret, public_key(self.slave_secret))
        self.bulk = BulkAtMaster(self.master)
        self.bulk.objects.delivered.update(delivered or {})
        if loss:
            _lose(self.master, loss)
        self.master.begin()

    def object(self):
        expect(self.master.until(self.bulk.session_object), "the session object did not come")
        return self.bulk.session_object()

    def end(self, refused=()):
        expect(set(self.master.refused) <= set(refused), self.master.refused[:3])
        self.master.say_bye()
        time.sleep(0.1)


def _lose(master, share):
    source, send, data = random.Random(1), master.send_raw, master._data
    master.send_raw = lambda lane, datagram: None if source.random() < share else send(lane, datagram)
    master._data = lambda lane, datagram: None if source.random() < share else data(lane, datagram)


def gives_its_object(run):
    session = _Session(run)
    blob = session.object()
    expect(session_object.read(blob).scene.name, "an object without a scene")
    session.end()
    # The same object again is complete at once: nothing of it is sent.
    session.again(delivered={SESSION_SLOT: blob})
    session.master.until(lambda: session.bulk.objects.answered)
    session.master.run(1.0)
    expect(session.bulk.pieces == 0, "pieces of an object that is here", session.bulk.pieces)
    expect(session.bulk.objects.answered == {objects.COMPLETE}, session.bulk.objects.answered)
    session.end()


def gives_its_object_through_loss(run):
    session = _Session(run, loss=0.15)
    session.object()
    session.end()


def _block(has_colours):
    """As a PLY file; its vertices red where x is least, else green."""
    lines = ["ply", "format ascii 1.0", "element vertex 8", *(f"property float {axis}" for axis in "xyz")]
    lines += [f"property uchar {name}" for name in ("red", "green", "blue") if has_colours]
    lines += ["element face 6", "property list uchar int vertex_indices", "end_header"]
    for i in range(8):
        x, y, z = i & 1, i >> 1 & 1, i >> 2
        colour = ((10, 200, 10) if x else (230, 10, 10)) if has_colours else ()
        lines.append(" ".join(map(str, (0.08 * x, 0.06 * y, 0.04 * z) + colour)))
    return "\n".join(lines + ["4 0 2 3 1", "4 4 5 7 6", "4 0 1 5 4", "4 2 6 7 3", "4 0 4 6 2", "4 1 3 7 5", ""])


def gives_colours(run):
    """A scan's colours make its scene one of version 5 and its mesh longer by an attribute; nothing else is another."""
    session = _Session(run, run.programs.baked("plain", _block(False)))
    plain = session_object.read(session.object())
    session.end()
    _, session.port = run.slave(run.programs.baked("coloured", _block(True)))
    session.again()
    coloured = session_object.read(session.object())
    session.end()
    expect((plain.scene.version, coloured.scene.version) == (4, 5), plain.scene.version, coloured.scene.version)
    mesh = coloured.scene.objects[0].mesh
    expect(mesh[:7] == b"DRACO\2\2", "no Draco bitstream of 2.2", mesh[:7])
    expect(len(mesh) > len(plain.scene.objects[0].mesh), "no byte is a colour's")
    expect(coloured.scene.tool_mesh == plain.scene.tool_mesh and coloured.outline == plain.outline, "another is felt")


def asks_again_where_there_is_no_room(run):
    session, offers = _Session(run), []
    incoming, take = session.bulk.objects, session.bulk.objects.on_offer

    def without_room(message):
        offers.append(objects.Offer.read(message))
        if len(offers) == 1:
            incoming.refuse(offers[-1], objects.NO_ROOM)
        else:
            take(message)

    session.master.on_bulk[bulk.OFFER] = without_room
    session.object()
    expect(len({o.id for o in offers}) == 1 and len({o.ask for o in offers}) >= 2, offers)
    session.end()


def starts_over_when_told_that_it_is_corrupt(run):
    session = _Session(run)
    session.bulk.objects.spoil_rounds = 2
    session.object()
    expect(session.bulk.objects.most_round == 2, session.bulk.objects.most_round)
    session.end()


def refuses_a_masters_objects(run):
    session = _Session(run)
    session.object()
    answers = []
    session.master.on_bulk[bulk.OBJECT_ANSWER] = lambda message: answers.append(objects.ObjectAnswer.read(message))
    offer = objects.Offer(1, 0, 7, 1000, bytes(32))
    session.master.send(d.BULK, bulk.OFFER, offer.write())
    expect(session.master.until(lambda: answers), "an offer is not answered")
    a = answers[0]
    expect((a.id, a.state, a.reason) == (1, objects.REFUSED, objects.TOO_MANY), a)
    session.end()


def leaves_out_numbers(run):
    """They are left out at random, six of the 190 that an object takes: in one object of twenty there are three."""
    session, came, span = _Session(run, "file-cad"), 0, 0
    for _ in range(12):
        session.object()
        came, span = came + session.bulk.arrivals.count, span + session.bulk.arrivals.span()
        session.end()
        session.again()
    session.end()
    expect(came > 12 * 150 and span > came, came, span)
    expect(0.5 / 32 < (span - came) / span < 0.25, "left out", span - came, "of", span)


def _lie(run, make, is_noticed=True):
    """Sends a receipt that lies; with what the slave says bye for that."""
    session = _Session(run, "file-cad")
    session.object()
    session.master.run(0.1)
    arrivals = session.bulk.arrivals
    receipt = bulk.Receipt(arrivals.newest, arrivals.echo, 0, 0, [(0, 1)], [])
    session.master.send(d.BULK, bulk.RECEIPT, make(receipt, arrivals).write())
    if is_noticed:
        session.master.until(lambda: session.master.bye)
    else:
        session.master.run(0.5)
    return session.master.bye


def ends_with_who_lies(run):
    def names_what_was_left_out(receipt, arrivals):
        receipt.ranges = [(0, min(arrivals.span(), 60000))]
        return receipt

    expect(_lie(run, names_what_was_left_out) == control.LIED, "a receipt of what was left out")


def ends_with_who_is_ahead(run):
    def is_ahead(receipt, _):
        receipt.newest += 100000
        return receipt

    expect(_lie(run, is_ahead) == control.LIED, "a receipt of what was not sent yet")


def ignores_a_wrong_echo(run):
    def has_another_echo(receipt, _):
        receipt.echo ^= 0x100
        return receipt

    expect(_lie(run, has_another_echo, is_noticed=False) is None, "a receipt with a wrong echo ends the session")


def tells_stepped_tiles(run):
    _check_tiles(run, "block-block", tiles.STEPPED)


def tells_smooth_tiles(run):
    _check_tiles(run, "turntable", tiles.SMOOTH)


def tells_courses(run):
    """Of what may change there is a course at once, and another, ahead of the newest pose, when it comes."""
    session = _Session(run, "living")
    master, told = session.master, session_object.read(session.object())
    expect([each.life for each in told.scene.objects] == [0, 2], told.scene.objects)
    master.grid, courses, began = told.grid, session.bulk.courses, time.monotonic()
    while time.monotonic() < began + 9 and len(courses) < 3:
        master.pose((0.0, 0.0, 0.2))
        master.step(0.002)
    expect(len(courses) >= 3, "few courses came", courses)
    expect(all(course.object == 1 for course in courses), courses)
    first, comes, moves = courses[:3]
    expect(not first.is_there and first.begin_s == 0, "in the beginning it is not there", first)
    expect(comes.is_there and comes.version > first.version and 5 < comes.begin_s < 6, "it comes", comes)
    expect(moves.begin == comes.end and moves.takes_s == 2 and moves.version > comes.version, "it moves", moves)
    session.end()


def keeps_what_is_held(run):
    """A master that comes again and tells what it holds is told that it is the same, and gets what it does not hold."""
    session = _Session(run, "block-block")
    session.object()
    first = {}
    for part in map(tiles.read_part, _tiles_where_the_tool_is(session, 12)):
        first.setdefault((part.surface, part.tile), []).append(part)
    whole = {}
    for place, parts in first.items():
        rows = [row for part in sorted(parts, key=lambda part: part.first_row) for row in part.rows]
        whole.update({place: rows} if len(rows) == tiles.SIDE else {})
    expect(len(whole) > 3, "few whole tiles came", len(whole))
    session.end()

    session.again()
    session.object()
    wrong = min(whole)
    for place, rows in whole.items():
        told = tiles.hash_of(rows) ^ (place == wrong)
        session.master.send(d.BULK, control.TILES_HELD, control.write_tiles_held(*place, [told]))
    forms = {}
    for part in map(tiles.read_part, _tiles_where_the_tool_is(session, 12)):
        forms.setdefault((part.surface, part.tile), set()).add(part.form)
    same = [place for place in whole if forms.get(place) == {tiles.SAME}]
    expect(len(same) > 2, "held tiles were sent again", forms)
    expect(tiles.SAME not in forms.get(wrong, set()), "a tile is held otherwise, and said to be the same", wrong)
    expect(all(tiles.SAME not in forms[place] for place in forms if place not in whole), "never held, and the same")
    session.end()


def _tiles_where_the_tool_is(session, most):
    """Bodies of tile messages."""
    master, told = session.master, session_object.read(session.object())
    master.grid = told.grid
    low, parts = n.scaled(n.add(*told.scene.region), 0.5), session.bulk.parts
    to, next_request, end, k = n.sub(low, told.scene.working_point), 0.0, time.monotonic() + _TILES_S, 0
    expect(not parts, "tiles that nobody asked for")
    while time.monotonic() < end and len(parts) < most:
        if time.monotonic() >= next_request:
            next_request = time.monotonic() + 0.1
            master.send(d.BULK, control.TILE_REQUEST, control.write_tile_request(1))
        k += 1
        master.pose(n.add(to, (1e-5 * (k % 1000), 0.0, -0.001)), twist=(0.0, 0.0, 0.0, 0.01, 0.0, 0.0))
        master.step(0.002)
    expect(len(parts) > 3, "few tiles came", len(parts))
    return list(parts)


def _check_tiles(run, scene, form):
    """Tiles come where the tool is, whole, and within the bounds that the coarsest heights give them."""
    session = _Session(run, scene)
    told = session_object.read(session.object())
    coarsest = [tiles.Coarsest(body) if body.charts else None for body in told.outline.bodies]
    seen, forms, farthest = {}, set(), 0.0
    for body in _tiles_where_the_tool_is(session, 40):
        part = tiles.read_part(body)
        key = part.surface, part.tile, part.version, part.first_row
        # One may come again, where the slave took it for lost: then it is the same.
        expect(seen.setdefault(key, body) == body, "of one version there are two parts", key)
        forms.add(part.form)
        farthest = max(farthest, _off(part, told.outline.bodies[part.surface], coarsest[part.surface]))
    expect(form in forms, "no tile of form", form)
    expect(farthest <= 1.0, "a coefficient is off by", farthest, "of its tile's bound")
    expect(farthest > 0.5, "the bound is far from what it bounds", farthest)
    session.end()


def _off(part, body, coarsest):
    """How far a part's coefficients are from the coarsest heights, of the tile's bound and what a slave may round."""
    chart, column, row = coarsest.tile(part.tile)
    rounding = 0.5e-6 / body.scale_m + 1
    most = coarsest.bounds[part.tile] * coarsest.step + rounding
    off = 0
    for j, values in enumerate(part.rows):
        for i, value in enumerate(values):
            at_column, at_row = column + i - 1, row + part.first_row + j - 1
            if at_column <= body.charts[chart].columns and at_row <= body.charts[chart].rows:
                off = max(off, abs(value - coarsest.coefficient(chart, at_column, at_row)))
    return off / most


if __name__ == "__main__":
    sys.exit(main([gives_its_object, gives_its_object_through_loss, gives_colours, asks_again_where_there_is_no_room,
                   starts_over_when_told_that_it_is_corrupt, refuses_a_masters_objects, leaves_out_numbers,
                   ends_with_who_lies, ends_with_who_is_ahead, ignores_a_wrong_echo,
                   tells_stepped_tiles, tells_smooth_tiles, keeps_what_is_held, tells_courses]))
