# SPDX-License-Identifier: Apache-2.0
"""Presets of CMakePresets.json by the boards that they have. As a program: presets.py ROOT BOARD prints the preset's name."""
import json
import os
import sys


def preset_of(root, board):
    """The preset whose TETAP_BOARD names that board. LookupError, with the boards that there are, where none does; ValueError where the file is no JSON."""
    with open(os.path.join(root, "CMakePresets.json"), encoding="utf-8") as file:
        try:
            presets = json.load(file)["configurePresets"]
        except ValueError as error:
            raise ValueError(f"CMakePresets.json: {error}") from None
    by_board = {name: one["name"] for one in presets for name in one.get("cacheVariables", {}).get("TETAP_BOARD", "").split(";") if name}
    if board not in by_board:
        raise LookupError(f"no board '{board}'; there are: {' '.join(by_board)} (each is in the TETAP_BOARD of a preset in CMakePresets.json)")
    return by_board[board]


if __name__ == "__main__":
    try:
        print(preset_of(*sys.argv[1:]))
    except (LookupError, ValueError) as error:
        sys.exit(str(error))
