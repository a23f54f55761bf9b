// Keys of the whole page. They rest while a field has the keyboard, so that typing types.

const FIELDS = new Set(['INPUT', 'SELECT', 'TEXTAREA']);

// actions: by key, each a function
export function listenToKeys(actions) {
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    if (FIELDS.has(event.target.tagName) || event.target.isContentEditable) return;
    const action = actions[event.key];
    if (!action) return;
    if (document.querySelector('dialog[open]') && event.key !== '?') return;
    event.preventDefault();
    action();
  });
}
