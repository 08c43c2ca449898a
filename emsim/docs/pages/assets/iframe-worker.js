// Browsers refuse workers to pages opened from disk; the search index then runs in a hidden frame of the same origin.
if (location.protocol === "file:")
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      frame.srcdoc = "<!doctype html>";
      this.waiting = [];
      frame.onload = () => {
        const inside = frame.contentWindow;
        if (this.inside || !inside) return;
        const script = inside.document.createElement("script");
        // what the worker posts comes out here, what is posted to it is dispatched inside
        inside.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
        script.onload = () => {
          this.inside = inside;
          this.waiting.splice(0).forEach((data) => this.postMessage(data));
        };
        script.src = url;
        inside.document.head.append(script);
      };
      document.body.append(frame);
    }
    postMessage(data) {
      if (this.inside) this.inside.dispatchEvent(new MessageEvent("message", { data }));
      else this.waiting.push(data);
    }
    terminate() {}
  };
