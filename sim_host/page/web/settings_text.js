// SPDX-License-Identifier: Apache-2.0
// A robot and its changed numbers as one line of text, which any copy of the page takes: also behind the # of its address.

const MOST = 20000;

/** "rover;gnss.sigma_scale=1.5;gyro.up_s=0,0,1" */
export function textOf(robot, numbers) {
  return [robot, ...Object.entries(numbers).map(([path, values]) => `${path}=${values.join(",")}`)].join(";");
}

/** {robot, numbers}, or null where the text is none. Names and limits are the module's to judge. */
export function parsed(text) {
  let plain = String(text).trim().replace(/^#/, "");
  if (plain.length === 0 || plain.length > MOST) return null;
  try {
    plain = decodeURIComponent(plain);
  } catch {
    return null;
  }
  const [robot, ...rest] = plain.split(";"), numbers = Object.create(null);
  if (!/^[a-z][a-z0-9_]{0,63}$/.test(robot)) return null;
  for (const one of rest) {
    const found = /^([a-z][a-z0-9_.]{0,99})=([-+0-9.,eE]{1,400})$/.exec(one);
    if (!found) return null;
    const values = found[2].split(",").map((value) => (value === "" ? NaN : Number(value)));
    if (!values.every(Number.isFinite)) return null;
    numbers[found[1]] = values;
  }
  return { robot, numbers };
}
