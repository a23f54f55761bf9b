// Takes by one name wherever the page shows them. A clip's file has only the take's number, so this
// browser keeps the name that it heard while the take ran.
const KEY = 'posed.takes';
const MOST = 200;

export const takeTitle = (number, name) => `take ${number}${name ? ` “${name}”` : ''}`;

// By log and number, oldest first. A browser may refuse to keep anything.
function names() {
  try {
    return new Map(JSON.parse(localStorage[KEY] ?? '[]'));
  } catch {
    return new Map();
  }
}

export const heardName = (log, number) => names().get(`${log} ${number}`) ?? '';

// file: the log that is written; take: posed.v1.TakeStats
export function hearName(file, { number, name }) {
  const log = file.split('/').pop().replace(/\.plog$/, '');
  if (heardName(log, number) === name) return;
  const known = names();
  known.delete(`${log} ${number}`);
  if (name) known.set(`${log} ${number}`, name);
  try {
    localStorage[KEY] = JSON.stringify([...known].slice(-MOST));
  } catch {
    // then the number must do
  }
}
