# SPDX-License-Identifier: Apache-2.0
"""A replay with another parameter as an MCAP file: to_ros.py LOG ROBOT PATH VALUE OUT.mcap"""
import sys

import tetap

log, robot, path, value, out = sys.argv[1:]
run = tetap.replay(log, robot, set={path: float(value)})
print("%s: %d messages, %d bytes" % (out, *tetap.Export(run).write_mcap(out)))
