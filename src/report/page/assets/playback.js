// The button that plays a view.
class Playback {
  // `advance` moves the view by a time in s and returns whether it goes on; `rewind` is called before playing.
  constructor(advance, rewind = () => {}) {
    this.advance = advance;
    this.rewind = rewind;
    this.isRunning = false;
    byId("play").addEventListener("click", () => this.toggle());
  }

  toggle() {
    this.isRunning = !this.isRunning;
    const button = byId("play");
    button.textContent = this.isRunning ? "Pause" : "Play";
    button.setAttribute("aria-pressed", String(this.isRunning));
    if (!this.isRunning) return;
    this.rewind();
    let last = performance.now();
    const step = (now) => {
      if (!this.isRunning) return;
      const goesOn = this.advance(Math.min((now - last) / 1000, 0.25));
      last = now;
      if (goesOn) requestAnimationFrame(step);
      else this.toggle();
    };
    requestAnimationFrame(step);
  }
}
