#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Robots that make their map, or take scans or images, as Cortex-M7 images in QEMU and as host program: image_identity.py PROGRAMS IMAGES OUT [SECONDS]. Both get the same frames of the
simulated world: sightings and images that come late, others that come too late, more landmarks or keyframes than there is room for, jobs that last many ticks. All frames
that a node sends have to be equal, byte for byte, and one flipped bit of a wheel's count has to change the state's CRC. OUT/identity.json holds the figures."""
import json
import os
import subprocess
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "tools", "python"))
from tetap.can import bus_writer  # noqa: E402

BASE = 0x300
# Options of the world, and what has to have happened: a page of the diagnostics, its field, the least value.
ROBOTS = {
    "mapper": (["--landmarks", "60", "--clutter", "0.3"], {"MapSize": 30, "MapRefused": 1, "TooLate": 1}),
    "mapper_fast": (["--landmarks", "24"], {"MapSize": 15, "MapRefused": 1, "TooLate": 1}),
    "scanner": ([], {"Pairs": 100}),
    "scanner_localize": ([], {"Pairs": 100}),
    "all_round": ([], {"Pairs": 100}),
    "visual": ([], {"Used": 1}),
    "visual_slam": ([], {"Used": 1}),
    "graph128": (["--loop-m", "20", "--laps", "4"], {"MapSize": 90, "Keyframe": 140, "WorkLeft": 1, "Jobs": 5}),
}
LATE_STEPS, TOO_LATE_STEPS = 9, 40  # ticks of 10 ms; the window is 200 ms
DBC = bus_writer.Dbc()
DIAG, INNOV, STATE_CRC, VERSION = (DBC.messages[name].identifier for name in ("Est_Diag", "Est_Innov", "Est_StateCrc", "Est_Version"))
STEP, SIGHTING, IMAGE, WHEELS = (DBC.messages[name].identifier for name in ("In_Sync", "In_RangeBearing", "In_Image", "In_WheelCounts"))
SHOWN = {DBC.messages[message].identifier: (message, fields) for message, fields in {  # what shows that something happened
    "Est_Graph": {"Jobs": "Jobs"}, "Est_Keyframe": {"Id": "Keyframe"}, "Est_Visual": {"Used": "Used"}, "Est_ScanMatch": {"Pairs": "Pairs"}}.items()}
MAP_FIELDS = ("Est_Diag", {name: name for name in ("MapSize", "MapRefused", "WorkLeft")})
TIMED_PAGES, MAP_PAGE = (0, 1), 15  # pages of Est_Diag; the first two have real times
TOO_LATE = DBC.tables["Verdict"]["TooLate"]


def fail(text):
    sys.exit(f"image_identity: {text}")


def run(*words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        fail(f"{' '.join(words)}: status {done.returncode}: {done.stderr.strip() or done.stdout.strip()}")


def frames(path):
    """(identifier, data in hexadecimal) of each line."""
    with open(path, encoding="ascii") as file:
        for line in file:
            identifier, data = line.split()[2].split("#")
            yield int(identifier, 16), data


def is_input(identifier):
    return BASE <= identifier < BASE + 0x20 or BASE + 0x49 <= identifier <= BASE + 0x4F


def delayed(lines):
    """Each seventh sighting, or end of an image, comes some ticks later, each fiftieth after the window."""
    waiting, seen, ticks = {}, 0, 0
    for line in lines:
        identifier = int(line.split()[2].split("#")[0], 16)
        if identifier in (SIGHTING, IMAGE):
            seen += 1
            later = TOO_LATE_STEPS if seen % 50 == 0 else LATE_STEPS if seen % 7 == 0 else 0
            if later:
                waiting.setdefault(ticks + later, []).append(line)
                continue
        yield line
        if identifier == STEP:
            ticks += 1
            yield from waiting.pop(ticks, [])


def flipped(lines):
    """Bit 5 of the first byte of the 300th wheel sample."""
    count = 0
    for line in lines:
        stamp, interface, frame = line.split()
        identifier, data = frame.split("#")
        count += int(identifier, 16) == WHEELS
        if int(identifier, 16) == WHEELS and count == 300:
            count += 1
            data = f"{int(data[:2], 16) ^ 0x20:02X}{data[2:]}"
        yield f"{stamp} {interface} {identifier}#{data}\n"


def inputs_of(path):
    with open(path, encoding="ascii") as file:
        return [line for line in file if is_input(int(line.split()[2].split("#")[0], 16))]


def signal(message, data, name):
    one = DBC.messages[message].signals[name]
    return int.from_bytes(bytes.fromhex(data), "little") >> one.start & ((1 << one.length) - 1)


def sent(path):
    """What the node sent, without the version and the pages of the diagnostics that have real times."""
    return [one for one in frames(path) if not is_input(one[0]) and one[0] != VERSION and not (one[0] == DIAG and int(one[1][:2], 16) & 15 in TIMED_PAGES)]


def largest(all_sent):
    """Largest value of each field that shows what happened, and the count of samples that came after the window."""
    most = {"TooLate": 0}
    for identifier, data in all_sent:
        if identifier == DIAG and int(data[:2], 16) & 15 == MAP_PAGE:
            message, fields = MAP_FIELDS
        elif identifier in SHOWN:
            message, fields = SHOWN[identifier]
        else:
            most["TooLate"] += identifier == INNOV and signal("Est_Innov", data, "Verdict") == TOO_LATE
            continue
        for name, key in fields.items():
            most[key] = max(most.get(key, 0), signal(message, data, name))
    return most


def states(all_sent):
    """State CRC of each epoch: its first 32 bits, without the CRC of the inputs."""
    return [data[:8] for identifier, data in all_sent if identifier == STATE_CRC]


def judge(robot, folder, happened, wrong):
    host, image, other = (sent(os.path.join(folder, name)) for name in ("host/raw.log", "image.log", "image_flipped.log"))
    different = next((i for i, (a, b) in enumerate(zip(host, image)) if a != b), None)
    if different is not None:
        wrong.append(f"{robot}: frame {different} of {len(host)}: host {host[different]}, image {image[different]}")
    if len(host) != len(image):
        wrong.append(f"{robot}: host {len(host)} frames, image {len(image)}")
    most, changed = largest(image), sum(a != b for a, b in zip(states(image), states(other)))
    for name, least in happened.items():
        if most.get(name, 0) < least:
            wrong.append(f"{robot}: {name} reached {most.get(name, 0)} alone, not {least}")
    if not changed:
        wrong.append(f"{robot}: one flipped bit changes no state")
    print(f"  {robot:12} {len(states(image)):6} epochs, {len(image)} frames, {most}, one flipped bit changes {changed} states: {'equal' if host == image else 'DIFFERENT'}")
    return {"epochs": len(states(image)), "frames": len(image), "equal": host == image, "changed_by_a_bit": changed, **most}


def main():
    programs, images, out = sys.argv[1:4]
    seconds = sys.argv[4] if len(sys.argv) > 4 else "100"
    found, wrong = {}, []
    for robot, (options, happened) in ROBOTS.items():
        folder = os.path.join(out, robot)
        os.makedirs(folder, exist_ok=True)
        name = {part: os.path.join(folder, part) for part in ("inputs.log", "flipped.log", "image.log", "image_flipped.log")}
        run(os.path.join(programs, "tetap-world"), "--memory", "--robot", robot, "--seed", "1", "--duration", seconds, "--raw", "--quiet", "--out", folder, *options)
        lines = inputs_of(os.path.join(folder, "raw.log"))
        with open(name["inputs.log"], "w", encoding="ascii") as file:
            file.writelines(delayed(lines))
        with open(name["flipped.log"], "w", encoding="ascii") as file:
            file.writelines(flipped(inputs_of(name["inputs.log"])))
        run(os.path.join(programs, "tetap-play"), name["inputs.log"], "--memory", "--robot", robot, "--raw", "--quiet", "--out", os.path.join(folder, "host"))
        image = os.path.join(images, f"tetap-mps2_m7-{robot}.elf")
        for given, answer in (("inputs.log", "image.log"), ("flipped.log", "image_flipped.log")):
            run("tools/run/emulate_mps2", "--cpu", "m7", image, name[given], name[answer])
        found[robot] = judge(robot, folder, happened, wrong)
    with open(os.path.join(out, "identity.json"), "w", encoding="utf-8") as file:
        json.dump(found, file, indent=2)
        file.write("\n")
    for text in wrong:
        print(f"image_identity: {text}", file=sys.stderr)
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
