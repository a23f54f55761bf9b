// Keys of the whole page. They rest while a field has the keyboard, so that typing types.

// Fields that take letters, and what takes arrows only.
const isTyping = ({ tagName, type }) =>
  tagName === 'SELECT' || (tagName === 'INPUT' && !['range', 'checkbox', 'file'].includes(type));
const takesArrows = ({ type }) => type === 'range';

// actions: by key, each a function
export function listenToKeys(actions) {
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    if (isTyping(event.target)) return;
    if (event.repeat && !event.key.startsWith('Arrow')) return; // held: once is meant
    if (takesArrows(event.target) && event.key.startsWith('Arrow')) return;
    const action = actions[event.key];
    if (!action) return;
    if (document.querySelector('dialog[open]') && event.key !== '?') return;
    event.preventDefault();
    action();
  });
}
