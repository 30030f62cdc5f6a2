# SPDX-License-Identifier: Apache-2.0
"""Runs the steps of a form: as many at a time as there are processors, each one's output in a file, what is unchanged since it passed left out."""
import argparse
import dataclasses
import math
import os
import re
import signal
import subprocess
import sys
import threading
import time

from tetap.proof import stamps
from tetap.proof.steps import Table, TableError

SKIPPED = 77
TOO_SLOW = 75           # a step in real time: its last line has the figure by which the machine was too slow
NOT_RUN = 76            # a step for which another one had to pass
STOPPED = 124           # a step that was silent for too long, or used too much of a processor
ALIVE_SHARE = 0.01      # of one processor: a step that uses less and writes nothing is silent
TAIL = 25               # lines of a failed step that are shown
BESIDE = 10             # niceness of what only computes
FOREIGN_SHARE = 0.25    # share of the processors; with more than that taken by others a step in real time is not judged
WORDS = {0: "", SKIPPED: "  skipped", NOT_RUN: "  not run"}
# A proof of identity reports bytes or state CRCs that differ. Such a finding is the proof's purpose: no machine is too slow for it.
DIFFERS = re.compile(r"\bdiffer(s|ent)?\b|EOF on |came back as|every state CRC|does not move|the same as the undisturbed", re.I)


def bytes_differ(text):
    return any(DIFFERS.search(re.sub(r", different 0$", "", line)) for line in text.splitlines())


@dataclasses.dataclass
class Job:
    step: object
    item: str
    log: str
    status: int = None
    wall: float = 0.0
    cpu: float = 0.0
    note: str = ""
    unchanged: bool = False
    begun: float = 0.0

    @property
    def name(self):
        return self.step.name + (f"/{os.path.basename(self.item)}" if self.item else "")


def busy_s():
    """Seconds that all processors have worked or were taken away by the machine below since it started."""
    with open("/proc/stat", encoding="ascii") as file:
        user, nice, system, _, _, irq, softirq, steal = map(int, file.readline().split()[1:9])
    return (user + nice + system + irq + softirq + steal) / os.sysconf("SC_CLK_TCK")


def processor_s(first):
    """Seconds of CPU of a process, of all of its session and of their children, ended ones included where their parent waited for them."""
    rows = {}
    for name in os.listdir("/proc"):
        if not name.isdigit():
            continue
        try:
            with open(f"/proc/{name}/stat", encoding="utf-8", errors="replace") as file:
                words = file.read().rpartition(")")[2].split()
        except OSError:
            continue
        rows[int(name)] = int(words[1]), int(words[3]), sum(map(int, words[11:15]))
    ours = {pid for pid, (_, session, _) in rows.items() if first in (pid, session)}
    while more := {pid for pid, (parent, _, _) in rows.items() if parent in ours} - ours:
        ours |= more
    return sum(rows[pid][2] for pid in ours) / os.sysconf("SC_CLK_TCK")


class Watch:
    """Ends a step that is silent for too long or uses too much CPU. The clock alone ends none: a slow machine is no failure."""

    def __init__(self, process, log, limits):
        self.process, self.log, self.limits, self.reason = process, log, limits, ""
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        silence_s = self.limits["silence_s"]
        since, written, used = time.monotonic(), 0, 0.0
        while not self.ended.wait(min(5.0, silence_s / 10)):
            now, size, cpu = time.monotonic(), os.path.getsize(self.log), processor_s(self.process)
            if cpu > self.limits["cpu_s"]:
                return self.stop(f"used more than {self.limits['cpu_s']} s of CPU")
            if size != written or not used <= cpu < used + ALIVE_SHARE * silence_s:
                since, written, used = now, size, cpu
            elif now - since > silence_s:
                return self.stop(f"silent for {silence_s} s: it wrote nothing and used no CPU")
        return None

    def stop(self, reason):
        self.reason = reason
        Runner.kill(self.process)
        if not self.ended.wait(5.0):
            Runner.kill(self.process, signal.SIGKILL)

    def end(self):
        self.ended.set()
        self.thread.join()
        return self.reason


