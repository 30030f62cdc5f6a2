# SPDX-License-Identifier: Apache-2.0
"""The parameter table (src/tetap/param/table.hpp) with a robot's values, as tetap-params prints it."""
import functools
import glob
import json
import os
import subprocess

from tetap.can.bus_writer import BadInput

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.realpath(__file__)), *[os.pardir] * 4))


def program():
    """tetap-params of $TETAP_PROGRAMS, else of the host's build folder, which is built when a robot or the table is newer."""
    folder = os.environ.get("TETAP_PROGRAMS")
    path = os.path.join(folder or os.path.join(ROOT, "build", "host", "sim_host"), "tetap-params")
    if not folder and built_before(path, glob.glob(os.path.join(ROOT, "config", "**", "*.hpp"), recursive=True) + glob.glob(os.path.join(ROOT, "src", "tetap", "param", "*.hpp"))):
        subprocess.run([os.path.join(ROOT, "tools/run/build_preset"), "host:tetap-params"], check=True, stdout=subprocess.DEVNULL)
    return path


def built_before(path, sources):
    return not os.path.exists(path) or os.path.getmtime(path) < max(os.path.getmtime(source) for source in sources)


@functools.lru_cache(maxsize=None)
def rows(robot=None):
    """{path: row} in the order of the members; values are those of `robot`. Raises BadInput for a robot that there is not."""
    done = subprocess.run([program(), "--json", *(["--robot", robot] if robot else [])], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise BadInput(done.stderr.strip().removeprefix("tetap-params: "))
    return {row["path"]: row for row in sorted(json.loads(done.stdout)["parameters"], key=lambda row: row["offset"])}
