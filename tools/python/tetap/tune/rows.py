# SPDX-License-Identifier: Apache-2.0
"""The noise rows that a log may show, and what to record where one does not."""
import dataclasses


@dataclasses.dataclass(frozen=True)
class Row:
    paths: tuple   # rows of the parameter table that have one value together
    record: str    # what a log needs to show it

    @property
    def name(self):
        return self.paths[0]


STRAIGHT_AND_TURNS = "ten minutes with straights and turns at the usual speed"
ROWS = (
    Row(("gnss.sigma_scale",), "ten minutes under open sky"),
    Row(("gnss.sigma_floor_m",), "a receiver that states less than its error; else the row has no work"),
    Row(("gnss.sigma_velocity_floor_mps",), "a receiver that states less than its velocity's error; else the row has no work"),
    Row(("inertial.gyro_radps_rthz",), "turns with GNSS velocity, and none with a spinning wheel"),
    Row(("inertial.accel_mps2_rthz",), "brisk starts and stops with GNSS velocity"),
    Row(("inertial.gyro_bias_radps2_rthz",), "half an hour and more in one piece, with turns"),
    Row(("inertial.accel_bias_mps3_rthz",), "half an hour and more in one piece, with starts and stops"),
    Row(("inertial.wheel_mps",), STRAIGHT_AND_TURNS),
    Row(("inertial.slip_share",), "slow and fast driving, a few minutes each"),
    Row(("inertial.lateral_mps",), STRAIGHT_AND_TURNS),
    Row(("inertial.vertical_mps",), STRAIGHT_AND_TURNS),
    Row(("inertial.still_mps",), "ten stops of ten seconds"),
    Row(("baro.sigma_m",), "climbs with GNSS height"),
    Row(("magnetic.sigma_rad",), "circles in the open, with GNSS velocity"),
    Row(("gyro.noise",), "turns between landmarks or fixes"),
    Row(("wheels.drive.noise_left", "wheels.drive.noise_right"), "straights between landmarks or fixes"),
    Row(("wheels.noise.speed",), "straights between landmarks or fixes"),
    Row(("wheels.noise.yaw_rate",), "turns between landmarks or fixes"),
    Row(("landmark.sigma_range_m",), "landmarks near and far"),
    Row(("landmark.sigma_range_per_m",), "landmarks near and far"),
    Row(("landmark.sigma_bearing_rad",), "landmarks on all sides"),
    Row(("landmark.sigma_range_only_m",), "ranges to beacons on all sides"),
)


def rows_for(table, names=None):
    """[(row, start, (least, most))] of the rows that the robot's table has switched on; raises KeyError for a name that is none of them."""
    known = {row.name: row for row in ROWS}
    wanted = [known[name] for name in names] if names else ROWS
    found = []
    for row in wanted:
        facts = table[row.name]
        if all(table[path]["value"] == facts["value"] for path in row.paths) and facts["value"] > 0:
            found.append((row, facts["value"], (max(facts["minimum"], facts["value"] * 1e-3), facts["maximum"])))
        elif names:
            raise KeyError(row.name)
    return found
