// The stream of tubed-view: newest messages, each acknowledged when it was shown, so that nothing old is ever on its way.

const RETRY_MS = 500;
const WINDOW_MS = 30000;

// Turns times of the viewer's CLOCK_MONOTONIC into the page's. The quickest message of the last minute is taken for one that
// needed no time; a message that lay somewhere is older by that much.
class Clock {
  constructor() { this.forget(); }
  forget() { this.now = {least: Infinity, since: performance.now()}; this.before = Infinity; }
  hear(received_ms) {
    const at = performance.now();
    if (at - this.now.since > WINDOW_MS) {
      this.before = this.now.least;
      this.now = {least: Infinity, since: at};
    }
    this.now.least = Math.min(this.now.least, at - received_ms);
  }
  age(received_ms) { return performance.now() - received_ms - Math.min(this.now.least, this.before); }
}

export class Stream {
  // `on`: {room, estimate, image, connection}, functions that are called with what came.
  constructor(on) {
    this.on = on;
    this.clock = new Clock();
    this.is_open = false;
    this.connect();
  }

  connect() {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/stream`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { this.clock.forget(); this.set_open(true); };
    socket.onmessage = (event) => this.take(event.data);
    socket.onclose = () => { this.set_open(false); setTimeout(() => this.connect(), RETRY_MS); };
    this.socket = socket;
  }

  set_open(is_open) {
    this.is_open = is_open;
    this.on.connection(is_open);
  }

  take(data) {
    if (typeof data === "string") {
      const message = JSON.parse(data);
      if (message.type === "estimate") this.clock.hear(message.received);
      this.on[message.type]?.(message);
      return;
    }
    const head_bytes = new DataView(data).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, head_bytes)));
    this.on.image(head, new Uint8Array(data, 4 + head_bytes));
  }

  // Age of what the viewer received then, in ms.
  age(received_ms) { return this.clock.age(received_ms); }

  // It was shown: the next may come.
  seen(n) { if (this.socket.readyState === WebSocket.OPEN) this.socket.send(`seen ${n}`); }
  wish(wish) { if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(wish)); }
  press(name) { if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({press: name})); }
}
