// The page's line to the console: what it tells, and what it is told. It comes back where it breaks.

const AGAIN_MS = 1000;
/** How often a page that has given a command says that it is still there, while a person can see it. */
const BEAT_MS = 100;

export class Line {
  /** `act`: told(message), open(whether). */
  constructor(act) {
    this.act = act;
    this.drives = false;
    this.#connect();
    setInterval(() => {
      if (this.drives && document.visibilityState === "visible") this.#send({ kind: "beat" });
    }, BEAT_MS);
  }

  #connect() {
    const socket = new WebSocket(`ws://${location.host}/live${location.search}`);
    this.socket = socket;
    socket.addEventListener("open", () => this.act.open(true));
    socket.addEventListener("message", (event) => this.act.told(JSON.parse(event.data)));
    socket.addEventListener("close", () => {
      // The robots were told to stop: driving begins with a command.
      this.drives = false;
      this.act.open(false);
      setTimeout(() => this.#connect(), AGAIN_MS);
    });
  }

  #send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  command(text) {
    this.drives = true;
    this.#send({ kind: "command", text });
  }

  stop() {
    this.#send({ kind: "stop" });
  }
}
