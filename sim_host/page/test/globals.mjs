// SPDX-License-Identifier: Apache-2.0
// What browsers have and Debian 12's Node 18 has not: File as a global, and raw deflate in DecompressionStream.
import { File } from "node:buffer";
import { Duplex } from "node:stream";
import { createInflateRaw } from "node:zlib";

globalThis.File ??= File;
try {
  new DecompressionStream("deflate-raw");
} catch {
  const Given = DecompressionStream;
  globalThis.DecompressionStream = function (format) {
    return format === "deflate-raw" ? Duplex.toWeb(createInflateRaw()) : new Given(format);
  };
}
