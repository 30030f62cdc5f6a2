# SPDX-License-Identifier: Apache-2.0
"""The topics of ROS 2 that a node's log becomes: which message on which topic, in which frame."""
import numpy as np

from tetap.dataset import occupancy, planar_scans
from tetap.dataset.inertial import east_north_up, from_enu
from tetap.export import cdr, estimates

BODY, MAP, ODOM = "base_link", "map", "odom"
ROS_NONE, ROS_FIX, ROS_GBAS = -1, 0, 2  # NavSatStatus
DIAGONAL_KNOWN, KNOWN = 2, 3  # NavSatFix.position_covariance_type


class Topic:
    """Messages of one type on one topic: `time_us` by the node's clock, `columns` by path (export/cdr.py), `given` texts and lengths.
    `table` has further columns of its CSV."""

    def __init__(self, name, kind, time_us, columns, given, table=None):
        self.name, self.kind, self.time_us, self.columns, self.given, self.table = name, kind, time_us, columns, given, table or {}

    def __len__(self):
        return len(self.time_us)

    def rows(self, offset_us):
        """CDR bytes, a message a row; stamps are the node's time and so many us."""
        second, micro = np.divmod(self.time_us + offset_us, 1_000_000)
        stamps = {path + ".stamp.": (second, micro * 1000) for path in _headers(self.kind, self.given)}
        columns = {path + field: value for path, pair in stamps.items() for field, value in zip(("sec", "nanosec"), pair)}
        return cdr.Shape(self.kind, self.given).rows(len(self), {**columns, **self.columns})


def _headers(kind, given):
    return [f"transforms[{i}].header" for i in range(given["transforms"])] if kind == "tf2_msgs/TFMessage" else ["header"]


def vector(path, values, axes="xyz"):
    return {f"{path}.{axis}": values[:, i] for i, axis in enumerate(axes)}


def quaternion(path, q):
    return vector(path, q[:, [1, 2, 3, 0]], "xyzw")


def origin(messages):
    """(latitude, longitude [deg], height [m]) that the node last published; None where it has none."""
    pages = [messages["Est_Origin", name] for name in ("Lat", "Lon", "Height")]
    last = [page[name][page.Source > 0][-1:] for page, name in zip(pages, ("Lat", "Lon", "Height"))]
    place = np.concatenate(last)
    return tuple(place) if len(place) == 3 and np.isfinite(place).all() else None


def odometry(one, name, place):
    """nav_msgs/Odometry: pose in map or odom, twist in base_link, both with their covariances."""
    columns = {**vector("pose.pose.position", one.position), **quaternion("pose.pose.orientation", one.q),
               "pose.covariance": one.pose_covariance.reshape(len(one), 36), **vector("twist.twist.linear", one.linear),
               **vector("twist.twist.angular", one.angular), "twist.covariance": one.twist_covariance.reshape(len(one), 36)}
    table = {}
    if place and not one.is_odometry:
        table = dict(zip(("latitude_deg", "longitude_deg", "height_m"), from_enu(one.position.T, place)))
    return Topic(name, "nav_msgs/Odometry", one.time_us, columns,
                 {"header.frame_id": ODOM if one.is_odometry else MAP, "child_frame_id": BODY}, table)


def position_on_earth(one, name, place):
    """sensor_msgs/NavSatFix of the body's origin: the estimate of the map frame as a place of WGS84, its covariance along the axes there."""
    latitude, longitude, altitude = from_enu(one.position.T, place)
    turn = east_north_up(*place[:2]).T
    to_local = east_north_up(latitude, longitude).transpose(2, 0, 1) @ turn
    covariance = (to_local @ one.pose_covariance[:, :3, :3] @ to_local.transpose(0, 2, 1)).reshape(len(one), 9)
    return Topic(name, "sensor_msgs/NavSatFix", one.time_us,
                 {"latitude": latitude, "longitude": longitude, "altitude": altitude, "position_covariance": covariance,
                  "position_covariance_type": KNOWN}, {"header.frame_id": BODY})


def transforms(found):
    """tf2_msgs/TFMessage. With an odometry map -> odom -> base_link as REP-105 has them, at the odometry's epochs; else the primary estimator's
    frame -> base_link."""
    primary = found[-1]
    wheels = next((one for one in found if one.is_odometry), None)
    if wheels is None or wheels is primary:
        return _transform_topic(primary.time_us, [(ODOM if primary.is_odometry else MAP, BODY, primary.position, primary.q)])
    _, mine, its = np.intersect1d(primary.epoch, wheels.epoch, return_indices=True)
    p, q, inner, turned = primary.position[mine], primary.q[mine], wheels.position[its], wheels.q[its]
    q_mo = estimates.multiply(q, turned * (1, -1, -1, -1))
    p_mo = p - (estimates.matrix(q_mo) @ inner[:, :, None])[:, :, 0]
    return _transform_topic(primary.time_us[mine], [(MAP, ODOM, p_mo, q_mo), (ODOM, BODY, inner, turned)])


def _transform_topic(time_us, links, name="/tf"):
    columns, given = {}, {"transforms": len(links)}
    for i, (parent, child, position, q) in enumerate(links):
        path = f"transforms[{i}]."
        given.update({path + "header.frame_id": parent, path + "child_frame_id": child})
        columns.update({**vector(path + "transform.translation", position), **quaternion(path + "transform.rotation", q)})
    return Topic(name, "tf2_msgs/TFMessage", time_us, columns, given)


