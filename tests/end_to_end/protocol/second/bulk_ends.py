"""The bulk lane at a master, which receives objects and tiles, and at a slave, which sends the session object."""

from . import bulk, control
from . import datagrams as d
from .master import now_us
from .objects import COMPLETE, ObjectAnswer, ObjectOut, ObjectsIn
from .sodium import Refused

SESSION_SLOT = 0
_LOST_AFTER_US = 60_000
_PIECES_A_STEP = 2


class BulkAtMaster:
    """Objects come in, and receipts go out. `tiles` counts tile parts."""

    def __init__(self, master):
        self._master = master
        self.arrivals = bulk.Arrivals(now_us)
        self.objects = ObjectsIn(lambda kind, message: master.send(d.BULK, kind, message))
        self.receipts, self.pieces, self.parts, self.courses = 0, 0, [], []
        handlers = {bulk.OFFER: self.objects.on_offer, bulk.WITHDRAWAL: self.objects.on_withdrawal}
        handlers.update({kind: lambda message, kind=kind: self._numbered(kind, message) for kind in bulk.NUMBERED})
        master.on_bulk.update(handlers)
        master.steps.append(self._step)

    def _numbered(self, kind, message):
        came = self.arrivals.take(message)
        if came is None:
            return
        if kind == bulk.PIECE:
            self.pieces += 1
            self.objects.on_piece(came[1])
        elif kind == bulk.TILE:
            self.parts.append(came[1])
        elif kind == bulk.COURSE:
            self.courses.append(control.Course.read(came[1]))
        elif kind == bulk.PADDING:
            if any(came[1]):
                raise Refused("padding that is not zeros")
        else:
            raise Refused(f"numbered type {kind}")

    def _step(self, _):
        receipt = self.arrivals.receipt()
        if receipt:
            self.receipts += 1
            self._master.send(d.BULK, bulk.RECEIPT, receipt.write())

    def session_object(self):
        return self.objects.delivered.get(SESSION_SLOT)


class BulkAtSlave:
    """Gives the session object to the master, again with each session; before it those of `wrong`: bytes, hash."""

    def __init__(self, slave, data, wrong=()):
        self._slave, self._objects = slave, [*wrong, (data, None)]
        self._session = None
        self.receipts = self.lost = self.pieces = 0
        self.tile_requests = []
        slave.on_bulk.update({bulk.RECEIPT: self._receipt, bulk.OBJECT_ANSWER: self._answer,
                              control.TILE_REQUEST: self._tile_request})
        slave.steps.append(self._step)

    def _send(self, kind, message):
        self.pieces += kind == bulk.PIECE
        self._slave.send(d.BULK, kind, message)

    def _begin(self):
        self._session = self._slave.session
        self.numbered, self.object_answers = bulk.Numbered(now_us), []
        self._offer(1)

    def _offer(self, id):
        self.out = ObjectOut(id, SESSION_SLOT, self._objects[id - 1][0], self._send, self.numbered, now_us,
                             self._objects[id - 1][1])

    def pad(self, size):
        """Sends so many zeros in a numbered message."""
        self._slave.send(d.BULK, bulk.PADDING, self.numbered.head(()) + bytes(size))

    def say(self, kind, message):
        self._slave.send(d.BULK, kind, message)

    def _receipt(self, message):
        receipt = bulk.Receipt.read(message)
        self.receipts += 1
        self.numbered.believe(receipt)

    def _tile_request(self, message):
        self.tile_requests.append(control.read_tile_request(message))

    def _answer(self, message):
        answer = ObjectAnswer.read(message)
        self.object_answers.append(answer)
        self.out.on_answer(answer)

    def _step(self, _):
        if not self._slave.where[d.BULK]:
            return
        if self._session != self._slave.session:
            self._begin()
        if self.out.is_done() and self.out.id < len(self._objects):
            self._offer(self.out.id + 1)
        lost = self.numbered.lost(_LOST_AFTER_US)
        self.lost += len(lost)
        self.out.again(lost)
        for _ in range(_PIECES_A_STEP):
            self.out.step()

    def is_given(self):
        return self._session is not None and self._session == self._slave.session and self.out.id == len(
            self._objects) and self.out.state == COMPLETE
