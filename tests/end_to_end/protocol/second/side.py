"""A side session (PROTOCOL.md, "A session"): a master's bulk lane alone, which is then the side lane."""

from . import datagrams as d
from .lane import Counter, MasterLane
from .master import Master
from .sodium import SUITES


class Side(Master):
    def __init__(self, port, secret, slave_public, counter=None):
        super().__init__(port, secret, slave_public)
        counter = counter or Counter()
        self.lanes[d.BULK] = MasterLane(d.SIDE, SUITES[0], secret, slave_public, counter, self.number)

    def begin(self):
        self.session = self.greet(d.BULK).session
