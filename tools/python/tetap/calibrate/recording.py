# SPDX-License-Identifier: Apache-2.0
"""The samples of a candump log as arrays with one time: what tools/calibrate/calibrate_robot reads. Layout from config/tetap.dbc.

A stamp holds the low 20 bits of a microsecond. It is extended around the node's own time (In_Sync, Est_Epoch) where the log has it, so a log
that was recorded faster or slower than the world ran is right too; else around the time of reception, whose offset to the stamps is followed.
A node that ticks by its own clock until a run begins (In_Sync of kind Begin) has published
two times: only that of the run with the samples counts. The same holds where In_Sync begins without a Begin and has another time.
Times are seconds since the first sample of any sensor.
"""

import numpy as np

from tetap.can import bus_database, columns
from tetap.can import decoder as decode
from tetap.can.bus_writer import BadInput

STAMP_SPAN = 1 << 20
DENSE_US = 200_000      # node times closer together than this: a frame between two of them is placed by its order alone
TOGETHER = 200          # frames of one sample are not further apart than so many frames
BACK_US = 100_000       # stamps of one sensor may be out of order by so much: sorted and counted; and so may the node's times
WANTED = ("In_WheelCounts", "In_WheelSpeed", "In_BodySpeed", "In_GnssLat", "In_GnssLon", "In_GnssAlt", "In_GnssAcc", "In_GnssVelEN",
          "In_GnssVelU", "In_Mag", "In_Feature", "In_Image")


class Samples:
    """One sensor: `t` [s], `line` (in the file) and whatever else it was given, all of one length."""

    def __init__(self, **columns):
        self.__dict__.update(columns)
        self.columns = list(columns)

    def __len__(self):
        return len(self.t)

    def keep(self, mask):
        return Samples(**{name: getattr(self, name)[mask] for name in self.columns})


class Frames:
    """All frames of one message: order in the log, line, time of reception and the signals as physical values (NaN: not available)."""

    def __init__(self, message, rows):
        parts = zip(*rows) if rows else ((),) * 4
        self.order, self.line, self.log_us, word = (np.array(column, dtype=kind) for column, kind in zip(parts, (np.int64,) * 3 + (np.uint64,)))
        for signal in message.signals:
            setattr(self, signal.field.lower(), columns.signal(word, signal))

    def __len__(self):
        return len(self.order)


def _time_us(text):
    """Time of reception, None where the log has none that goes on over midnight."""
    try:
        return round(float(text) * 1e6)
    except (TypeError, ValueError):
        return None


def _cut_off(path, number, line):
    return f"{path}:{number}: the last line is cut off and left out: {decode.shown(line)}"


def _rows(path, dbc, base, notes):
    """(rows by message name, node times, begins): rows and times are (order, line, time of reception, payload or time), begins the rows of
    In_Sync that set the node's time anew. A last line without a newline that is no whole frame goes to `notes`."""
    by_id = {message.offset + base: message for message in dbc.messages}
    rows = {message.name: [] for message in dbc.messages}
    kind = next(signal for message in dbc.messages if message.name == "In_Sync" for signal in message.signals if signal.enum == "SyncKind")
    begin = next(code for code, word in dbc.tables["SyncKind"].items() if word == "Begin")
    nodes, begins = [], []
    frames, others = 0, set()
    try:
        with open(path, "rb") as file:
            for number, line in enumerate(file, 1):
                if not line.strip():
                    continue
                try:
                    time, _, id_text, data, _ = decode.parse(line)
                except decode.Malformed as reason:
                    if not line.endswith(b"\n"):
                        notes.append(_cut_off(path, number, line))
                        break
                    raise BadInput(f"{path}:{number}: {reason}") from None
                if data is None or len(id_text) != 3:
                    continue
                message = by_id.get(int(id_text, 16))
                if message is None:
                    others.add(int(id_text, 16))
                    continue
                if len(data) != message.size:
                    if not line.endswith(b"\n"):
                        notes.append(_cut_off(path, number, line))
                        break
                    raise BadInput(f"{path}:{number}: {message.name} has {len(data)} bytes, not {message.size}")
                frames += 1
                word = int.from_bytes(data, "little")
                log_us = _time_us(time)
                rows[message.name].append((frames, number, -1 if log_us is None else log_us, word))
                if message.name in ("In_Sync", "Est_Epoch"):
                    nodes.append((frames, number, log_us, word & (1 << 48) - 1, message.name))
                    if message.name == "In_Sync" and word >> kind.start & (1 << kind.length) - 1 == begin:
                        begins.append(nodes[-1])
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}") from None
    if not frames:
        seen = ", ".join(f"{i:03X}" for i in sorted(others)[:8])
        raise BadInput(f"{path}: no frame of a node with base 0x{base:X}" + (f"; ids in it: {seen} ... (--base)" if seen else ": the log is empty"))
    return rows, nodes, begins


