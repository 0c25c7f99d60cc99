// Dragging in the timeline: what is dragged follows the pointer here, and letting go tells the server, once.
(() => {
  let drag = null;
  const frameAt = (lane, x) => {
    const box = lane.getBoundingClientRect(), film = window.trame.state.state.film;
    const share = Math.min(Math.max((x - box.left) / Math.max(box.width, 1), 0), 1);
    return Math.round(film.first + share * (film.last - film.first));
  };
  window.addEventListener('pointerdown', (event) => {
    const lane = event.target.closest && event.target.closest('[data-film-go]');
    if (!lane || event.button !== 0) return;
    const grip = event.target.closest('[data-film-drag]');
    if (!grip) {
      drag = {lane, scrub: true};
      window.trame.trigger('go_to', [frameAt(lane, event.clientX)]);
    } else {
      const bar = grip.closest('.film-bar') || grip;
      drag = {lane, bar, x: event.clientX, what: grip.dataset.filmDrag, part: grip.dataset.part,
        name: grip.dataset.name, frame: Number(grip.dataset.frame), from: frameAt(lane, event.clientX),
        left: bar.offsetLeft, width: bar.offsetWidth, moved: false};
    }
    event.preventDefault();
  }, true);
  window.addEventListener('pointermove', (event) => {
    if (!drag) return;
    if (drag.scrub) {
      const frame = frameAt(drag.lane, event.clientX);
      if (frame !== drag.shown) window.trame.trigger('go_to', [drag.shown = frame]);
      return;
    }
    const by = event.clientX - drag.x;
    drag.moved = drag.moved || Math.abs(by) > 3;
    if (!drag.moved) return;
    if (drag.part === 'key') drag.bar.style.marginLeft = (by - 5) + 'px';
    else if (drag.part === 'all') drag.bar.style.transform = 'translateX(' + by + 'px)';
    else if (drag.part === 'on' || drag.part === 'ease_in') {
      drag.bar.style.transform = 'translateX(' + Math.min(by, drag.width) + 'px)';
      drag.bar.style.width = Math.max(drag.width - by, 2) + 'px';
    } else drag.bar.style.width = Math.max(drag.width + by, 2) + 'px';
  }, true);
  window.addEventListener('pointerup', (event) => {
    const done = drag;
    drag = null;
    if (!done || done.scrub) return;
    const to = frameAt(done.lane, event.clientX);
    for (const name of ['transform', 'width', 'marginLeft']) done.bar.style[name] = '';
    if (!done.moved) {
      window.trame.trigger('go_to', [done.what === 'key' ? done.frame : to]);
      if (done.what === 'span') window.trame.trigger('choose_pair', [done.name]);
    } else if (to !== done.from) {
      const aim = done.part === 'all' ? done.frame + to - done.from : to;
      window.trame.trigger('film_drag', [done.what, done.name, done.frame, done.part, aim]);
    }
  }, true);
})();
