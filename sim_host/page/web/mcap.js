// SPDX-License-Identifier: Apache-2.0
// The log in an MCAP file of `make export` (mcap.dev/spec): an attachment, packed by gzip. Messages of ROS 2 hold no frames, so nothing else of the file is read.

const MAGIC = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a], ATTACHMENT = 9, FOOTER = 2, RECORD_HEAD = 9;
const MOST_UNPACKED = 2e9, MOST_RECORDS = 1e6;

export const isMcap = (bytes) => MAGIC.every((byte, i) => bytes[i] === byte);

async function gunzipped(blob, name) {
  const reader = blob.stream().pipeThrough(new DecompressionStream("gzip")).getReader(), parts = [];
  const next = () => reader.read().catch(() => Promise.reject(new Error(`${name}: cannot be unpacked`)));
  for (let size = 0, part; !(part = await next()).done; parts.push(part.value))
    if ((size += part.value.length) > MOST_UNPACKED) throw new Error(`${name}: holds more than 2 GB`);
  return parts;
}

/** The attachment in a record's content: {name, media, data: Blob}. */
async function attachmentOf(content, file) {
  const head = new DataView(await content.slice(0, 4096).arrayBuffer());
  let at = 16;
  const text = () => {
    const size = at + 4 <= head.byteLength ? head.getUint32(at, true) : Infinity, begin = at + 4;
    if (begin + size > head.byteLength) throw new Error(`${file}: an attachment is broken`);
    at = begin + size;
    return new TextDecoder().decode(new Uint8Array(head.buffer, begin, size));
  };
  const name = text(), media = text(), size = at + 8 <= head.byteLength ? Number(head.getBigUint64(at, true)) : Infinity;
  if (at + 8 + size + 4 > content.size) throw new Error(`${file}: an attachment is broken`);
  return { name, media, data: content.slice(at + 8, at + 8 + size) };
}

/** The log in an MCAP file, a File; null where the file is no MCAP. @throws Error of one sentence */
export async function logOfMcap(file) {
  if (!isMcap(new Uint8Array(await file.slice(0, MAGIC.length).arrayBuffer()))) return null;
  let at = MAGIC.length;
  for (let records = 0; records < MOST_RECORDS && at + RECORD_HEAD <= file.size; records++) {
    const head = new DataView(await file.slice(at, at + RECORD_HEAD).arrayBuffer()), kind = head.getUint8(0), end = at + RECORD_HEAD + Number(head.getBigUint64(1, true));
    if (!(end <= file.size)) throw new Error(`${file.name}: is cut off`);
    if (kind === FOOTER) break;
    if (kind === ATTACHMENT) {
      const { name, media, data } = await attachmentOf(file.slice(at + RECORD_HEAD, end), file.name);
      if (media === "application/gzip" && name.endsWith(".gz")) return new File(await gunzipped(data, `${file.name}: ${name}`), name.slice(0, -3));
    }
    at = end;
  }
  throw new Error(`${file.name}: no log is attached; messages of ROS 2 have no frames. \`make export\` attaches the log`);
}
