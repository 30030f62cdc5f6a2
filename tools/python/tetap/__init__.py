# SPDX-License-Identifier: Apache-2.0
"""tetap in Python: decode, encode, replay, Node, Messages, parameters, doctor, record, Export (api.py). The other folders are the tools' own."""
import importlib

NAMES = ("BadInput", "Export", "Messages", "Node", "decode", "doctor", "encode", "parameters", "record", "replay")


def __getattr__(name):
    if name in NAMES:  # read when it is asked for: a tool needs one folder alone
        return getattr(importlib.import_module("tetap.api"), name)
    raise AttributeError(f"module 'tetap' has no attribute '{name}'")