def mounting(time_us, frame, place):
    """Where a scanner is on the body: x, y [m] and yaw [rad]."""
    return _transform_topic(np.array([time_us]), [(BODY, frame, np.array([[*place[:2], 0.0]]), estimates.about_up(np.array([place[2]])))], "/tf_static")


def together(*parts):
    """Places in each of several messages of one sample: the frames of equal Seq that follow each other, the last of which completes it."""
    last = parts[-1]
    rows, whole = [], np.ones(len(last), bool)
    for part in parts[:-1]:
        before = np.searchsorted(part.at, last.at) - 1
        whole &= (before >= 0) & (part.Seq[before] == last.Seq if len(part) else False)
        rows.append(before)
    return [row[whole] for row in rows] + [np.flatnonzero(whole)]


def imu(messages, clock, instance, name):
    """sensor_msgs/Imu: rates and specific force along the sensor's axes, as means over the sample's interval; no orientation."""
    parts = [messages[f"In_Imu{instance}{part}"] for part in ("Gyro", "Accel", "Time")]
    turn, push, when = together(*parts)
    gyro, accel, time = parts
    interval = time.Interval[when] * 1e-6
    rate = np.stack([gyro[f"Ang{axis}"][turn] for axis in "XYZ"], axis=1)
    force = np.stack([accel[f"Vel{axis}"][push] for axis in "XYZ"], axis=1)
    good = (interval > 0) & np.isfinite(rate).all(axis=1) & np.isfinite(force).all(axis=1)
    stamp = clock.stamps(time.at[when], time.Stamp[when])[good]
    absent = np.zeros((np.count_nonzero(good), 9))
    absent[:, 0] = -1  # sensor_msgs/Imu: no estimate of the orientation
    return Topic(name, "sensor_msgs/Imu", stamp,
                 {**vector("angular_velocity", rate[good] / interval[good, None]), **vector("linear_acceleration", force[good] / interval[good, None]),
                  "orientation.w": 1.0, "orientation_covariance": absent}, {"header.frame_id": f"imu{instance}"})


def fix(messages, clock, instance, name):
    """sensor_msgs/NavSatFix of one receiver: its antenna's place and its own accuracy."""
    latitude, longitude, height, accuracy = parts = [messages[f"In_Gnss{part}"] for part in ("Lat", "Lon", "Alt", "Acc")]
    lat, lon, alt, acc = together(*parts)
    level, up = accuracy.Hor[acc], accuracy.Ver[acc]
    good = (accuracy.Inst[acc] == instance) & np.isfinite(latitude.Lat[lat]) & np.isfinite(longitude.Lon[lon]) & np.isfinite(level)
    covariance = np.zeros((len(acc), 9))
    covariance[:, 0] = covariance[:, 4] = level ** 2
    covariance[:, 8] = np.where(np.isfinite(up), up ** 2, estimates.UNKNOWN)
    kinds = messages.tables["GnssFix"]
    status = {code: ROS_NONE if word in ("None", "TimeOnly", "NotAvailable") else ROS_FIX if word in ("Fix2D", "Fix3D") else ROS_GBAS for code, word in kinds.items()}
    return Topic(name, "sensor_msgs/NavSatFix", clock.stamps(accuracy.at[acc], accuracy.Stamp[acc])[good],
                 {"latitude": latitude.Lat[lat][good], "longitude": longitude.Lon[lon][good], "altitude": height.Height[alt][good],
                  "status.status": [status.get(code, ROS_NONE) for code in height.Fix[alt][good].tolist()], "position_covariance": covariance[good],
                  "position_covariance_type": DIAGONAL_KNOWN}, {"header.frame_id": f"gnss{instance}"})


def scans(messages, clock, name):
    """sensor_msgs/LaserScan, a topic for each scanner and number of beams. A beam without an echo is infinite, one that is missing NaN (REP-117)."""
    head, ranges = planar_scans.of_log(messages)
    topics = []
    for instance, count in sorted(set(zip(head.Inst.tolist(), head.Count.tolist()))):
        mine = np.flatnonzero((head.Inst == instance) & (head.Count == count))
        values = np.stack([ranges[k] for k in mine])
        first, step = head.First[mine], head.Step[mine]
        topics.append(Topic(f"{name}{instance}", "sensor_msgs/LaserScan", clock.stamps(head.at[mine], head.Stamp[mine]),
                            {"angle_min": first, "angle_max": first + step * (count - 1), "angle_increment": step, "range_min": planar_scans.STEP_M,
                             "range_max": planar_scans.MAX_M, **({"ranges": np.where(values == 0, np.inf, values)} if count else {})},
                            {"header.frame_id": f"laser{instance}", "ranges": count, "intensities": 0}))
    return topics


def grid(drawn, time_us, name="/map"):
    """nav_msgs/OccupancyGrid of a grid (dataset/occupancy.py): rows from below, 0 free, 100 occupied, -1 unknown."""
    shade = drawn.shade[::-1]
    cells = np.select([shade == occupancy.OCCUPIED, shade == occupancy.FREE], [100, 0], -1).astype(np.int8)
    return Topic(name, "nav_msgs/OccupancyGrid", np.array([time_us]),
                 {"info.resolution": drawn.resolution, "info.width": shade.shape[1], "info.height": shade.shape[0],
                  "info.origin.position.x": drawn.origin[0], "info.origin.position.y": drawn.origin[1], "info.origin.orientation.w": 1.0,
                  "data": cells.reshape(1, -1)}, {"header.frame_id": MAP, "data": cells.size})
