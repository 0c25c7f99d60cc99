// The page's own listener: each key once, none from a field of text, and none of ours for the browser itself.
window.addEventListener('keydown', (event) => {
  const from = event.target;
  const typing = from && (from.isContentEditable || ['INPUT', 'TEXTAREA', 'SELECT'].includes(from.tagName));
  if (typing) { if (event.key === 'Escape' || event.key === 'Enter') from.blur(); return; }
  const ctrl = event.ctrlKey || event.metaKey;
  if (event.key.length > 1 && !['Escape', 'Enter', 'Tab', 'Backspace', 'Delete', 'Home', 'End', 'ArrowLeft',
      'ArrowRight', 'ArrowUp', 'ArrowDown', 'F1', 'F2'].includes(event.key)) return;
  if (ctrl && ['r', 'w', 't', 'n', 'l', 'c', 'v', '+', '-', '0', 'i', 'j'].includes(event.key.toLowerCase())
      && !(event.shiftKey && event.key.toLowerCase() === 'a')) return;
  event.preventDefault();
  window.trame.trigger('key', [{key: event.key, ctrl, alt: event.altKey, shift: event.shiftKey}]);
}, true);
window.contactUpload = async (files, how) => {
  for (const file of files) {
    const answer = await fetch('/upload?' + new URLSearchParams({name: file.name, how}),
      {method: 'POST', body: file});
    window.trame.trigger('uploaded', [await answer.text(), answer.ok]);
  }
};
window.addEventListener('dragover', (event) => event.preventDefault());
window.addEventListener('drop', (event) => {
  event.preventDefault();
  window.contactUpload([...event.dataTransfer.files], 'add');
});
window.addEventListener('contextmenu', (event) => { if (event.target.closest('.contact-view')) event.preventDefault(); });
// The mouse over the view goes to the server as it comes: trame-rca's own listener waits for the answer to each event
// before the next, a frame late, and makes one of those that came meanwhile. Touch and the wheel stay with it.
const pointer = {inside: false, held: 0};
const tellPointer = (area, type, event) => {
  const box = area.getBoundingClientRect();
  const told = {type, x: event.clientX - box.left, y: box.height - event.clientY + box.top,
    shift: event.shiftKey, ctrl: event.ctrlKey || event.metaKey, alt: event.altKey};
  window.trame?.client?.getConnection()?.getSession()?.call('trame.rca.event', ['contact_view', 'page', told]).catch(() => {});
};
const BUTTON = ['Left', 'Middle', 'Right'];
for (const type of ['mousedown', 'mousemove', 'mouseup', 'mouseout']) {
  window.addEventListener(type, (event) => {
    const area = document.querySelector('.contact-view .remote-controlled-area');
    if (!area) return;
    const inside = type !== 'mouseout' && area.contains(event.target);
    if (type === 'mousedown') {
      if (!inside || !BUTTON[event.button]) return;
      event.preventDefault(); // no scrolling by the middle button, no dragging of the image
      document.activeElement?.blur();
    }
    if (type === 'mouseout' && event.relatedTarget) return; // still in the page: the next move says where
    if (inside || pointer.held) {
      if (type === 'mousemove') tellPointer(area, 'MouseMove', event);
      else if (BUTTON[event.button] && type === 'mousedown') tellPointer(area, BUTTON[event.button] + 'ButtonPress', event);
      else if (BUTTON[event.button] && type === 'mouseup') tellPointer(area, BUTTON[event.button] + 'ButtonRelease', event);
    } else if (pointer.inside) tellPointer(area, 'MouseLeave', event);
    pointer.inside = inside;
    pointer.held = type === 'mousedown' || pointer.held ? event.buttons : 0;
  }, true);
}
for (const type of ['pointerdown', 'pointermove', 'pointerup', 'pointerenter', 'pointerleave']) {
  window.addEventListener(type, (event) => {
    if (event.pointerType !== 'touch' && event.target.closest?.('.remote-controlled-area')) event.stopImmediatePropagation();
  }, true);
}
// Images come as JPEG, each a rectangle of the view that changed. A canvas takes them in a third of the time of an
// <img>; they are decoded beside the page, and drawn in their order. "drawn" tells those who measure.
const images = {drawn: Promise.resolve(), last: 0};
const showImage = (meta, content) => {
  const number = ++images.last, decoded = createImageBitmap(new Blob([content], {type: meta.type}));
  if (meta.whole) images.whole = number;
  images.drawn = images.drawn.then(async () => {
    const bitmap = await decoded, canvas = document.querySelector('canvas.contact-image');
    if (canvas && number >= (images.whole || 0)) { // else a later one covers it
      if (canvas.width !== meta.w || canvas.height !== meta.h) [canvas.width, canvas.height] = [meta.w, meta.h];
      canvas.getContext('2d', {alpha: false}).drawImage(bitmap, meta.x, meta.y);
      canvas.dataset.drawn = number;
      canvas.dispatchEvent(new CustomEvent('drawn', {detail: meta}));
    }
    bitmap.close();
  }).catch(() => {});
};
const listenToImages = () => {
  const session = window.trame?.client?.getConnection?.()?.getSession?.();
  if (!session) { setTimeout(listenToImages, 20); return; }
  session.subscribe('trame.rca.topic.stream', ([{name, meta, content}]) => {
    if (name === 'contact_view.image') showImage(meta, content);
  });
  session.call('trame.rca.reset', ['contact_view']).catch(() => {}); // one may have come before
};
listenToImages();
