"""The policies and profile that the bridge names."""
import enum


class HistoryPolicy(enum.IntEnum):
    KEEP_LAST = 1


class ReliabilityPolicy(enum.IntEnum):
    RELIABLE = 1
    BEST_EFFORT = 2


class DurabilityPolicy(enum.IntEnum):
    TRANSIENT_LOCAL = 1
    VOLATILE = 2


class QoSProfile:
    def __init__(self, *, history, depth, reliability, durability):
        assert history is HistoryPolicy.KEEP_LAST and depth > 0
        self.depth, self.reliability, self.durability = depth, reliability, durability
