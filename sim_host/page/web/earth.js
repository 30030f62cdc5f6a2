// SPDX-License-Identifier: Apache-2.0
// WGS 84: places on the Earth in the axes of a map, east, north and up.
const A_M = 6378137, F = 1 / 298.257223563, E2 = F * (2 - F);

function ecef([latitude, longitude, height]) {
  const p = (latitude * Math.PI) / 180, l = (longitude * Math.PI) / 180;
  const n = A_M / Math.sqrt(1 - E2 * Math.sin(p) ** 2);
  return [(n + height) * Math.cos(p) * Math.cos(l), (n + height) * Math.cos(p) * Math.sin(l), (n * (1 - E2) + height) * Math.sin(p)];
}

/** (place) -> [east, north, up] in metres; both are [latitude in degrees, longitude in degrees, height in m]. */
export function mapAt(origin) {
  const o = ecef(origin), p = (origin[0] * Math.PI) / 180, l = (origin[1] * Math.PI) / 180;
  return (place) => {
    const [x, y, z] = ecef(place).map((value, i) => value - o[i]);
    const ahead = Math.cos(l) * x + Math.sin(l) * y;
    return [Math.cos(l) * y - Math.sin(l) * x, Math.cos(p) * z - Math.sin(p) * ahead, Math.cos(p) * ahead + Math.sin(p) * z];
  };
}
