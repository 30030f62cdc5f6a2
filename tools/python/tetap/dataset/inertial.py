# SPDX-License-Identifier: Apache-2.0
"""Shared parts of the importers of inertial sets: body axes, IMU samples as increments, GNSS fixes, places on the ellipsoid."""
import numpy as np

from tetap.can import bus_writer

INTERVAL_MAX_US = 65_534
EQUATOR_M, FLATTENING = 6378137.0, 1 / 298.257223563  # WGS84


def to_ecef(lat_deg, lon_deg, height_m):
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    e2 = FLATTENING * (2 - FLATTENING)
    n = EQUATOR_M / np.sqrt(1 - e2 * np.sin(lat) ** 2)
    return np.stack([(n + height_m) * np.cos(lat) * np.cos(lon), (n + height_m) * np.cos(lat) * np.sin(lon),
                     (n * (1 - e2) + height_m) * np.sin(lat)])


def east_north_up(lat_deg, lon_deg):
    """Rows: east, north and up of a place, in earth-centred axes; of places 3 x 3 x n."""
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    return np.array([[-np.sin(lon), np.cos(lon), 0.0 * lon],
                     [-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)],
                     [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]])


def to_enu(lat_deg, lon_deg, height_m):
    """East, north, up of the first position (by way of earth-centred coordinates)."""
    ecef = to_ecef(np.asarray(lat_deg), np.asarray(lon_deg), np.asarray(height_m))
    return east_north_up(lat_deg[0], lon_deg[0]) @ (ecef - ecef[:, :1])


def from_enu(enu_m, origin):
    """Latitude, longitude [deg] and height [m] of places given in the plane of an origin (lat_deg, lon_deg, height_m)."""
    x, y, z = to_ecef(*origin)[:, None] + east_north_up(*origin[:2]).T @ np.asarray(enu_m)
    e2 = FLATTENING * (2 - FLATTENING)
    lon, flat = np.arctan2(y, x), np.hypot(x, y)
    lat = np.arctan2(z, flat * (1 - e2))
    for _ in range(6):  # each round gains two digits or more
        n = EQUATOR_M / np.sqrt(1 - e2 * np.sin(lat) ** 2)
        height = flat / np.cos(lat) - n
        lat = np.arctan2(z, flat * (1 - e2 * n / (n + height)))
    return np.degrees(lat), np.degrees(lon), height


def forward_left_up(forward_right_down):
    """Columns x y z of a body with z down in those of REP-103."""
    return np.asarray(forward_right_down) * np.array([1.0, -1.0, -1.0])


def add_imu(recording, imu, arrival):
    """IMU rows (rate [rad/s] in columns 1 to 3 and specific force [m/s2] in 4 to 6 of `data`) times the time since the row before."""
    interval = np.diff(imu.time_us)
    nominal = int(np.median(interval))
    long = interval > INTERVAL_MAX_US
    interval = np.where(long, nominal, interval)
    used = interval > 0
    recording.dropped("IMU samples without one before them", 1 + np.count_nonzero(~used))
    if long.any():
        recording.about["imu_gaps"] = int(long.sum())
        recording.about["notes"].append("IMU samples after a gap carry the nominal interval")
    imu, arrival, interval = imu.keep(np.append(False, used)), arrival[1:][used], interval[used]
    angle, velocity = imu.data[:, 1:4] * interval[:, None] * 1e-6, imu.data[:, 4:7] * interval[:, None] * 1e-6
    inside = recording.log.inside(len(interval), In_Imu0Gyro=dict(zip(("AngX", "AngY", "AngZ"), angle.T)),
                                  In_Imu0Accel=dict(zip(("VelX", "VelY", "VelZ"), velocity.T)))
    recording.dropped("IMU samples beyond their signals' range", np.count_nonzero(~inside))
    imu, arrival, interval, angle, velocity = imu.keep(inside), arrival[inside], interval[inside], angle[inside], velocity[inside]
    seq = np.arange(len(interval)) & 15
    stamp = recording.log_us(imu.time_us)
    at, add = recording.log_us(arrival), recording.log.add
    add("In_Imu0Gyro", at, AngX=angle[:, 0], AngY=angle[:, 1], AngZ=angle[:, 2], Seq=seq)
    add("In_Imu0Accel", at, VelX=velocity[:, 0], VelY=velocity[:, 1], VelZ=velocity[:, 2], Seq=seq)
    add("In_Imu0Time", at, Stamp=stamp & bus_writer.STAMP_MASK, Interval=interval, Temp=np.nan, Seq=seq)


def add_fixes(recording, time_us, arrival_us, lat_deg, lon_deg, height_m, sigma_horizontal_m, sigma_vertical_m, kind):
    """GNSS positions as four frames each; one that a signal cannot hold is left out whole."""
    inside = recording.log.inside(len(time_us), In_GnssLat={"Lat": lat_deg}, In_GnssLon={"Lon": lon_deg}, In_GnssAlt={"Height": height_m},
                                  In_GnssAcc={"Hor": sigma_horizontal_m, "Ver": sigma_vertical_m})
    recording.dropped("fixes beyond their signals' range", np.count_nonzero(~inside))
    time_us, arrival_us, lat_deg, lon_deg, height_m, sigma_horizontal_m, sigma_vertical_m, kind = (
        np.asarray(value)[inside] if np.ndim(value) else value for value in (time_us, arrival_us, lat_deg, lon_deg, height_m, sigma_horizontal_m, sigma_vertical_m, kind))
    recording.sensor("In_GnssLat", time_us, arrival_us, Lat=lat_deg)
    recording.sensor("In_GnssLon", time_us, arrival_us, Lon=lon_deg)
    recording.sensor("In_GnssAlt", time_us, arrival_us, Height=height_m, Fix=kind, NumSv=np.nan)
    recording.sensor("In_GnssAcc", time_us, arrival_us, Hor=sigma_horizontal_m, Ver=sigma_vertical_m)
