// What a person chose, kept in the browser; where that may keep nothing, until the page closes.
const here = {};

export function kept(name) {
  try {
    return localStorage.getItem(`posed.${name}`);
  } catch {
    return here[name] ?? null;
  }
}

// value: null forgets the choice
export function keep(name, value) {
  here[name] = value;
  try {
    if (value === null) localStorage.removeItem(`posed.${name}`);
    else localStorage.setItem(`posed.${name}`, value);
  } catch {
    // a private window
  }
}
