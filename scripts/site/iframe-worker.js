/* Search runs in a worker, and browsers start none for pages that are files. Here the worker's script runs in
   a hidden frame instead. The search of the theme looks for this name, and MkDocs' plugin `offline` for the
   name of this file. */
class IFrameWorker extends EventTarget {
  constructor(url) {
    super();
    const frame = document.createElement("iframe");
    frame.hidden = true;
    document.body.append(frame);
    const inner = this.inner = frame.contentWindow;
    const load = (source) => new Promise((done, failed) => {
      const script = inner.document.createElement("script");
      Object.assign(script, {src: source, onload: done, onerror: failed});
      inner.document.body.append(script);
    });
    inner.importScripts = (...sources) =>
      sources.reduce((before, source) => before.then(() => load(source)), Promise.resolve());
    inner.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", {data}));
    this.ready = load(url);
  }

  postMessage(data) {
    this.ready.then(() => this.inner.dispatchEvent(new MessageEvent("message", {data})));
  }
}

if (location.protocol === "file:") {
  window.IFrameWorker = IFrameWorker;
  window.Worker = IFrameWorker;
}