class Runner:
    def __init__(self, table, form, steps, kept, out, fresh=False, processors=None, say=print):
        self.table, self.form, self.steps, self.stamps, self.out, self.fresh, self.say = table, form, steps, kept, out, fresh, say
        self.processors = processors or len(os.sched_getaffinity(0))
        self.settings = {key: str(value) for key, value in table.forms[form].items()}
        self.jobs = {step.name: None for step in steps}
        self.ended, self.again = set(), []
        self.lock, self.wake = threading.Lock(), threading.Condition()
        self.groups, self.stopped = set(), False
        self.began = time.monotonic()
        self.results = {}

    # -- one job
    def slots(self, step):
        return max(1, self.processors // 2) if step.slots == "half" else min(step.slots, self.processors)

    def room(self, job):
        """One processor is left to what only computes, so that what waits in real time does not leave it idle."""
        slots = self.slots(job.step)
        return slots <= self.free and not (job.step.realtime and self.meeting + slots > max(1, self.processors - 1))

    def urgency(self, job):
        return not job.step.stamp, job.step.realtime, -self.steps.index(job.step)

    def environment(self, job):
        reads = job.log + ".reads"
        return dict(os.environ, **self.settings, item=job.item, form=self.form, TETAP_SLOTS=str(int(math.ceil(self.slots(job.step)))), TETAP_READS=reads,
                    WITH_VCAN_HOW="--private"), reads

    def stamp(self, job):
        step, words = job.step, f"{job.step.command}\n{job.item}\n{sorted(self.settings.items())}"
        inputs = [pattern.replace("$item", job.item) for pattern in step.inputs]
        optional = [pattern for pattern in step.optional if stamps.matches(self.table.root, pattern)]
        stamp, missing = self.stamps.declared(words, [*inputs, *optional], step.data, step.tools, ["TETAP_*", *step.environment])
        return stamp, [pattern for pattern in missing if pattern not in optional]

    def run(self, job):
        stamp = None
        if job.step.stamp:
            stamp, missing = self.stamp(job)
            if missing and (failed := self.failed_before(job.step)):
                return self.end(job, NOT_RUN, f"needs {' '.join(failed)}")
            if missing:
                return self.end(job, 1, f"not there, so the step cannot run: {' '.join(missing)}")
            record = None if self.fresh else self.stamps.passed(job.name, stamp, job.step.makes)
            if record:
                job.unchanged, job.note = True, f"unchanged; {record['wall']:.1f} s at {record['at']}"
                return self.end(job, 0)
            self.stamps.forget(job.name)
        status = self.execute(job)
        if status == 0 and stamp:
            self.keep(job, stamp)
        if status not in (0, SKIPPED) and job.step.realtime and not self.stopped and not bytes_differ(self.text(job)):
            with self.lock:
                self.again.append((job, stamp))
            return None
        return self.end(job, status)

    def keep(self, job, stamp):
        reads = []
        if os.path.exists(job.log + ".reads"):
            with open(job.log + ".reads", encoding="utf-8") as file:
                reads = file.read().split("\n")
            os.remove(job.log + ".reads")
        paths = {os.path.relpath(path, self.table.root) if path.startswith(self.table.root + os.sep) else path for path in reads if path}
        changed = [path for path in paths if os.path.getmtime(os.path.join(self.table.root, path)) > job.begun]
        if not changed:
            self.stamps.keep(job.name, stamp, {"wall": job.wall, "cpu": job.cpu, "at": time.strftime("%Y-%m-%d %H:%M"), "log": job.log}, paths)

    def execute(self, job):
        environment, _ = self.environment(job)
        os.makedirs(os.path.dirname(job.log), exist_ok=True)
        job.begun, began = time.time(), time.monotonic()
        with open(job.log, "w", encoding="utf-8") as log:
            niceness = 0 if job.step.realtime else BESIDE
            process = subprocess.Popen(["nice", "-n", str(niceness), "bash", "-c", job.step.command], cwd=self.table.root, env=environment, stdin=subprocess.DEVNULL,
                                       stdout=log, stderr=subprocess.STDOUT, start_new_session=True)
            with self.lock:
                self.groups.add(process.pid)
            watch = Watch(process.pid, job.log, self.table.limits[self.form])
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            stopped = watch.end()
            self.kill(process.pid)  # child processes that still run
            with self.lock:
                self.groups.discard(process.pid)
        job.wall, job.cpu = time.monotonic() - began, used.ru_utime + used.ru_stime
        job.note = stopped
        return STOPPED if stopped else process.returncode

    @staticmethod
    def kill(group, how=signal.SIGTERM):
        try:
            os.killpg(group, how)
        except (ProcessLookupError, PermissionError):
            pass

    @staticmethod
    def text(job):
        try:
            with open(job.log, encoding="utf-8", errors="replace") as file:
                return file.read()
        except OSError:
            return ""

    def end(self, job, status, note=""):
        job.status, job.note = status, note or job.note
        with self.lock:
            jobs = self.jobs[job.step.name]
            done = all(one.status is not None for one in jobs)
            if done:
                self.ended.add(job.step.name)
        if done:
            self.tell(job.step, jobs)

    # -- a failed meeting in real time, once more with nothing of ours beside it
    def judge_again(self, job, stamp):
        os.replace(job.log, job.log + ".before")
        busy, began = busy_s(), time.monotonic()
        status = self.execute(job)
        foreign = max(0.0, busy_s() - busy - job.cpu) / ((time.monotonic() - began) * self.processors)
        if status == 0 and stamp:
            self.keep(job, stamp)
        if status == TOO_SLOW and not bytes_differ(self.text(job)):
            return self.end(job, SKIPPED, f"not judged: machine too slow ({self.text(job).strip().splitlines()[-1].strip()}; {job.log})")
        if status not in (0, SKIPPED) and foreign > FOREIGN_SHARE and not bytes_differ(self.text(job)):
            return self.end(job, SKIPPED, f"not judged: machine too slow (others took {100 * foreign:.0f} % of the {self.processors} processors; {job.log})")
        return self.end(job, status, f"at the second try, alone; the first is in {job.log}.before" if status == 0 else "")

    # -- all
    def tell(self, step, jobs):
        wall, cpu = sum(job.wall for job in jobs), sum(job.cpu for job in jobs)
        bad = [job for job in jobs if job.status not in (0, SKIPPED, NOT_RUN)]
        needs = [job for job in jobs if job.status == NOT_RUN]
        skipped = [job for job in jobs if job.status == SKIPPED]
        status = bad[0].status if bad else NOT_RUN if needs else SKIPPED if len(skipped) == len(jobs) else 0
        self.results[step.name] = (wall, cpu, status)
        unchanged = sum(job.unchanged for job in jobs)
        figures = f"{wall:7.1f} s {cpu:7.1f} s CPU" if unchanged < len(jobs) else ""
        if bad:
            text = "FAILED " + figures
        elif status == NOT_RUN:
            text = "not run: " + needs[0].note
        elif status == SKIPPED:
            text = "skipped: " + (skipped[0].note or (self.text(skipped[0]).strip().splitlines() or ["without a reason"])[-1])
        elif unchanged == len(jobs):
            text = "ok (unchanged" + (jobs[0].note.removeprefix("unchanged") if len(jobs) == 1 else f", {len(jobs)} parts") + ")"
        else:
            text = "ok     " + figures + (f"  ({unchanged} of {len(jobs)} unchanged)" if unchanged else "") + "".join(f"  ({job.note})" for job in jobs if job.note and not job.unchanged)
        with self.lock:
            self.say(f"{step.name:24} {text}")
            for job in bad:
                self.say(f"    {job.name}: status {job.status}{': ' + job.note if job.note else ''} ({job.log})")
                for line in self.text(job).splitlines()[-TAIL:]:
                    self.say(f"    {line}")

    def failed_before(self, step):
        """Steps that this one comes after and that have not passed."""
        return [name for name in step.after if name in self.results and self.results[name][2] not in (0, SKIPPED)]

    def make_jobs(self, step):
        items, status, reason = None, 1, ""
        failed = self.failed_before(step)
        unbuilt = [name for name in failed if not self.jobs[name][0].step.stamp]
        try:
            items = None if unbuilt else self.table.items(step)
        except TableError as error:
            reason = str(error)
        if items is None and failed:
            status, reason = NOT_RUN, f"needs {' '.join(unbuilt or failed)}"
        jobs = [Job(step, item, os.path.join(self.out, (step.name + "." + os.path.basename(item) if item else step.name) + ".log")) for item in items or [""]]
        self.jobs[step.name] = jobs
        if items is None:
            self.end(jobs[0], status, reason)
            return []
        return jobs

    def work(self, job):
        try:
            self.run(job)
        except Exception as error:  # a step's failure, not the end of all others
            self.end(job, 1, f"{type(error).__name__}: {error}")
        with self.wake:
            self.free += self.slots(job.step)
            self.meeting -= self.slots(job.step) * job.step.realtime
            self.running -= 1
            self.wake.notify()

    def all(self):
        """True when nothing failed."""
        waiting = list(self.steps)
        names = {step.name for step in self.steps}
        queue = []
        self.free, self.meeting, self.running = float(self.processors), 0.0, 0
        with self.wake:
            while (waiting or queue or self.running) and not self.stopped:
                for step in [one for one in waiting if not (set(one.after) & names) - self.ended_or_later()]:
                    waiting.remove(step)
                    queue += [job for job in self.make_jobs(step)]
                queue.sort(key=self.urgency, reverse=True)
                started = False
                for job in list(queue):
                    if self.room(job):
                        queue.remove(job)
                        self.free -= self.slots(job.step)
                        self.meeting += self.slots(job.step) * job.step.realtime
                        self.running += 1
                        threading.Thread(target=self.work, args=[job], daemon=True).start()
                        started = True
                if self.running:
                    self.wake.wait(timeout=1.0)
                elif not started and waiting and not queue:
                    raise TableError(f"these wait for each other: {' '.join(step.name for step in waiting)}")
        for job, stamp in self.again:
            if not self.stopped:
                self.judge_again(job, stamp)
        self.stamps.contents.save()
        return self.report()

    def ended_or_later(self):
        return self.ended | {job.step.name for job, _ in self.again}

    def stop(self, *_):
        self.stopped = True
        for group in list(self.groups):
            self.kill(group)

    def report(self):
        order = [(step.name, *self.results[step.name]) for step in self.steps if step.name in self.results]
        with open(os.path.join(self.out, "times.tsv"), "w", encoding="utf-8") as file:
            file.write("step\twall_s\tcpu_s\tstatus\n")
            file.writelines(f"{name}\t{wall:.3f}\t{cpu:.3f}\t{status}\n" for name, wall, cpu, status in order)
        spent = [row for row in order if row[1] > 0.05]
        if spent:
            self.say("\nwhere the time went" + " " * 9 + "wall       CPU")
            for name, wall, cpu, status in sorted(spent, key=lambda row: -row[2]):
                self.say(f"  {name:22} {wall:7.1f} s {cpu:7.1f} s{WORDS.get(status, '  FAILED')}")
        whole = time.monotonic() - self.began
        self.say(f"  {'from begin to end':22} {whole:7.1f} s {sum(row[2] for row in order):7.1f} s on {self.processors} processors")
        failed = [name for name, _, _, status in order if status not in (0, SKIPPED, NOT_RUN)]
        unrun = [name for name, _, _, status in order if status == NOT_RUN]
        if self.stopped:
            self.say("stopped; what has passed is kept")
        if failed:
            self.say(f"failed: {' '.join(failed)}")
        if unrun:
            self.say(f"not run, as what they need failed: {' '.join(unrun)}")
        skipped = sum(status == SKIPPED for *_, status in order)
        self.say(f"\n{len(order) - len(failed) - skipped - len(unrun)} passed, {len(failed)} failed, {skipped} skipped" + (f", {len(unrun)} not run" if unrun else ""))
        return not failed and not unrun and not self.stopped


def begin_proof(kept):
    """A proof that was not finished goes on where it was; otherwise one begins, and no stamp of an earlier one counts."""
    mark = os.path.join(kept, "begun")
    if os.path.exists(mark):
        return False
    if os.path.isdir(kept):
        for name in os.listdir(kept):
            if name.endswith(".json") and name != "contents.json":
                os.remove(os.path.join(kept, name))
    os.makedirs(kept, exist_ok=True)
    with open(mark, "w", encoding="utf-8") as file:
        file.write(time.strftime("%Y-%m-%d %H:%M\n"))
    return True


def main(root):
    parser = argparse.ArgumentParser(prog="run_checks", description="Runs the steps of tools/proof/steps.toml: all, or those named.",
                                     epilog="TETAP_FRESH=1: runs also what is unchanged since it passed. `proof` does so always, but goes on with one that was interrupted.")
    parser.add_argument("form", help="test (prefixes and samples) or proof (whole lengths)")
    parser.add_argument("steps", nargs="*", metavar="STEP")
    parser.add_argument("--table", default=os.path.join(root, "tools", "proof", "steps.toml"), metavar="FILE")
    parser.add_argument("--root", default=root, metavar="DIR")
    parser.add_argument("--list", action="store_true", help="only print the steps")
    options = parser.parse_intermixed_args()
    try:
        table = Table(os.path.realpath(options.root), options.table)
        steps = table.chosen(options.form, options.steps)
    except TableError as error:
        print(f"run_checks: {error}", file=sys.stderr)
        sys.exit(2)
    if options.list:
        print("\n".join(step.name for step in steps))
        return
    out = os.path.join(table.root, "out", "prove")
    kept = os.path.join(out, "stamps" if options.form != "proof" else "stamps_of_proof")
    os.makedirs(out, exist_ok=True)
    fresh = os.environ.get("TETAP_FRESH", "") not in ("", "0")
    if options.form == "proof":
        if fresh and os.path.exists(os.path.join(kept, "begun")):
            os.remove(os.path.join(kept, "begun"))
        if not begin_proof(kept):
            print("goes on with the proof that was not finished (TETAP_FRESH=1: begins anew)")
        fresh = False
    runner = Runner(table, options.form, steps, stamps.Stamps(table.root, kept), out, fresh, say=lambda text: print(text, flush=True))
    signal.signal(signal.SIGINT, runner.stop)
    signal.signal(signal.SIGTERM, runner.stop)
    try:
        good = runner.all()
    except TableError as error:
        print(f"run_checks: {error}", file=sys.stderr)
        sys.exit(2)
    if good and options.form == "proof" and not options.steps:
        os.remove(os.path.join(kept, "begun"))
    sys.exit(0 if good else 1)
