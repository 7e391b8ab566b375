// @ts-check
/** Single keys, unless a field is being written in or a dialog is open. */

/** @param {import('./help.js').Action[]} actions keys are of `KeyboardEvent.key`, letters in lower case */
export function listen(actions) {
  const byKey = new Map(actions.flatMap(({ keys, run }) => keys.map((key) => [key, run])));
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = /** @type {HTMLElement} */ (event.target);
    if (target.closest('input:not([type=range]), textarea, select, dialog[open], [contenteditable]')) return;
    if (event.key === ' ' && target.closest('button, a, summary')) return; // it presses that
    const run = byKey.get(event.key.length === 1 ? event.key.toLowerCase() : event.key);
    if (!run) return;
    event.preventDefault();
    run();
  });
}
