# SPDX-License-Identifier: Apache-2.0
"""A node that a program of yours feeds: wheels that turn, a tick every 10 ms, and its odometry."""
import tetap

with tetap.Node("rover", set={"wheels.drive.left_radius_m": 0.101}) as node:
    for k in range(1, 500):
        counts = {"Seq": k % 16, "Left": 20 * k % 65536, "Right": 21 * k % 65536}
        node.push([tetap.encode("In_WheelCounts", stamp_s=k * 0.01, Inst=0, **counts)])
        node.tick(0.01 + k * 0.01)
    run = tetap.Messages(node.read())
print(f"x {run['Est0_Pos'].X[-1]:.3f} m, y {run['Est0_Pos'].Y[-1]:.3f} m, heading {run['Est0_Motion'].Yaw[-1]:.3f} rad")
