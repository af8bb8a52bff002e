// Plays frames: with a button, a slider, a choice of speeds, and keys.

/** A player that takes `duration` seconds at speed 1; `show` draws a place among the frames, from 0 to the last one. */
function createPlayer(duration, show) {
  const [animation, slider, button, speed] = ["animation", "time", "play", "speed"].map(byId);
  let place = 0;
  let last = 1;
  /** Request for the next drawing while it plays. */
  let request = null;

  function go(to) {
    place = Math.min(Math.max(to, 0), last);
    slider.value = Math.round((place / last) * Number(slider.max));
    show(place);
  }

  function stop() {
    cancelAnimationFrame(request);
    request = null;
    button.textContent = "Play";
  }

  function stopAt(to) {
    stop();
    go(to);
  }

  function play() {
    if (place >= last) go(0);
    button.textContent = "Pause";
    let before = performance.now();
    const next = (now) => {
      request = requestAnimationFrame(next);
      go(place + (((now - before) / 1e3) * Number(speed.value) * last) / duration);
      before = now;
      if (place >= last) stop();
    };
    request = requestAnimationFrame(next);
  }

  const toggle = () => (request === null ? play() : stop());
  button.addEventListener("click", toggle);
  slider.addEventListener("input", () => stopAt((Number(slider.value) / Number(slider.max)) * last));
  onKeys(animation, {
    " ": toggle,
    ArrowLeft: () => stopAt(Math.ceil(place) - 1),
    ArrowRight: () => stopAt(Math.floor(place) + 1),
    Home: () => stopAt(0),
    End: () => stopAt(last),
  });

  /** Takes other frames, the last of which is number `end` after `time` seconds, and stops at one of them. */
  function load(end, time, at) {
    last = end;
    const slow = Math.round(duration / time);
    byId("slowdown").textContent = slow > 1 ? `At speed 1 it is slowed down ${number(slow, 2)} times.` : "";
    stopAt(at);
  }
  return { stop, stopAt, load };
}
