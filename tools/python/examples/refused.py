# SPDX-License-Identifier: Apache-2.0
"""Measurements that a node refused, by sensor and reason: refused.py LOG"""
import collections
import sys

import tetap

events = tetap.decode(sys.argv[1])["Est_Innov"]
reasons = collections.Counter(zip(events.names("Sensor"), events.names("Verdict"), events.names("Check")))
for (sensor, verdict, check), count in reasons.most_common():
    print(f"{sensor:14} {verdict:10} {check:8} {count}")
