# SPDX-License-Identifier: Apache-2.0
"""The node's time at each frame of a log, full times of stamps, and the calendar where the log shows it."""
import numpy as np

STAMP_SPAN = 1 << 20  # of a stamp, in us
CALENDAR_US = 946_684_800_000_000  # 2000-01-01: nothing that counts from its start reaches it
RATE = 0.01  # log and node differ by less where the log was recorded live


class Clock:
    """Times of one node, in us: `epochs` and their places `at` among the frames. Without an epoch the times of reception take their place."""

    def __init__(self, messages):
        self._reception = messages.frames.time_us
        self.at, self.epochs = messages.epoch_us()
        self.utc_us = self._utc()

    def _utc(self):
        """UTC less the node's time by the clock of the host that recorded, None where the log does not show it: its times have to be of the
        calendar and to pass as the node's do. Of all epochs the one with the least latency counts."""
        log_us = self._reception[self.at]
        if len(self.at) < 2 or log_us.min() < CALENDAR_US:
            return None
        passed, of_node = log_us[-1] - log_us[0], self.epochs[-1] - self.epochs[0]
        return int((log_us - self.epochs).min()) if abs(passed - of_node) < RATE * of_node else None

    def index(self, places):
        """Number of the epoch that each frame belongs to, -1 before the first."""
        return np.searchsorted(self.at, places, side="right") - 1

    def stamps(self, places, stamp):
        """The full times of stamps of 20 bits: those nearest to the node's time at the frames."""
        near = self.epochs[np.maximum(self.index(places), 0)] if len(self.epochs) else np.maximum(self._reception[places], 0)
        return near + (stamp - near + STAMP_SPAN // 2) % STAMP_SPAN - STAMP_SPAN // 2
