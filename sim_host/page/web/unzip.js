// SPDX-License-Identifier: Apache-2.0
// The files of a zip archive, as telephones export recordings (APPNOTE.TXT 6.3: end record, central directory, local headers). Stored or deflated.

const END = 0x06054b50, ENTRY = 0x02014b50, LOCAL = 0x04034b50;
const MOST_BYTES = 256e6, MOST_FILES = 200;

async function inflated(bytes, most) {
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw")).getReader(), parts = [];
  for (let size = 0, next; !(next = await reader.read()).done; parts.push(next.value))
    if ((size += next.value.length) > most) throw new Error("the archive holds more than it says");
  return new Uint8Array(await new Blob(parts).arrayBuffer());
}

export const isZip = (bytes) => bytes.length > 4 && bytes[0] === 0x50 && bytes[1] === 0x4b && bytes[2] === 3 && bytes[3] === 4;

/** [{name, bytes}] of the files for which `wanted(name)` holds. @throws Error of one sentence */
export async function unzipped(bytes, wanted) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength), found = [];
  const need = (at, size) => {
    if (!(at >= 0 && at + size <= bytes.length)) throw new Error("the archive is cut off");
  };
  let end = bytes.length - 22;
  while (end >= Math.max(0, bytes.length - 66000) && view.getUint32(end, true) !== END) end--;
  if (end < Math.max(0, bytes.length - 66000)) throw new Error("the archive has no directory: it is cut off");
  let at = view.getUint32(end + 16, true), total = 0;
  for (let left = Math.min(view.getUint16(end + 10, true), MOST_FILES); left > 0; left--) {
    need(at, 46);
    if (view.getUint32(at, true) !== ENTRY) throw new Error("the archive's directory is broken");
    const [flags, method, packed, size, nameSize, extra, remark, local] = [view.getUint16(at + 8, true), view.getUint16(at + 10, true), view.getUint32(at + 20, true), view.getUint32(at + 24, true),
      view.getUint16(at + 28, true), view.getUint16(at + 30, true), view.getUint16(at + 32, true), view.getUint32(at + 42, true)];
    need(at + 46, nameSize);
    const name = new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + nameSize));
    at += 46 + nameSize + extra + remark;
    if (!wanted(name)) continue;
    if (flags & 1) throw new Error(`${name}: has a password`);
    if (method !== 0 && method !== 8) throw new Error(`${name}: packed in a way that this page does not know (${method})`);
    if ((total += size) > MOST_BYTES) throw new Error("the archive holds more than 256 MB");
    need(local, 30);
    if (view.getUint32(local, true) !== LOCAL) throw new Error(`${name}: is not where the directory has it`);
    const begin = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
    need(begin, packed);
    const data = bytes.subarray(begin, begin + packed);
    found.push({ name, bytes: method === 0 ? data.slice() : await inflated(data, size) });
  }
  return found;
}
