// The worker from the page's side: questions with one answer each.

export class Core {
  constructor(fault) {
    this.worker = new Worker("worker.js", { type: "module" });
    this.waiting = new Map();
    this.count = 0;
    this.worker.onmessage = ({ data }) => {
      const resolve = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      if (data.type === "fault") fault(data.text);
      resolve?.(data.type === "fault" || data.none ? null : data);
    };
    this.worker.onerror = event => fault(event.message || "the worker did not start");
  }

  /** The answer; null where there is none: a newer run was asked for, or a fault, which is told. */
  ask(type, given = {}) {
    const id = ++this.count;
    this.worker.postMessage({ type, id, ...given });
    return new Promise(resolve => this.waiting.set(id, resolve));
  }
}