def _of_one_run(path, nodes, begins, samples):
    """The node's times of the run that the samples (order in the log, ascending) belong to."""
    orders = [begin[0] for begin in begins]
    runs = np.unique(np.searchsorted(orders, samples))  # 0: before the first begin
    if not begins or not len(runs):
        return nodes
    if len(runs) > 1:
        raise BadInput(f"{path}:{begins[runs[1] - 1][1]}: the node begins anew here, with sensors' samples before and after: two runs in one log, cut it here")
    run = int(runs[0])
    first, last = 0 if run == 0 else orders[run - 1], orders[run] if run < len(orders) else np.inf
    mine = [one for one in nodes if first <= one[0] < last]
    if run > 0:  # a frame by its old clock may come just after the new one was set
        begun = mine[0][3]
        its = next((k for k, one in enumerate(mine[1:], 1) if begun <= one[3] <= begun + STAMP_SPAN), len(mine))
        del mine[1:its]
    return mine


def _from_first_sync(path, nodes, notes):
    """(the node's times without those of its own clock, order of the last one that is left out): before the first In_Sync the node ticks by itself."""
    first = next((k for k, one in enumerate(nodes) if one[4] == "In_Sync"), 0)
    own = [one for one in nodes[:first] if one[4] == "Est_Epoch"]
    if not own or abs(nodes[first][3] - own[-1][3]) <= BACK_US:
        return nodes, 0
    notes.append(f"{path}:{nodes[first][1]}: the first In_Sync gives {nodes[first][3] / 1e6:.3f} s; left out: {len(own)} epochs before it by the node's own clock, "
                 f"{own[0][3] / 1e6:.3f} to {own[-1][3] / 1e6:.3f} s")
    begun = nodes[first][3]  # an epoch by the old clock may come just after the new one was set
    its = next((k for k, one in enumerate(nodes[first + 1:], first + 1) if begun <= one[3] <= begun + STAMP_SPAN), len(nodes))
    return [nodes[first], *nodes[its:]], own[-1][0]


