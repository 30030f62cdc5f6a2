# SPDX-License-Identifier: Apache-2.0
"""The node's time at each frame of a log, full times of stamps, and the calendar where the log shows it."""
import numpy as np

STAMP_SPAN = 1 << 20  # of a stamp, in us
CALENDAR_US = 946_684_800_000_000  # 2000-01-01: nothing that counts from its start reaches it
RATE = 0.01  # log and node differ by less where the log was recorded live
JUMP_US = 100_000  # a node's clock was set where it passes so much more or less than the log's
NEAR = 100  # epochs on either side of a restart, of which the one with the least latency counts


class Clock:
    """Times of one node, in us: `epochs` and their places `at` among the frames. Without an epoch the times of reception take their place.

    A node that was switched on again counts from its start, until it has the time of the bus. Its time here goes on by that of reception where the
    log was recorded live, else one period behind the last epoch. `restarts` is how often."""

    def __init__(self, messages):
        self._reception = messages.frames.time_us
        self.at, self._own = messages.epoch_us()
        self._starts = np.append(0, np.flatnonzero(np.diff(self._own) < 0) + 1)  # first epoch behind each power-on
        self.restarts = len(self._starts) - 1
        self._live = self._is_live()
        self.epochs = self._continued() if self.restarts else self._own
        self.utc_us = self._utc()

    def _is_live(self):
        """Whether times of reception are there and pass as the node's do."""
        if len(self.at) < 2:
            return False
        log_us = self._reception[self.at]
        of_node, passed = np.diff(self._own), np.diff(log_us)
        usual = (of_node > 0) & (of_node < max(10 * np.median(of_node), 1))
        return log_us.min() >= 0 and usual.any() and abs(passed[usual].sum() - of_node[usual].sum()) < RATE * of_node[usual].sum()

    def _continued(self):
        log_us, epochs, firsts = self._reception[self.at], self._own.copy(), self._starts[1:]
        if self._live:
            set_at = np.flatnonzero(abs(np.diff(log_us) - np.diff(epochs)) > JUMP_US) + 1
            firsts = np.union1d(firsts, set_at[set_at > firsts[0]])
        period = max(int(np.median(np.diff(epochs))), 1)
        for first, end in zip(firsts, np.append(firsts[1:], len(epochs))):
            ahead = epochs[first - 1] - epochs[first] + (1 if self._live else period)
            if self._live:
                late, before = ((log_us[part] - epochs[part]).min() for part in (slice(first, min(first + NEAR, end)), slice(max(first - NEAR, 0), first)))
                ahead = max(late - before, ahead)
            epochs[first:end] += ahead
        return epochs

    def _utc(self):
        """UTC less the node's time by the clock of the host that recorded, None where the log does not show it: its times have to be of the
        calendar and to pass as the node's do. Of all epochs the one with the least latency counts."""
        log_us = self._reception[self.at]
        return int((log_us - self.epochs).min()) if self._live and log_us.min() >= CALENDAR_US else None

    def index(self, places):
        """Number of the epoch that each frame belongs to, -1 before the first."""
        return np.searchsorted(self.at, places, side="right") - 1

    def power_on(self, epochs):
        """Number of the first epoch behind the power-on of each of these; -1, as of frames before the first one, where the log begins with it."""
        first = self._starts[np.searchsorted(self._starts, epochs, side="right") - 1]
        return np.where(first > 0, first, -1)

    def stamps(self, places, stamp):
        """The full times of stamps of 20 bits: those nearest to the node's time at the frames."""
        if len(self.epochs):
            of = self._of_stamp(places)
            near, ahead = self._own[of], self.epochs[of] - self._own[of]
        else:
            near, ahead = np.maximum(self._reception[places], 0), 0
        return near + (stamp - near + STAMP_SPAN // 2) % STAMP_SPAN - STAMP_SPAN // 2 + ahead

    def _of_stamp(self, places):
        """Number of the epoch by whose time a stamp is told: behind a power-on the node takes frames before it makes the first one."""
        last = np.maximum(self.index(places), 0)
        following = np.minimum(last + 1, len(self.at) - 1)
        log_us, now = self._reception[self.at], self._reception[places]
        early = self._live & np.isin(following, self._starts) & (log_us[following] - now < now - log_us[last])
        return np.where(early, following, last)
