// When the page's script stands still, the browser's compositor covers the page by itself: each feeding puts one of two animations
// back to its beginning, in turn. One that was just put back may not have reached the compositor yet; the other one has.
const FED_MS = 60;  // how often at most the browser is told that the script works

export class Watchdog {
  constructor(covers, silence_ms) {
    this.fed_at = 0;
    this.covers = [...covers].map((cover) => cover.animate(
      [{opacity: 0}, {opacity: 0, offset: 0.99}, {opacity: 1}], {duration: silence_ms, fill: "forwards"}));
  }

  feed() {
    if (performance.now() - this.fed_at < FED_MS) return;
    this.fed_at = performance.now();
    this.covers.push(this.covers.shift());
    // Both when one of them has covered the page: the script was late and is back.
    const is_late = this.covers.some((cover) => cover.playState === "finished");
    for (const cover of is_late ? this.covers : [this.covers[0]]) {
      cover.currentTime = 0;
      cover.play();
    }
  }
}
