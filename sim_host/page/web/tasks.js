// SPDX-License-Identifier: Apache-2.0
// The page's end of the worker: the module out of the page's text, and a promise for each task.
import { unpacked } from "./packing.js";

export class TaskQueue {
  static async start() {
    const tasks = new TaskQueue();
    tasks.module = await WebAssembly.compile(await unpacked("module"));
    const code = document.getElementById("worker").textContent;
    tasks.url = URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
    tasks.begin();
    return tasks;
  }
  begin() {
    this.waiting = new Map();
    this.last = 0;
    this.worker = new Worker(this.url);
    this.worker.onmessage = ({ data }) => this.answer(data);
    this.worker.onerror = ({ message }) => this.fail(message || "the worker has ended");
    this.worker.postMessage({ module: this.module });
  }
  answer({ id, share, done, failed, refused, trapped }) {
    const one = this.waiting.get(id);
    if (!one) return;
    if (share !== undefined) return one.progress(share);
    this.waiting.delete(id);
    if (failed === undefined) one.resolve(done);
    else one.reject(Object.assign(new Error(failed), { refused, trapped }));
  }
  fail(why) {
    const waiting = this.waiting;
    this.begin();
    for (const { reject } of waiting.values()) reject(new Error(why));
  }
  /** `progress(share)` may be called before the promise is settled. */
  run(name, values = {}, progress = () => {}) {
    return new Promise((resolve, reject) => {
      const id = ++this.last;
      this.waiting.set(id, { resolve, reject, progress });
      this.worker.postMessage({ id, name, ...values });
    });
  }
}
