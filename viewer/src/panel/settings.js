// What a person chose, kept in the browser where it allows that.

export function kept(name) {
  try {
    return localStorage.getItem(`posed.${name}`);
  } catch {
    return null;
  }
}

export function keep(name, value) {
  try {
    localStorage.setItem(`posed.${name}`, value);
  } catch {
    // a private window: the choice holds until it closes
  }
}
