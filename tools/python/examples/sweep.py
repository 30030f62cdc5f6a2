# SPDX-License-Identifier: Apache-2.0
"""How one parameter changes the estimate of a recorded log: sweep.py LOG ROBOT PATH VALUE..."""
import sys

import numpy as np
import tetap

log, robot, path, *values = sys.argv[1:]
recorded = tetap.decode(log)
for value in values:
    run = tetap.replay(log, robot, set={path: float(value)})
    away_m = np.hypot(run["Est2_Pos"].X - recorded["Est2_Pos"].X, run["Est2_Pos"].Y - recorded["Est2_Pos"].Y)
    print(f"{path} = {value}: {run.epochs} epochs, at most {np.nanmax(away_m):.3f} m from the record")
