// Small helpers to build the page's elements.

// el('button.quiet', {type: 'button', onclick}, 'text', child...): properties are set as such,
// `data` as data attributes, `aria` as aria attributes.
export function el(name, properties = {}, ...children) {
  const [tag, ...classes] = name.split('.');
  const element = document.createElement(tag);
  if (classes.length > 0) element.className = classes.join(' ');
  const { data = {}, aria = {}, ...rest } = properties;
  Object.assign(element, rest);
  Object.assign(element.dataset, data);
  for (const [key, value] of Object.entries(aria)) element.setAttribute(`aria-${key}`, value);
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

// Writes a text only when it differs, so that nothing is laid out or read out again.
export function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

let lastId = 0;

// A label and its field, tied together: returns the row.
export function labelled(text, field, ...more) {
  lastId += 1;
  field.id ||= `field-${lastId}`;
  return el('div.row', {}, el('label', { htmlFor: field.id }, text), field, ...more);
}