class Clock:
    """Extends stamps to microseconds that never wrap."""

    def __init__(self, path, nodes):
        self.path = path
        self.nodes = nodes
        last = {}
        for after in nodes:
            before = last.get(after[4], after)
            last[after[4]] = after
            if after[3] < before[3] - BACK_US:
                raise BadInput(f"{path}:{after[1]}: the node's time goes back from {before[3] / 1e6:.3f} s to {after[3] / 1e6:.3f} s: "
                               "two runs in one log, cut it here")
        if nodes:
            order, _, log_us, time_us, _ = zip(*nodes)
            time_us = np.maximum.accumulate(np.array(time_us, dtype=np.int64))
            self.dense = np.diff(time_us).max(initial=0) <= DENSE_US or None in log_us
            self.key = np.array(order if self.dense else log_us, dtype=np.int64)
            self.time_us, self.last_log_us = time_us, log_us[-1]

    def near(self, frames):
        """The node's time at these frames, to better than half a stamp's span."""
        near = np.interp(frames.order if self.dense else frames.log_us, self.key, self.time_us)
        if self.last_log_us is not None and not self.dense:
            after = frames.log_us > self.last_log_us
            near[after] = self.time_us[-1] + frames.log_us[after] - self.last_log_us
        return near.astype(np.int64)

    def extend(self, groups):
        """Microseconds for every sample of a list of (frames, stamps)."""
        if self.nodes:
            ends = []
            for frames, stamp in groups:
                near = self.near(frames)
                ends.append(near + (stamp - near + STAMP_SPAN // 2) % STAMP_SPAN - STAMP_SPAN // 2)
            return ends
        order, stamp, log_us, line = (np.concatenate(column) for column in zip(*[(f.order, s, f.log_us, f.line) for f, s in groups]))
        if (log_us < 0).any():
            raise BadInput(f"{self.path}:{line[np.argmax(log_us < 0)]}: neither a time of reception in seconds (candump -L) nor the node's time "
                           "(In_Sync, Est_Epoch): samples cannot be placed")
        turn = np.argsort(order, kind="stable")
        offset = np.unwrap((log_us - stamp)[turn] % STAMP_SPAN, period=STAMP_SPAN)
        extended = np.empty(len(order), dtype=np.int64)
        extended[turn] = log_us[turn] - offset.astype(np.int64)
        return np.split(extended, np.cumsum([len(f) for f, _ in groups])[:-1])


def _joined(*parts):
    """Rows of several messages that are one sample (instance, sequence and stamp are the same): indices into each, in whatever order they came."""
    keys = [np.stack([p.inst, p.seq, p.stamp], axis=1).tolist() for p in parts]
    frames = sorted((order, k, row) for k, part in enumerate(parts) for row, order in enumerate(part.order.tolist()))
    pending, rows = {}, []
    for order, k, row in frames:
        begun = pending.setdefault(tuple(keys[k][row]), [order, {}])
        if order - begun[0] > TOGETHER:  # age of a sample of long ago: stamps come again
            begun[:] = [order, {}]
        begun[1][k] = row
        if len(begun[1]) == len(parts):
            rows.append([begun[1][j] for j in range(len(parts))])
            del pending[tuple(keys[k][row])]
    return np.array(rows, dtype=np.int64).reshape(-1, len(parts)).T


def _imu_rows(gyro, accel, time):
    """A sample is complete with its Time frame: the latest Gyro and Accel before it, of the same sequence."""
    latest = []
    for part in (gyro, accel):
        before = np.searchsorted(part.order, time.order) - 1
        ok = before >= 0
        ok[ok] &= part.seq[before[ok]] == time.seq[ok]
        ok[ok] &= time.order[ok] - part.order[before[ok]] < TOGETHER
        latest.append((before, ok))
    whole = latest[0][1] & latest[1][1]
    return latest[0][0][whole], latest[1][0][whole], np.flatnonzero(whole)


class Log:
    """imu, wheels (`kind`: counts, wheel speeds, body speed), gnss, velocity, mag, images: Samples, or None; `dropped`: what was left out."""

    def __init__(self, path, dbc_path, base, imu_instance=0, gnss_instance=0):
        self.path, self.dropped, self.notes = path, {}, []
        try:
            dbc = bus_database.read(dbc_path)
        except bus_database.Refused as refusal:
            raise BadInput(str(refusal)) from None
        rows, nodes, begins = _rows(path, dbc, base, self.notes)
        messages = {message.name: message for message in dbc.messages}
        names = WANTED + tuple(f"In_Imu{imu_instance}{kind}" for kind in ("Gyro", "Accel", "Time"))
        samples = sorted(row[0] for name in names for row in rows[name])
        nodes, behind = _from_first_sync(path, _of_one_run(path, nodes, begins, samples), self.notes)
        self._drop("frames of sensors before the first In_Sync", np.count_nonzero(np.array(samples, dtype=np.int64) <= behind))
        frames = {name: Frames(messages[name], [row for row in rows[name] if row[0] > behind]) for name in names}
        clock = Clock(path, nodes)
        wanted, stamps = [], []

        def stamped(name, value):
            wanted.append(name)
            stamps.append((value, value.stamp))

        imu = [frames[name] for name in names[-3:]]
        for name in ("In_WheelCounts", "In_WheelSpeed", "In_BodySpeed", "In_Mag", "In_GnssAcc", "In_GnssVelU", "In_Image", names[-1]):
            if len(frames[name]):
                stamped(name, frames[name])
        if not wanted:
            raise BadInput(f"{path}: no sensor's samples in it (inputs of the node: In_...)")
        times = dict(zip(wanted, clock.extend(stamps)))
        start = min(time.min() for time in times.values())
        seconds = {name: (time - start) * 1e-6 for name, time in times.items()}
        self.duration_s = max(time.max() for time in seconds.values())
        self.imu = self._imu(imu, seconds.get(names[-1]))
        self.wheels = self._wheels(frames, seconds)
        self.gnss, self.velocity = self._gnss(frames, seconds, gnss_instance)
        self.mag = self._mag(frames["In_Mag"], seconds.get("In_Mag"))
        self.images = self._images(frames["In_Feature"], frames["In_Image"], seconds.get("In_Image"))

    def _drop(self, what, count):
        if count:
            self.dropped[what] = self.dropped.get(what, 0) + int(count)

    def _in_order(self, what, samples):
        """Sorted by time, each moment once."""
        if samples is None or not len(samples):
            return None
        back = np.flatnonzero(np.diff(samples.t) < -BACK_US * 1e-6)
        if len(back):
            row = back[0] + 1
            raise BadInput(f"{self.path}:{samples.line[row]}: {what}: the stamp goes back by {samples.t[row - 1] - samples.t[row]:.3f} s")
        order = np.argsort(samples.t, kind="stable")
        samples = samples.keep(order)
        new = np.append(True, np.diff(samples.t) > 0)
        self._drop(f"{what}: samples with a stamp that was there before", np.count_nonzero(~new))
        return samples.keep(new)

    def _imu(self, parts, seconds):
        if seconds is None:
            return None
        gyro, accel, time = parts
        g, a, t = _imu_rows(gyro, accel, time)
        self._drop("IMU: samples of which a frame is missing", len(time) - len(t))
        angle = np.stack([gyro.angx, gyro.angy, gyro.angz], axis=1)[g]
        velocity = np.stack([accel.velx, accel.vely, accel.velz], axis=1)[a]
        interval = time.interval[t] * 1e-6
        ok = np.isfinite(angle).all(axis=1) & np.isfinite(velocity).all(axis=1) & (interval > 0)
        self._drop("IMU: samples not available or without interval", np.count_nonzero(~ok))
        samples = Samples(t=seconds[t], dt=interval, angle=angle, velocity=velocity, temp=time.temp[t],
                          clipped=time.clipgyro[t] + time.clipaccel[t] > 0, line=time.line[t]).keep(ok)
        return self._in_order("IMU", samples)

    def _wheels(self, frames, seconds):
        kinds = [("counts", "In_WheelCounts", "left", "right"), ("wheel speeds", "In_WheelSpeed", "left", "right"),
                 ("body speed", "In_BodySpeed", "forward", "yawrate")]
        there = [kind for kind in kinds if len(frames[kind[1]])]
        if not there:
            return None
        if len(there) > 1:
            self.notes.append(f"wheels: {there[0][1]} used, {', '.join(kind[1] for kind in there[1:])} not")
        kind, name, first, second = there[0]
        part = frames[name]
        mine = part.inst == part.inst.min()
        self._drop(f"{name}: samples of other instances", np.count_nonzero(~mine))
        one, two = (np.asarray(getattr(part, field), dtype=float) for field in (first, second))
        ok = mine & np.isfinite(one) & (np.isfinite(two) | (kind == "body speed"))
        self._drop(f"{name}: samples not available", np.count_nonzero(mine & ~ok))
        samples = self._in_order(name, Samples(t=seconds[name], one=one, two=two, line=part.line).keep(ok))
        if samples is not None:
            samples.kind, samples.message = kind, name
        return samples

    def _gnss(self, frames, seconds, instance):
        position = velocity = None
        if "In_GnssAcc" in seconds:
            lat, lon, alt, acc = (frames[f"In_Gnss{name}"] for name in ("Lat", "Lon", "Alt", "Acc"))
            rows = _joined(lat, lon, alt, acc)
            self._drop("GNSS: positions of which a frame is missing", len(acc) - rows.shape[1])
            i, j, k, m = rows
            fix = alt.fix[k]
            samples = Samples(t=seconds["In_GnssAcc"][m], lat=lat.lat[i], lon=lon.lon[j], height=alt.height[k], acc=acc.hor[m], fix=fix,
                              line=acc.line[m])
            mine = acc.inst[m] == instance
            ok = mine & (fix >= 2) & np.isfinite(samples.lat) & np.isfinite(samples.lon) & (np.abs(samples.lat) <= 90)
            self._drop("GNSS: positions without a fix", np.count_nonzero(mine & ~ok))
            position = self._in_order("GNSS position", samples.keep(ok))
        if "In_GnssVelU" in seconds:
            flat, up = frames["In_GnssVelEN"], frames["In_GnssVelU"]
            i, j = _joined(flat, up)
            samples = Samples(t=seconds["In_GnssVelU"][j], east=flat.east[i], north=flat.north[i], up=up.up[j], acc=up.acc[j], line=up.line[j])
            ok = (up.inst[j] == instance) & np.isfinite(samples.east) & np.isfinite(samples.north)
            velocity = self._in_order("GNSS velocity", samples.keep(ok))
        return position, velocity

    def _mag(self, part, seconds):
        if seconds is None:
            return None
        flux = np.stack([part.fluxx, part.fluxy, part.fluxz], axis=1)
        ok = np.isfinite(flux).all(axis=1) & (part.inst == part.inst.min())
        self._drop("magnetometer: samples not available or of other instances", np.count_nonzero(~ok))
        return self._in_order("magnetometer", Samples(t=seconds, flux=flux, line=part.line).keep(ok))

    def _images(self, feature, image, seconds):
        """Images of camera 0 whose features are all there: `track` and `pixel` [px] of each are arrays."""
        if seconds is None:
            return None
        mine = np.flatnonzero(feature.inst == 0)
        own = np.flatnonzero(image.inst == 0)
        begun = np.searchsorted(feature.order[mine], image.order[own])  # features come before the frame that closes their image
        track, pixel, whole = [], [], np.zeros(len(own), dtype=bool)
        for i, (row, end, count) in enumerate(zip(own, begun, image.count[own])):
            rows = mine[max(0, end - int(count)):end] if np.isfinite(count) else mine[:0]
            at = np.stack([feature.u[rows], feature.v[rows]], axis=1).astype(float)
            same = (feature.stamp[rows] == image.stamp[row]) & (feature.seq[rows] == image.seq[row]) & np.isfinite(at).all(axis=1)
            whole[i] = len(rows) == count and same.all()
            track.append(feature.trackid[rows].astype(int))
            pixel.append(at)
        self._drop("images of which a feature is missing", np.count_nonzero(~whole))
        lists = np.empty((2, len(own)), dtype=object)
        lists[0, :], lists[1, :] = track, pixel
        return self._in_order("images", Samples(t=seconds[own], track=lists[0], pixel=lists[1], line=image.line[own]).keep(whole))

    def cut(self, spans):
        """Only what lies within the spans (start, end) [s]."""
        for name in ("imu", "wheels", "gnss", "velocity", "mag", "images"):
            samples = getattr(self, name)
            if samples is None:
                continue
            inside = np.zeros(len(samples), dtype=bool)
            for start, end in spans:
                inside |= (samples.t >= start) & (samples.t <= end)
            kept = samples.keep(inside)
            for extra in ("kind", "message"):
                if hasattr(samples, extra):
                    setattr(kept, extra, getattr(samples, extra))
            setattr(self, name, kept if len(kept) else None)
