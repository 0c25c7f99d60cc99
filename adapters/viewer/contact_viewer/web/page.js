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
